//! `refraxel inspect`: what a dataset or a run is, and what is wrong with it.

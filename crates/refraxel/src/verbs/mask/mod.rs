//! `refraxel mask`: masks of what is refractive, found by what straight rays cannot explain and by what somebody points at.

mod earlier;
mod finding;
mod paths;
mod pointed;
mod verb;
mod writing;

pub use verb::run;

//! The start page, for people who do not live in a terminal: recent runs, photographs or a video of this machine, what `inspect` says of
//! them, training, and the scene.
//!
//! Every step is a verb of this program in a process of its own, with the words that people would type; the page shows them. The page
//! names folders, which a browser cannot hand over by itself: the server lists those of the machine, for who knows the address.

mod browser;
mod desk;
mod folders;
pub(crate) mod protocol;
mod runs;
mod task;
mod verb;

pub use verb::run;

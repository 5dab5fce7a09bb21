//! Progress on standard error: a bar with the time left in a terminal, now and then a plain line elsewhere.

mod bar;
mod indicator;
mod lines;
mod show;
mod subtask;

pub use indicator::{Progress, counter};
pub(crate) use lines::clock;
pub use show::Show;
pub use subtask::Subtask;

//! `refraxel compare`: shows evaluated runs in a table and side by side.

mod report;
mod rows;
mod verb;
mod wipe;

pub use rows::rows;
pub use verb::run;

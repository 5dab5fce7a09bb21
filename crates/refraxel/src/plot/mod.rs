//! Line plots.

mod curves;
mod drawing;
mod ticks;

pub use curves::{NamedPoint, Plot, Series};
pub use ticks::ticks;

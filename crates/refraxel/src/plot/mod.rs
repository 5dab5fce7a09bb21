//! Line plots of a training run: one description, drawn as PNG or written as SVG.

mod curves;
mod drawing;
mod marks;
mod svg;
mod ticks;

pub use curves::{NamedPoint, Plot, Series};
pub use ticks::ticks;

//! Sheets: labelled images, errors and maps in rows and columns, with bars that explain their colours.

mod colour_scale;
mod content;
mod sheet;

pub use colour_scale::ColourScale;
pub use content::{Content, Line, Map};
pub use sheet::{Panel, Row, Sheet};

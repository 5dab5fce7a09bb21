//! An 8-bit RGB image to draw reports on: rectangles, pictures, anti-aliased lines and text, saved as PNG.

mod line;
mod surface;
mod text;

pub use surface::{Canvas, Colour, Rect};
pub use text::{Align, Font, Style, shortened, text_width};

//! An 8-bit RGB image to draw reports on: rectangles, pictures, anti-aliased lines, text and legends, saved as PNG.

mod legend;
mod line;
mod palette;
mod surface;
mod text;

pub use legend::legend_width;
pub use palette::{FAINT, INK, PALE, PAPER};
pub use surface::{Canvas, Colour, Rect, write_png};
pub use text::{Align, Font, Style, shortened, text_width};

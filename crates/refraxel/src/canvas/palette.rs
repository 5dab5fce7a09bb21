//! Colours of pages.

use super::surface::Colour;

/// What pages are drawn on.
pub const PAPER: Colour = [255; 3];
/// Headings, captions and lines.
pub const INK: Colour = [28, 30, 36];
/// Notes and numbers.
pub const FAINT: Colour = [104, 108, 118];
/// Grids, and frames of what is drawn on.
pub const PALE: Colour = [228, 230, 235];

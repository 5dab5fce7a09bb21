//! Colours of these pictures.
//!
//! Told apart with every kind of colour vision: Okabe & Ito 2008.

use crate::canvas::{Colour, FAINT};

/// Vermilion: views with a warning.
pub const WARNING: Colour = [213, 94, 0];
/// The border of a mask.
pub const BORDER: Colour = [240, 228, 66];

/// The colour of a part of the split.
pub fn of_part(part: &str) -> Colour {
    match part {
        "train" => [0, 114, 178],
        "val" => [0, 158, 115],
        "test" => [204, 121, 167],
        _ => FAINT,
    }
}

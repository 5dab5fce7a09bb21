//! What explains a picture: the meaning of its colours, a bar of colours with its numbers, and a line of known length.

use super::palette::{FAINT, INK};
use super::surface::{Canvas, Colour, Rect};
use super::text::{Align, Font, text_width};

/// Side of a coloured square, the space before its text, and that before the next square [pixel].
const SQUARE: usize = 14;
const BESIDE: usize = 8;
const SPACE: usize = 28;

/// Width of a [legend](Canvas::legend) [pixel].
pub fn legend_width(entries: &[(Colour, String)]) -> usize {
    entries.iter().map(|(_, text)| entry_width(text)).sum()
}

fn entry_width(text: &str) -> usize {
    SQUARE + BESIDE + text_width(Font::Body, text) + SPACE
}

impl Canvas {
    /// Writes beside each other what colours mean, from (`x`, `y`) on [pixel].
    pub fn legend(&mut self, mut x: usize, y: usize, entries: &[(Colour, String)]) {
        for (colour, text) in entries {
            self.fill(Rect { x, y: y + 1, width: SQUARE, height: SQUARE }, *colour);
            let place = ((x + SQUARE + BESIDE) as i64, y as i64);
            self.text(place, text, Font::Body.style(Align::Left, FAINT));
            x += entry_width(text);
        }
    }

    /// Draws a bar of these colours by row from its top, and beside some rows what they stand for.
    pub fn colour_bar(
        &mut self,
        bar: Rect,
        colour: impl Fn(usize) -> Colour,
        labels: impl IntoIterator<Item = (usize, String)>,
    ) {
        for row in 0..bar.height {
            self.fill(Rect { y: bar.y + row, height: 1, ..bar }, colour(row));
        }
        for (row, text) in labels {
            let y = bar.y + row;
            self.fill(Rect { x: bar.x + bar.width, y, width: 4, height: 1 }, FAINT);
            let place = ((bar.x + bar.width + 8) as i64, y as i64 - Font::Body.height() as i64 / 2);
            self.text(place, &text, Font::Body.style(Align::Left, FAINT));
        }
    }

    /// Draws a line of a round length in scene units, at most `most` pixels long, with that length, from (`x`, `y`) on.
    /// `unit` [scene unit / pixel].
    pub fn scale(&mut self, x: usize, y: usize, unit: f64, most: f64) {
        let length = round_below(most * unit);
        let pixels = (length / unit).round() as usize;
        let middle = y + Font::Body.height() / 2;
        self.fill(Rect { x, y: middle, width: pixels, height: 2 }, INK);
        for end in [x, x + pixels.saturating_sub(1)] {
            self.fill(Rect { x: end, y: middle - 3, width: 1, height: 8 }, INK);
        }
        let text = if length == 1.0 { "1 scene unit".to_owned() } else { format!("{length} scene units") };
        self.text(((x + pixels + 8) as i64, y as i64), &text, Font::Body.style(Align::Left, INK));
    }
}

/// The largest 1, 2 or 5 times a power of ten that is no larger than `x` > 0.
fn round_below(x: f64) -> f64 {
    let exponent = x.max(f64::MIN_POSITIVE).log10().floor() as i32;
    let of = |mantissa: f64| {
        if exponent < 0 { mantissa / 10f64.powi(-exponent) } else { mantissa * 10f64.powi(exponent) }
    };
    [5.0, 2.0].map(of).into_iter().find(|&v| v <= x).unwrap_or_else(|| of(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_have_round_lengths() {
        for (x, expected) in [(0.34, 0.2), (0.07, 0.05), (1.0, 1.0), (7.3, 5.0), (23.0, 20.0), (1.9e-3, 1e-3)]
        {
            assert_eq!(round_below(x), expected);
        }
    }
}

//! How values become colours, and the bar that says so.

use crate::canvas::{Align, Canvas, Colour, FAINT, Font, Rect};
use crate::colour_map::ColourMap;
use crate::plot::ticks;

/// Where there is no value.
pub(super) const NOTHING: Colour = [226, 227, 231];
/// A lower bar has numbers at its ends alone [pixel].
const LOW: usize = 80;

/// How values become colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ColourScale {
    /// Errors of images, in [`ColourMap::Inferno`]: so many grey levels of 255, and more, get the last colour.
    Errors(u8),
    /// The values of the first and the last colour of a map.
    Values(ColourMap, [f32; 2]),
}

impl ColourScale {
    fn parts(self) -> (ColourMap, [f32; 2]) {
        match self {
            Self::Errors(full) => (ColourMap::Inferno, [0.0, f32::from(full.max(1))]),
            Self::Values(map, range) => (map, range),
        }
    }

    /// Colour of a value; grey where there is none, which is NaN.
    pub(super) fn colour(self, value: f32) -> Colour {
        let (map, [low, high]) = self.parts();
        if value.is_nan() { NOTHING } else { map.at((value - low) / (high - low).max(f32::EPSILON)) }
    }

    /// Draws the bar with its numbers.
    pub(super) fn draw_bar(self, page: &mut Canvas, bar: Rect) {
        let [low, high] = self.parts().1.map(f64::from);
        let last = bar.height.saturating_sub(1).max(1) as f64;
        let colour = |row: usize| self.colour((high + (low - high) * row as f64 / last) as f32);
        let row = |value: f64| ((high - value) / (high - low) * last).round() as usize;
        let labels = self.numbers(bar.height).into_iter().map(|(value, text)| (row(value), text));
        page.colour_bar(bar, colour, labels);
        if let Self::Errors(_) = self {
            let below = (bar.x as i64, (bar.y + bar.height + 8) as i64);
            page.text(below, "of 255", Font::Body.style(Align::Left, FAINT));
        }
    }

    /// Values and their texts beside a bar of a height [pixel].
    fn numbers(self, height: usize) -> Vec<(f64, String)> {
        let (_, [low, high]) = self.parts();
        match self {
            Self::Errors(_) => {
                let number = |quarter: usize| {
                    let level = f64::from(high) * quarter as f64 / 4.0;
                    (level, format!("{level:.0}{}", if quarter == 4 { "+" } else { "" }))
                };
                (0..=4).step_by(if height < LOW { 4 } else { 1 }).map(number).collect()
            }
            Self::Values(..) => {
                let (values, decimals) = ticks(low.into(), high.into(), 5);
                values.into_iter().map(|value| (value, format!("{value:.decimals$}"))).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_quarters_and_values_have_round_numbers() {
        let texts = |scale: ColourScale, height| -> Vec<String> {
            scale.numbers(height).into_iter().map(|(_, text)| text).collect()
        };
        assert_eq!(texts(ColourScale::Errors(64), 200), ["0", "16", "32", "48", "64+"]);
        assert_eq!(texts(ColourScale::Errors(64), 40), ["0", "64+"]);
        let index = ColourScale::Values(ColourMap::Viridis, [1.0, 1.5]);
        assert_eq!(texts(index, 200), ["1.0", "1.1", "1.2", "1.3", "1.4", "1.5"]);
    }
}

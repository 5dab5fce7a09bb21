//! Line plots of a training run: one description, drawn as PNG or written as SVG.

mod marks;
mod svg;
mod ticks;

use crate::canvas::{Canvas, Colour};
use marks::{Frame, marks};
pub use ticks::ticks;

/// A curve and its name in the legend.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// What the curve shows.
    pub name: String,
    /// (x, y) in the order of x; a value that is not finite interrupts the curve.
    pub points: Vec<(f64, f64)>,
}

/// Curves over a common x, such as PSNR of training batches and of validation images over steps.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// Heading; may be empty.
    pub title: String,
    /// Quantity and unit of x.
    pub x_label: String,
    /// Quantity and unit of y.
    pub y_label: String,
    /// Curves, each in a colour of its own; few points also get dots.
    pub series: Vec<Series>,
}

impl Plot {
    /// Draws the plot; sizes below 320×200 pixels are raised to that.
    pub fn draw(&self, width: usize, height: usize) -> Canvas {
        let frame = Frame::new(self, width, height);
        let mut canvas = Canvas::new(frame.width, frame.height, PAPER);
        for mark in marks(self, &frame) {
            mark.draw(&mut canvas);
        }
        canvas
    }

    /// Writes the plot as a self-contained SVG document of the same layout.
    pub fn svg(&self, width: usize, height: usize) -> String {
        let frame = Frame::new(self, width, height);
        svg::document(frame.width, frame.height, &marks(self, &frame))
    }
}

const PAPER: Colour = [255; 3];
const INK: Colour = [28, 30, 36];
const FAINT: Colour = [104, 108, 118];
const GRID: Colour = [228, 230, 235];
/// Told apart with every kind of colour vision: Okabe & Ito 2008, blue, vermilion, green, purple.
const CURVES: [Colour; 4] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167]];

#[cfg(test)]
mod tests;

//! What a plot shows.

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
    /// Points that are told by name, where there is room.
    pub named: Vec<NamedPoint>,
}

/// A point of a plot with a name beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedPoint {
    /// What is written.
    pub name: String,
    /// Its place in the units of the axes.
    pub point: (f64, f64),
}

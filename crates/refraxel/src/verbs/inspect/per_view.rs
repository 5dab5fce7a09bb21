//! Brightness and sharpness of every photograph, and of its neighbours.

use crate::canvas::{Canvas, PAPER};
use crate::plot::{NamedPoint, Plot, Series};
use refraxel_train::metrics::Rgb8;

/// Size of a plot [pixel].
const WIDTH: usize = 1280;
const HEIGHT: usize = 440;

/// The numbers of one photograph, in the order of names; NaN where there is none.
pub struct Numbers<'a> {
    pub name: &'a str,
    /// Mean brightness, 1 = white: its own, and the median of its neighbours.
    pub brightness: [f64; 2],
    /// The same of sharpness.
    pub sharpness: [f64; 2],
    /// Whether a warning says something about the one or the other.
    pub is_doubted: [bool; 2],
}

/// Draws both plots below each other.
pub fn draw(title: &str, numbers: &[Numbers<'_>]) -> Canvas {
    let brightness = plot(title, "mean brightness [white = 1]", numbers, 0, |n| n.brightness);
    let sharpness = plot("", "sharpness [detail, fine / coarse]", numbers, 1, |n| n.sharpness);
    let mut page = Canvas::new(WIDTH, 2 * HEIGHT, PAPER);
    for (k, plot) in [brightness, sharpness].iter().enumerate() {
        page.paste(0, k * HEIGHT, Rgb8::new(plot.pixels(), WIDTH, HEIGHT));
    }
    page
}

fn plot(
    title: &str,
    y_label: &str,
    numbers: &[Numbers<'_>],
    which: usize,
    value: fn(&Numbers<'_>) -> [f64; 2],
) -> Canvas {
    let place = |k: usize| (k + 1) as f64;
    let series = |name: &str, of: usize| Series {
        name: name.to_owned(),
        points: numbers.iter().enumerate().map(|(k, n)| (place(k), value(n)[of])).collect(),
    };
    let named = numbers.iter().enumerate().filter(|(_, n)| n.is_doubted[which]);
    let ends = match numbers {
        [] | [_] => String::new(),
        [first, .., last] => format!(": 1 is {}, {} is {}", first.name, numbers.len(), last.name),
    };
    let plot = Plot {
        title: title.to_owned(),
        x_label: format!("photograph in the order of names{ends}"),
        y_label: y_label.to_owned(),
        series: vec![series("median of its neighbours", 1), series("this photograph", 0)],
        named: named
            .map(|(k, n)| NamedPoint { name: n.name.to_owned(), point: (place(k), value(n)[0]) })
            .collect(),
    };
    plot.draw(WIDTH, HEIGHT)
}

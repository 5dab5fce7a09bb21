use std::fmt::Write;

use super::marks::Mark;
use crate::canvas::{Align, Colour, Font, Style};

/// The marks as one SVG document.
pub fn document(width: usize, height: usize, marks: &[Mark]) -> String {
    let body: String = marks.iter().map(element).collect();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"Noto Sans Mono, monospace\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n{body}</svg>\n"
    )
}

fn element(mark: &Mark) -> String {
    match mark {
        Mark::Line { points, width, colour } => {
            let places = points.iter().fold(String::new(), |mut text, (x, y)| {
                let _ = write!(text, "{x:.1},{y:.1} "); // writing to a String cannot fail
                text
            });
            format!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" \
                 stroke-linejoin=\"round\"/>\n",
                places.trim_end(),
                hex(*colour)
            )
        }
        Mark::Dot { centre: (x, y), diameter, colour } => {
            format!(
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{}\" fill=\"{}\"/>\n",
                diameter / 2.0,
                hex(*colour)
            )
        }
        Mark::Text { text, .. } if text.is_empty() => String::new(),
        Mark::Text { place: (x, y), text, style: Style { font, align, colour } } => {
            let anchor = match align {
                Align::Left => "start",
                Align::Centre => "middle",
                Align::Right => "end",
            };
            let weight = if *font == Font::Body { "normal" } else { "bold" };
            // The raster font's height is its whole line: letters are 0.73 of it, the baseline lies at 0.78.
            let (size, baseline) = (font.height() as f64 * 0.73, *y as f64 + font.height() as f64 * 0.78);
            format!(
                "<text x=\"{x}\" y=\"{baseline:.1}\" font-size=\"{size:.1}\" font-weight=\"{weight}\" \
                 text-anchor=\"{anchor}\" fill=\"{}\">{}</text>\n",
                hex(*colour),
                escaped(text)
            )
        }
    }
}

fn hex([r, g, b]: Colour) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

fn escaped(text: &str) -> String {
    let xml = |c: char| c == '\t' || !c.is_control(); // XML has no other control characters
    let text: String = text.chars().filter(|&c| xml(c)).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

//! Sheets of scalar maps, such as slices of the index: each row with its colour bar, maps with a scale and with lines.

use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PAPER, Rect, shortened, text_width};
use crate::colour_map::ColourMap;
use crate::plot::ticks;
use refraxel_train::metrics::Rgb8;

/// Where a map has no value.
const NOTHING: Colour = [226, 227, 231];
/// Around a map, which may be white at its edge.
const FRAME: Colour = [190, 193, 201];
/// Around the page and between its parts [pixel].
const MARGIN: usize = 20;
const GAP: usize = 12;
/// Narrower maps are enlarged by whole factors [pixel].
const LEAST_WIDTH: usize = 240;
/// Width of a colour bar, and of it with its numbers [pixel].
const BAR: usize = 14;
const BAR_SPACE: usize = GAP + BAR + 60;
/// Share of a map that its scale may take.
const SCALE_SHARE: f64 = 0.35;

/// A line on a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// In pixels of the map, the centre of the top left one at (0.5, 0.5).
    pub points: Vec<(f64, f64)>,
    /// Its colour.
    pub colour: Colour,
    /// Width on the page [pixel].
    pub width: f64,
}

/// A function of two coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// Rows from the top; NaN where there is no value.
    pub values: Vec<f32>,
    /// The line below; may be empty.
    pub note: String,
    /// Scene units per pixel, where the map has a scale.
    pub unit: Option<f64>,
    /// Drawn over it.
    pub lines: Vec<Line>,
}

/// Maps of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What is shown; may be empty.
    pub caption: String,
    /// From left to right.
    pub maps: Vec<Map>,
    /// How values become colours.
    pub colours: ColourMap,
    /// Values of the first and the last colour.
    pub range: [f32; 2],
}

/// A page of rows below each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// Heading; may be empty.
    pub title: String,
    /// From the top.
    pub rows: Vec<Row>,
}

impl Map {
    /// How often a pixel is repeated on the page.
    fn factor(&self) -> usize {
        LEAST_WIDTH.div_ceil(self.size[0].max(1))
    }
    fn width(&self) -> usize {
        self.size[0] * self.factor()
    }
    fn height(&self) -> usize {
        self.size[1] * self.factor()
    }
    /// Height of the lines of text below.
    fn below(&self) -> usize {
        let lines = usize::from(self.unit.is_some()) + usize::from(!self.note.is_empty());
        lines * (Font::Body.height() + 3)
    }
}

impl Row {
    fn above(&self) -> usize {
        if self.caption.is_empty() { 0 } else { Font::Strong.height() + GAP / 2 }
    }
    fn height(&self) -> usize {
        self.above() + self.maps.iter().map(|m| m.height() + m.below()).max().unwrap_or(0) + GAP
    }
    fn width(&self) -> usize {
        self.maps.iter().map(|m| m.width() + GAP).sum::<usize>() + BAR_SPACE - GAP
    }

    fn colour(&self, value: f32) -> Colour {
        let [low, high] = self.range;
        if value.is_nan() { NOTHING } else { self.colours.at((value - low) / (high - low).max(f32::EPSILON)) }
    }

    fn draw(&self, page: &mut Canvas, top: usize) {
        page.text((MARGIN as i64, top as i64), &self.caption, Font::Strong.style(Align::Left, INK));
        let (mut x, y) = (MARGIN, top + self.above());
        for map in &self.maps {
            self.draw_map(map, page, x, y);
            x += map.width() + GAP;
        }
        let height = self.maps.iter().map(Map::height).max().unwrap_or(0);
        self.draw_bar(page, Rect { x, y, width: BAR, height });
    }

    fn draw_map(&self, map: &Map, page: &mut Canvas, x: usize, y: usize) {
        let (factor, width) = (map.factor(), map.width());
        let mut tile = Canvas::new(width, map.height(), NOTHING);
        for (i, &value) in map.values.iter().enumerate() {
            let (column, row) = (i % map.size[0] * factor, i / map.size[0] * factor);
            tile.fill(Rect { x: column, y: row, width: factor, height: factor }, self.colour(value));
        }
        for line in &map.lines {
            let points: Vec<_> =
                line.points.iter().map(|&(u, v)| (u * factor as f64, v * factor as f64)).collect();
            tile.polyline(&points, line.width, line.colour);
        }
        page.fill(Rect { x: x - 1, y: y - 1, width: width + 2, height: map.height() + 2 }, FRAME);
        page.paste(x, y, Rgb8::new(tile.pixels(), width, map.height()));
        let mut y = y + map.height() + 3;
        if let Some(unit) = map.unit {
            page.scale(x, y, unit / factor as f64, SCALE_SHARE * width as f64);
            y += Font::Body.height() + 3;
        }
        let note = shortened(Font::Body, &map.note, width);
        page.text((x as i64, y as i64), &note, Font::Body.style(Align::Left, FAINT));
    }

    fn draw_bar(&self, page: &mut Canvas, bar: Rect) {
        let [low, high] = self.range.map(f64::from);
        let last = bar.height.saturating_sub(1).max(1) as f64;
        let colour = |row: usize| self.colour((high + (low - high) * row as f64 / last) as f32);
        let (values, decimals) = ticks(low, high, 5);
        let row = |value: f64| ((high - value) / (high - low) * last).round() as usize;
        let labels = values.into_iter().map(|value| (row(value), format!("{value:.decimals$}")));
        page.colour_bar(bar, colour, labels);
    }
}

impl Sheet {
    /// Draws the page.
    ///
    /// # Panics
    /// When a map has not one value per pixel.
    pub fn draw(&self) -> Canvas {
        let full = |m: &Map| m.values.len() == m.size[0] * m.size[1];
        assert!(self.rows.iter().flat_map(|r| &r.maps).all(full), "a value per pixel of each map");
        let heading = if self.title.is_empty() { 0 } else { Font::Heading.height() + GAP };
        let title = text_width(Font::Heading, &self.title);
        let captions = self.rows.iter().map(|r| text_width(Font::Strong, &r.caption));
        let widest = self.rows.iter().map(Row::width).chain(captions).fold(title, usize::max);
        let height = self.rows.iter().map(Row::height).sum::<usize>();
        let mut page = Canvas::new(widest + 2 * MARGIN, height + heading + 2 * MARGIN - GAP, PAPER);
        page.text((MARGIN as i64, MARGIN as i64), &self.title, Font::Heading.style(Align::Left, INK));
        let mut y = MARGIN + heading;
        for row in &self.rows {
            row.draw(&mut page, y);
            y += row.height();
        }
        page
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_are_enlarged_beside_their_bar_and_lines_lie_on_them() {
        let line = Line { points: vec![(0.0, 1.5), (2.0, 1.5)], colour: [255, 0, 0], width: 3.0 };
        let map =
            Map { size: [2, 2], values: vec![0.0, 1.0, f32::NAN, 1.0], lines: vec![line], ..Map::default() };
        let row =
            Row { caption: String::new(), maps: vec![map], colours: ColourMap::Viridis, range: [0.0, 1.0] };
        let page = Sheet { title: String::new(), rows: vec![row] }.draw();
        let at = |x: usize, y: usize| page.pixel(MARGIN + x, MARGIN + y);
        assert_eq!((at(0, 0), at(239, 0)), (ColourMap::Viridis.at(0.0), ColourMap::Viridis.at(1.0)));
        assert_eq!((at(0, 239), at(100, 180)), (NOTHING, [255, 0, 0]));
        assert_eq!(at(240 + GAP, 0), ColourMap::Viridis.at(1.0), "the top of the bar");
    }
}

//! The page itself: where its panels, texts and bars lie.

use super::colour_scale::ColourScale;
use super::content::Content;
use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PAPER, Rect, shortened, text_width};
use refraxel_train::metrics::Rgb8;

/// Around the page, and between its parts [pixel].
const MARGIN: usize = 20;
const GAP: usize = 12;
/// From a panel to the text below it [pixel].
const BELOW: usize = 3;
/// Around a map, which may be white at its edge.
const FRAME: Colour = [190, 193, 201];
/// Width of a colour bar, and of it with its numbers [pixel].
const BAR: usize = 14;
const BAR_SPACE: usize = GAP + BAR + 60;
/// Share of a map that a line of known length may take.
const LENGTH_SHARE: f64 = 0.35;

/// A picture on the page.
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// What is shown.
    pub content: Content<'a>,
    /// The line below, such as "27.31 dB"; may be empty.
    pub note: String,
}

/// Panels beside each other.
#[derive(Clone, Debug, Default)]
pub struct Row<'a> {
    /// The line above; may be empty.
    pub caption: String,
    /// One per column, from left to right.
    pub panels: Vec<Panel<'a>>,
    /// The colours of values, with a bar beside them; `None`: as in the row above, whose bar is enough.
    pub scale: Option<ColourScale>,
}

/// A page of rows below each other.
#[derive(Clone, Debug, Default)]
pub struct Sheet<'a> {
    /// Heading; may be empty.
    pub title: String,
    /// Caption of each column; none where the columns need none.
    pub columns: Vec<String>,
    /// From the top.
    pub rows: Vec<Row<'a>>,
}

impl Panel<'_> {
    /// Height of what is written below.
    fn below(&self) -> usize {
        let has_length = matches!(&self.content, Content::Map(map) if map.unit.is_some());
        let lines = usize::from(has_length) + usize::from(!self.note.is_empty());
        lines * (Font::Body.height() + BELOW)
    }

    /// Draws the panel, `tile` being its pixels, in the middle of a column.
    fn draw(&self, page: &mut Canvas, tile: &Canvas, (left, wide): (usize, usize), top: usize) {
        let (width, height) = (tile.width(), tile.height());
        let x = left + (wide - width) / 2;
        let mut y = top + height + BELOW;
        if let Content::Map(map) = &self.content {
            page.fill(Rect { x: x - 1, y: top - 1, width: width + 2, height: height + 2 }, FRAME);
            if let Some(unit) = map.unit {
                let factor = width as f64 / map.size[0] as f64;
                page.scale(x, y, unit / factor, LENGTH_SHARE * width as f64);
                y += Font::Body.height() + BELOW;
            }
        }
        page.paste(x, top, Rgb8::new(tile.pixels(), width, height));
        let note = shortened(Font::Body, &self.note, wide);
        let place = ((left + wide / 2) as i64, y as i64);
        page.text(place, &note, Font::Body.style(Align::Centre, FAINT));
    }
}

impl Row<'_> {
    /// What its bar explains.
    fn bar(&self) -> Option<ColourScale> {
        self.scale.filter(|_| self.panels.iter().any(|p| p.content.has_scale()))
    }
}

impl Sheet<'_> {
    /// Draws the page.
    ///
    /// # Panics
    /// When a row has not one panel per column, a map not one value per pixel, an error two images of different sizes, or
    /// values no scale.
    pub fn draw(&self) -> Canvas {
        let count = self.count();
        assert!(self.rows.iter().all(|r| r.panels.len() == count), "a panel per column in each row");
        let tiles = self.tiles();
        let layout = Layout::new(self, &tiles);
        let mut page = Canvas::new(layout.width, layout.height, PAPER);
        page.text((MARGIN as i64, MARGIN as i64), &self.title, Font::Heading.style(Align::Left, INK));
        for (caption, &(x, width)) in self.columns.iter().zip(&layout.columns) {
            let place = ((x + width / 2) as i64, layout.captions as i64);
            let caption = shortened(Font::Strong, caption, width);
            page.text(place, &caption, Font::Strong.style(Align::Centre, INK));
        }
        for ((row, tiles), band) in self.rows.iter().zip(&tiles).zip(&layout.rows) {
            let place = (MARGIN as i64, band.caption as i64);
            page.text(place, &row.caption, Font::Strong.style(Align::Left, INK));
            for ((panel, tile), &column) in row.panels.iter().zip(tiles).zip(&layout.columns) {
                panel.draw(&mut page, tile, column, band.panels);
            }
            if let Some(scale) = row.bar() {
                let bar = Rect { x: layout.bars, y: band.panels, width: BAR, height: band.height };
                scale.draw_bar(&mut page, bar);
            }
        }
        page
    }

    /// How many columns there are.
    fn count(&self) -> usize {
        let panels = self.rows.first().map_or(0, |row| row.panels.len());
        if self.columns.is_empty() { panels } else { self.columns.len() }
    }

    /// The pixels of the panels, row by row.
    fn tiles(&self) -> Vec<Vec<Canvas>> {
        let mut scale = None;
        let mut tiles = Vec::with_capacity(self.rows.len());
        for row in &self.rows {
            scale = row.scale.or(scale);
            tiles.push(row.panels.iter().map(|p| p.content.tile(scale)).collect());
        }
        tiles
    }
}

/// Where everything goes [pixel].
struct Layout {
    width: usize,
    height: usize,
    /// Upper edge of the captions of columns.
    captions: usize,
    /// Left edge and width.
    columns: Vec<(usize, usize)>,
    rows: Vec<Band>,
    /// Left edge of the bars.
    bars: usize,
}

/// Where a row goes [pixel].
struct Band {
    /// Upper edges.
    caption: usize,
    panels: usize,
    /// Height of the panels.
    height: usize,
}

impl Layout {
    fn new(sheet: &Sheet<'_>, tiles: &[Vec<Canvas>]) -> Self {
        let captions = if sheet.title.is_empty() { MARGIN } else { MARGIN + Font::Heading.height() + GAP };
        let mut x = MARGIN;
        let columns: Vec<_> = (0..sheet.count())
            .map(|c| {
                let width = tiles.iter().map(|row| row[c].width()).max().unwrap_or(0);
                x += width + GAP;
                (x - width - GAP, width)
            })
            .collect();
        let caption = Font::Strong.height() + GAP / 2;
        let mut y = captions + if sheet.columns.is_empty() { 0 } else { caption };
        let rows: Vec<_> = (sheet.rows.iter().zip(tiles))
            .map(|(row, tiles)| {
                let top = y;
                let panels = top + if row.caption.is_empty() { 0 } else { caption };
                let height = tiles.iter().map(Canvas::height).max().unwrap_or(0);
                y = panels + height + row.panels.iter().map(Panel::below).max().unwrap_or(0) + GAP;
                Band { caption: top, panels, height }
            })
            .collect();
        let bar = if sheet.rows.iter().any(|row| row.bar().is_some()) { BAR_SPACE } else { 0 };
        let texts = sheet.rows.iter().map(|row| text_width(Font::Strong, &row.caption));
        let widest = texts.fold(text_width(Font::Heading, &sheet.title), usize::max);
        let width = (x - GAP + bar).max(MARGIN + widest) + MARGIN;
        Self { width, height: y - GAP + MARGIN, captions, columns, rows, bars: x }
    }
}

#[cfg(test)]
mod tests {
    use super::super::colour_scale::NOTHING;
    use super::super::content::{Line, Map};
    use super::*;
    use crate::colour_map::ColourMap;

    fn flat(colour: Colour, width: usize, height: usize) -> Vec<Colour> {
        vec![colour; width * height]
    }

    /// A sheet with rows of one panel, each with its scale.
    fn sheet<'a>(rows: impl IntoIterator<Item = (Content<'a>, Option<ColourScale>)>) -> Sheet<'a> {
        let row = |(content, scale)| Row {
            panels: vec![Panel { content, note: String::new() }],
            scale,
            ..Row::default()
        };
        Sheet { columns: vec!["a".into()], rows: rows.into_iter().map(row).collect(), ..Sheet::default() }
    }

    #[test]
    fn small_images_are_enlarged_by_a_whole_factor() {
        let pixels = flat([10, 200, 30], 50, 20);
        let page = sheet([(Content::Image(Rgb8::new(&pixels, 50, 20)), None)]).draw();
        assert_eq!(page.count([10, 200, 30]), 200 * 80);
    }

    #[test]
    fn only_error_panels_bring_a_colour_bar() {
        let pixels = flat([90; 3], 200, 100);
        let image = Rgb8::new(&pixels, 200, 100);
        let width = |content| sheet([(content, Some(ColourScale::Errors(64)))]).draw().width();
        assert_eq!(width(Content::Error(image, image)), width(Content::Image(image)) + BAR_SPACE);
    }

    #[test]
    fn rows_without_a_scale_have_that_of_the_row_above_and_no_bar() {
        let [truth, render] = [0, 128].map(|level| flat([level; 3], 200, 100));
        let error = || Content::Error(Rgb8::new(&render, 200, 100), Rgb8::new(&truth, 200, 100));
        let page = sheet([(error(), Some(ColourScale::Errors(128))), (error(), None)]).draw();
        let (last, x) = (ColourMap::Inferno.at(1.0), MARGIN + 200 + GAP);
        assert_eq!(page.count(last), 2 * 200 * 100 + BAR, "both errors, and the top of one bar");
        let top = MARGIN + Font::Strong.height() + GAP / 2;
        let second = top + 100 + GAP + 50;
        assert_eq!((page.pixel(x, top), page.pixel(x, second)), (last, PAPER));
    }

    #[test]
    fn maps_are_enlarged_beside_their_bar_and_lines_lie_on_them() {
        let line = Line { points: vec![(0.0, 1.5), (2.0, 1.5)], colour: [255, 0, 0], width: 3.0 };
        let map =
            Map { size: [2, 2], values: vec![0.0, 1.0, f32::NAN, 1.0], lines: vec![line], ..Map::default() };
        let scale = ColourScale::Values(ColourMap::Viridis, [0.0, 1.0]);
        let page = Sheet { columns: Vec::new(), ..sheet([(Content::Map(map), Some(scale))]) }.draw();
        let at = |x: usize, y: usize| page.pixel(MARGIN + x, MARGIN + y);
        assert_eq!((at(0, 0), at(239, 0)), (ColourMap::Viridis.at(0.0), ColourMap::Viridis.at(1.0)));
        assert_eq!((at(0, 239), at(100, 180)), (NOTHING, [255, 0, 0]));
        assert_eq!(at(240 + GAP, 0), ColourMap::Viridis.at(1.0), "the top of the bar");
    }

    #[test]
    fn page_without_rows_is_still_a_page() {
        let page = Sheet { title: "none".into(), ..sheet([]) }.draw();
        assert!(page.width() > 0 && page.height() > 0);
    }

    #[test]
    #[should_panic(expected = "a panel per column")]
    fn missing_panel_is_refused() {
        Sheet { rows: vec![Row::default()], ..sheet([]) }.draw();
    }
}

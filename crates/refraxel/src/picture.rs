//! Side-by-side pictures: truth, renders and their magnified errors in captioned columns.

use refraxel_train::metrics::Rgb8;

use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PAPER, Rect, shortened, text_width};
use crate::colour_map::ColourMap;

/// Around the page and between columns [pixel].
const MARGIN: usize = 20;
const GAP: usize = 12;
/// Narrower panels are enlarged and wider ones reduced, by whole factors [pixel].
const PANEL_WIDTH: std::ops::RangeInclusive<usize> = 200..=640;
/// Width of the colour bar, and of it with its numbers [pixel].
const BAR: usize = 14;
const BAR_SPACE: usize = GAP + BAR + 44;

/// What one panel shows.
#[derive(Clone, Copy, Debug)]
pub enum Content<'a> {
    /// An image as it is.
    Image(Rgb8<'a>),
    /// The mean absolute difference of two images over RGB, in colours.
    Error(Rgb8<'a>, Rgb8<'a>),
}

/// One image of the picture and the line below it, such as "27.31 dB".
#[derive(Clone, Debug)]
pub struct Panel<'a> {
    /// What is shown.
    pub content: Content<'a>,
    /// The line below; may be empty.
    pub note: String,
}

/// A picture of captioned columns, one row per image.
#[derive(Clone, Debug)]
pub struct Comparison<'a> {
    /// Heading of the page; may be empty.
    pub title: String,
    /// Caption of each column.
    pub columns: Vec<String>,
    /// Rows of one panel per column.
    pub rows: Vec<Vec<Panel<'a>>>,
    /// Error [0..=255 grey levels] that gets the last colour.
    pub full_error: u8,
}

impl Comparison<'_> {
    /// Draws the page; a bar explains the colours when there is an error panel.
    ///
    /// # Panics
    /// When a row has not one panel per column, or an error panel's two images differ in size.
    pub fn draw(&self) -> Canvas {
        assert!(self.rows.iter().all(|r| r.len() == self.columns.len()), "a panel per column in each row");
        let tiles: Vec<Vec<Tile>> = self
            .rows
            .iter()
            .map(|r| r.iter().map(|p| Tile::new(p.content, self.full_error)).collect())
            .collect();
        let layout = Layout::new(self, &tiles);
        let mut page = Canvas::new(layout.width, layout.height, PAPER);
        let title = shortened(Font::Heading, &self.title, layout.width.saturating_sub(2 * MARGIN));
        page.text((MARGIN as i64, MARGIN as i64), &title, Font::Heading.style(Align::Left, INK));
        for (caption, &(x, width)) in self.columns.iter().zip(&layout.columns) {
            let place = ((x + width / 2) as i64, layout.captions as i64);
            page.text(
                place,
                &shortened(Font::Strong, caption, width),
                Font::Strong.style(Align::Centre, INK),
            );
        }
        for ((panels, tiles), &(y, height)) in self.rows.iter().zip(&tiles).zip(&layout.rows) {
            for ((panel, tile), &(x, width)) in panels.iter().zip(tiles).zip(&layout.columns) {
                page.paste(x + (width - tile.width) / 2, y + (height - tile.height) / 2, tile.view());
                let place = ((x + width / 2) as i64, (y + height + 3) as i64);
                page.text(
                    place,
                    &shortened(Font::Body, &panel.note, width),
                    Font::Body.style(Align::Centre, FAINT),
                );
            }
        }
        if let (true, Some(&(y, height))) = (self.has_errors(), layout.rows.first()) {
            let x = layout.width - MARGIN - BAR_SPACE + GAP;
            self.colour_bar(&mut page, Rect { x, y, width: BAR, height });
        }
        page
    }

    fn has_errors(&self) -> bool {
        self.rows.iter().flatten().any(|p| matches!(p.content, Content::Error(..)))
    }

    fn colour_bar(&self, page: &mut Canvas, bar: Rect) {
        let steps = bar.height.saturating_sub(1).max(1) as f32;
        let below = (bar.x as i64, (bar.y + bar.height + 8) as i64);
        page.text(below, "of 255", Font::Body.style(Align::Left, FAINT));
        let every = if bar.height < 80 { 4 } else { 1 };
        let label = |quarter: usize| {
            let level = f64::from(self.full_error) * quarter as f64 / 4.0;
            let text = if quarter == 4 { format!("{level:.0}+") } else { format!("{level:.0}") };
            ((bar.height - 1) * (4 - quarter) / 4, text)
        };
        let colour = |row: usize| ColourMap::Inferno.at(1.0 - row as f32 / steps);
        page.colour_bar(bar, colour, (0..=4).step_by(every).map(label));
    }
}

/// Where everything goes [pixel].
struct Layout {
    width: usize,
    height: usize,
    captions: usize,
    /// Left edge and width.
    columns: Vec<(usize, usize)>,
    /// Upper edge and height of the panels.
    rows: Vec<(usize, usize)>,
}

impl Layout {
    fn new(picture: &Comparison<'_>, tiles: &[Vec<Tile>]) -> Self {
        let captions = if picture.title.is_empty() { MARGIN } else { MARGIN + Font::Heading.height() + GAP };
        let mut x = MARGIN;
        let columns: Vec<_> = (0..picture.columns.len())
            .map(|c| {
                let width = tiles.iter().map(|row| row[c].width).max().unwrap_or(*PANEL_WIDTH.start());
                x += width + GAP;
                (x - width - GAP, width)
            })
            .collect();
        let mut y = captions + Font::Strong.height() + GAP / 2;
        let rows: Vec<_> = (tiles.iter().zip(&picture.rows))
            .map(|(tiles, panels)| {
                let height = tiles.iter().map(|t| t.height).max().unwrap_or(0);
                let noted = panels.iter().any(|p| !p.note.is_empty());
                let below = if noted { Font::Body.height() + 3 } else { 0 };
                y += height + below + GAP;
                (y - height - below - GAP, height)
            })
            .collect();
        let bar = if picture.has_errors() { BAR_SPACE } else { 0 };
        let title = text_width(Font::Heading, &picture.title).min(4 * PANEL_WIDTH.start());
        let width = (x - GAP + bar).max(MARGIN + title) + MARGIN;
        Self { width, height: y - GAP + MARGIN, captions, columns, rows }
    }
}

/// A panel's pixels at the size of the page.
struct Tile {
    width: usize,
    height: usize,
    pixels: Vec<Colour>,
}

impl Tile {
    fn new(content: Content<'_>, full_error: u8) -> Self {
        let (image, pixels) = match content {
            Content::Image(image) => (image, image.pixels().to_vec()),
            Content::Error(render, truth) => (truth, error_colours(render, truth, full_error)),
        };
        Self { width: image.width(), height: image.height(), pixels }.resized()
    }

    /// Each pixel repeated, or blocks of pixels averaged, until the width is a comfortable one.
    fn resized(self) -> Self {
        let enlarge = PANEL_WIDTH.start().div_ceil(self.width);
        let reduce = self.width.div_ceil(*PANEL_WIDTH.end()).min(self.height);
        let (width, height) = (self.width * enlarge / reduce, self.height * enlarge / reduce);
        let at = |i: usize| {
            let (x, y) = (i % width * reduce / enlarge, i / width * reduce / enlarge);
            self.block_mean(x, y, reduce)
        };
        Self { width, height, pixels: (0..width * height).map(at).collect() }
    }

    fn block_mean(&self, x: usize, y: usize, side: usize) -> Colour {
        let mut sum = [0; 3];
        for row in y..y + side {
            for pixel in &self.pixels[row * self.width + x..][..side] {
                for (s, &v) in sum.iter_mut().zip(pixel) {
                    *s += usize::from(v);
                }
            }
        }
        sum.map(|s| ((s + side * side / 2) / (side * side)) as u8)
    }

    fn view(&self) -> Rgb8<'_> {
        Rgb8::new(&self.pixels, self.width, self.height)
    }
}

fn error_colours(render: Rgb8<'_>, truth: Rgb8<'_>, full_error: u8) -> Vec<Colour> {
    assert_eq!((render.width(), render.height()), (truth.width(), truth.height()), "images of one size");
    let full = 3.0 * f32::from(full_error.max(1));
    let error = |a: &Colour, b: &Colour| (0..3).map(|k| f32::from(a[k].abs_diff(b[k]))).sum::<f32>();
    let pairs = render.pixels().iter().zip(truth.pixels());
    pairs.map(|(a, b)| ColourMap::Inferno.at(error(a, b) / full)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flat(colour: Colour, width: usize, height: usize) -> Vec<Colour> {
        vec![colour; width * height]
    }

    fn panel<'a>(content: Content<'a>, note: &str) -> Panel<'a> {
        Panel { content, note: note.to_owned() }
    }

    #[test]
    fn small_images_are_enlarged_by_a_whole_factor() {
        let pixels = flat([10, 200, 30], 50, 20);
        let image = Rgb8::new(&pixels, 50, 20);
        let rows = vec![vec![panel(Content::Image(image), "")]];
        let page =
            Comparison { title: String::new(), columns: vec!["truth".into()], rows, full_error: 64 }.draw();
        assert_eq!(page.count([10, 200, 30]), 200 * 80);
    }

    #[test]
    fn large_images_are_averaged() {
        let pixels: Vec<Colour> = (0..1200 * 4).map(|i| [if i % 2 == 0 { 100 } else { 102 }; 3]).collect();
        let tile = Tile::new(Content::Image(Rgb8::new(&pixels, 1200, 4)), 64);
        assert_eq!((tile.width, tile.height), (600, 2));
        assert!(tile.pixels.iter().all(|p| *p == [101; 3]));
    }

    #[test]
    fn thin_images_keep_a_pixel() {
        let pixels = flat([1; 3], 2000, 1);
        let tile = Tile::new(Content::Image(Rgb8::new(&pixels, 2000, 1)), 64);
        assert_eq!((tile.width, tile.height), (2000, 1));
    }

    #[test]
    fn error_grows_from_black_to_the_last_colour() {
        let (truth, near, far) = (flat([50; 3], 200, 4), flat([50, 50, 50], 200, 4), flat([200; 3], 200, 4));
        let colours = |a: &[Colour]| error_colours(Rgb8::new(a, 200, 4), Rgb8::new(&truth, 200, 4), 64);
        assert_eq!(colours(&near)[0], ColourMap::Inferno.at(0.0));
        assert_eq!(colours(&far)[0], ColourMap::Inferno.at(1.0));
    }

    #[test]
    fn only_error_panels_bring_a_colour_bar() {
        let pixels = flat([90; 3], 200, 100);
        let image = Rgb8::new(&pixels, 200, 100);
        let width = |content| {
            let rows = vec![vec![panel(content, "")]];
            Comparison { title: String::new(), columns: vec!["a".into()], rows, full_error: 64 }
                .draw()
                .width()
        };
        assert_eq!(width(Content::Error(image, image)), width(Content::Image(image)) + BAR_SPACE);
    }

    #[test]
    fn page_without_rows_is_still_a_page() {
        let page =
            Comparison { title: "none".into(), columns: vec!["a".into()], rows: vec![], full_error: 0 }
                .draw();
        assert!(page.width() > 0 && page.height() > 0);
    }

    #[test]
    #[should_panic(expected = "a panel per column")]
    fn missing_panel_is_refused() {
        let rows = vec![vec![]];
        Comparison { title: String::new(), columns: vec!["a".into()], rows, full_error: 64 }.draw();
    }
}

//! The contact sheet: photographs with their names, parts, masks and warnings.

use super::look::{EDGE, SmallPicture};
use super::palette::{BORDER, WARNING, of_part};
use crate::canvas::{Align, Canvas, Colour, FAINT, Font, INK, PALE, PAPER, Rect, legend_width, shortened};
use refraxel_data::{MaskMeaning, is_white};
use refraxel_train::metrics::Rgb8;

/// Around the page, and between tiles [pixel].
const MARGIN: usize = 24;
const GAP: usize = 18;
/// Width of the frame around a picture [pixel].
const FRAME: usize = 4;
/// Most tiles in a row.
const COLUMNS: usize = 8;
/// Pixels that a mask leaves out: so much of their colour stays, the rest is this one.
const STAYS: f32 = 0.35;
const LEFT_OUT: Colour = [120, 130, 175];

/// One photograph of the sheet.
pub struct Tile<'a> {
    pub name: &'a str,
    /// Part of the split.
    pub part: &'static str,
    /// What is wrong with it, in a few words each; the first is shown.
    pub warnings: Vec<&'a str>,
    /// The photograph, where it can be decoded.
    pub picture: Option<&'a SmallPicture>,
    pub meaning: MaskMeaning,
}

/// Draws the sheet.
pub fn draw(title: &str, tiles: &[Tile<'_>]) -> Canvas {
    let columns = tiles.len().clamp(1, COLUMNS);
    let cell = cell(tiles);
    let step = [cell[0] + GAP, cell[1] + 2 * Font::Body.height() + GAP];
    let top = MARGIN + Font::Heading.height() + 12 + Font::Body.height() + GAP;
    let legend = legend(tiles);
    let rows = tiles.len().div_ceil(columns).max(1);
    let width = (2 * MARGIN + columns * step[0] - GAP).max(2 * MARGIN + legend_width(&legend));
    let mut page = Canvas::new(width, top + rows * step[1] + MARGIN - GAP, PAPER);
    let title = shortened(Font::Heading, title, width - 2 * MARGIN);
    page.text((MARGIN as i64, MARGIN as i64), &title, Font::Heading.style(Align::Left, INK));
    page.legend(MARGIN, MARGIN + Font::Heading.height() + 12, &legend);
    for (k, tile) in tiles.iter().enumerate() {
        let place = [MARGIN + k % columns * step[0], top + k / columns * step[1]];
        tile.draw(&mut page, Rect { x: place[0], y: place[1], width: cell[0], height: cell[1] });
    }
    page
}

/// Width and height that every framed picture fits in [pixel].
fn cell(tiles: &[Tile<'_>]) -> [usize; 2] {
    let sizes = || tiles.iter().filter_map(|t| t.picture).map(|p| enlarged(p).1);
    let largest = |axis: usize| sizes().map(|s| s[axis]).max().unwrap_or(EDGE as usize / 2);
    // Captions need some width.
    [largest(0).max(EDGE as usize * 2 / 3) + 2 * FRAME, largest(1) + 2 * FRAME]
}

/// The whole factor by which a picture of few pixels is enlarged, and its size then.
fn enlarged(picture: &SmallPicture) -> (usize, [usize; 2]) {
    let factor = (EDGE as usize / picture.size[0].max(picture.size[1]).max(1)).max(1);
    (factor, picture.size.map(|n| n * factor))
}

impl Tile<'_> {
    fn draw(&self, page: &mut Canvas, cell: Rect) {
        let is_doubted = !self.warnings.is_empty();
        let colour = if is_doubted { WARNING } else { of_part(self.part) };
        match self.picture {
            Some(picture) => {
                let (factor, [width, height]) = enlarged(picture);
                // Beside each other and above their names, whatever their shapes.
                let x = cell.x + (cell.width - width) / 2;
                let y = cell.y + cell.height - height - FRAME;
                let outer =
                    Rect { x: x - FRAME, y: y - FRAME, width: width + 2 * FRAME, height: height + 2 * FRAME };
                page.fill(outer, colour);
                let pixels = shown(picture, self.meaning, factor);
                page.paste(x, y, Rgb8::new(&pixels, width, height));
            }
            None => {
                page.fill(cell, colour);
                let (width, height) = (cell.width - 2 * FRAME, cell.height - 2 * FRAME);
                page.fill(Rect { x: cell.x + FRAME, y: cell.y + FRAME, width, height }, PALE);
            }
        }
        let (x, y) = ((cell.x + cell.width / 2) as i64, (cell.y + cell.height + 3) as i64);
        let name = shortened(Font::Body, self.name, cell.width);
        page.text((x, y), &name, Font::Body.style(Align::Centre, INK));
        let below = y + Font::Body.height() as i64;
        let (text, style) = match self.warnings.first() {
            Some(warning) => (*warning, Font::Strong.style(Align::Centre, WARNING)),
            None => (self.part, Font::Body.style(Align::Centre, FAINT)),
        };
        page.text((x, below), &shortened(style.font, text, cell.width), style);
    }
}

/// The picture, enlarged, with the border of its mask and a tint over what the mask leaves out.
fn shown(picture: &SmallPicture, meaning: MaskMeaning, factor: usize) -> Vec<Colour> {
    let [width, height] = picture.size;
    let (wide, high) = (width * factor, height * factor);
    let coverage = |x: usize, y: usize| picture.mask.as_ref().map(|m| m[y / factor * width + x / factor]);
    let is_white = |x: usize, y: usize| coverage(x, y).is_some_and(is_white);
    // A dark line beside a bright one is seen on everything.
    let is_near = |x: usize, y: usize, reach: usize| {
        let here = is_white(x, y);
        let columns = x.saturating_sub(reach)..(x + reach + 1).min(wide);
        let rows = y.saturating_sub(reach)..(y + reach + 1).min(high);
        columns.into_iter().any(|u| is_white(u, y) != here)
            || rows.into_iter().any(|v| is_white(x, v) != here)
    };
    let pixel = |x: usize, y: usize| {
        let colour = picture.pixels[y / factor * width + x / factor];
        match coverage(x, y) {
            None => colour,
            Some(_) if is_white(x, y) && is_near(x, y, 2) => BORDER,
            Some(_) if !is_white(x, y) && is_near(x, y, 1) => INK,
            Some(c) if !meaning.lets_count(c) => mixed(colour),
            Some(_) => colour,
        }
    };
    (0..high).flat_map(|y| (0..wide).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect()
}

fn mixed(colour: Colour) -> Colour {
    [0, 1, 2].map(|k| (f32::from(colour[k]) * STAYS + f32::from(LEFT_OUT[k]) * (1.0 - STAYS)) as u8)
}

/// What the colours of this sheet mean.
fn legend(tiles: &[Tile<'_>]) -> Vec<(Colour, String)> {
    let mut entries = Vec::new();
    let count = |part: &str| tiles.iter().filter(|t| t.part == part && t.warnings.is_empty()).count();
    for part in ["train", "val", "test", "unused"] {
        if count(part) > 0 {
            entries.push((of_part(part), part.to_owned()));
        }
    }
    if tiles.iter().any(|t| !t.warnings.is_empty()) {
        entries.push((WARNING, "with a warning".to_owned()));
    }
    let masked = || tiles.iter().filter(|t| t.picture.is_some_and(|p| p.mask.is_some()));
    if masked().count() > 0 {
        entries.push((BORDER, "border of the mask".to_owned()));
    }
    if masked().any(|t| t.meaning != MaskMeaning::Refractive) {
        entries.push((LEFT_OUT, "left out by the mask".to_owned()));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels of a square of the legend.
    const SQUARE: usize = 14 * 14;

    fn picture(mask: Option<Vec<u8>>) -> SmallPicture {
        SmallPicture { size: [24, 12], pixels: vec![[90, 100, 110]; 24 * 12], mask }
    }

    fn tile<'a>(picture: &'a SmallPicture, warnings: Vec<&'static str>, meaning: MaskMeaning) -> Tile<'a> {
        Tile { name: "a.png", part: "train", warnings, picture: Some(picture), meaning }
    }

    #[test]
    fn frames_say_part_and_warning() {
        let plain = picture(None);
        let of = |warnings| draw("t", &[tile(&plain, warnings, MaskMeaning::Keep)]);
        let frame = 2 * FRAME * (240 + 120 + 2 * FRAME);
        assert_eq!(of(vec![]).count(of_part("train")), frame + SQUARE);
        assert_eq!(of(vec!["blurred"]).count(of_part("train")), 0);
        assert!(of(vec!["blurred"]).count(WARNING) > frame);
    }

    #[test]
    fn masks_are_outlined_and_what_they_leave_out_is_tinted() {
        let half = picture(Some((0..24 * 12).map(|p| if p % 24 < 12 { 255 } else { 0 }).collect()));
        let page = draw("t", &[tile(&half, vec![], MaskMeaning::Keep)]);
        assert_eq!(page.count(BORDER), 2 * 120 + SQUARE);
        assert_eq!(page.count(mixed([90, 100, 110])), 119 * 120);
        let glass = draw("t", &[tile(&half, vec![], MaskMeaning::Refractive)]);
        assert_eq!((glass.count(BORDER), glass.count(mixed([90, 100, 110]))), (2 * 120 + SQUARE, 0));
    }

    #[test]
    fn photographs_that_cannot_be_decoded_have_a_place() {
        let lost = Tile {
            name: "b.png",
            part: "test",
            warnings: vec!["cannot be decoded"],
            picture: None,
            meaning: MaskMeaning::Keep,
        };
        assert!(draw("t", &[lost]).count(WARNING) > 0);
        assert!(draw("none", &[]).width() > 0);
    }
}

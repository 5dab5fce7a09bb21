//! What a panel shows, at the size that it has on the page.

use super::colour_scale::ColourScale;
use crate::canvas::{Canvas, Colour, PAPER};
use refraxel_train::metrics::Rgb8;
use std::ops::RangeInclusive;

/// Narrower images are enlarged and wider ones reduced, by whole factors [pixel].
const IMAGE_WIDTHS: RangeInclusive<usize> = 200..=640;
/// The same of maps, which keep every pixel.
const MAP_WIDTHS: RangeInclusive<usize> = 240..=usize::MAX;

/// What a panel shows.
#[derive(Clone, Debug)]
pub enum Content<'a> {
    /// An image as it is.
    Image(Rgb8<'a>),
    /// The mean absolute difference of two images over RGB, in colours.
    Error(Rgb8<'a>, Rgb8<'a>),
    /// A map, in colours.
    Map(Map),
}

/// A function of two coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Map {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// Rows from the top; NaN where there is no value.
    pub values: Vec<f32>,
    /// Scene units per pixel, where a line of known length is drawn below.
    pub unit: Option<f64>,
    /// Drawn over it.
    pub lines: Vec<Line>,
}

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

impl Content<'_> {
    /// The values of a map; nothing for images.
    pub fn values(&self) -> &[f32] {
        match self {
            Self::Map(map) => &map.values,
            Self::Image(_) | Self::Error(..) => &[],
        }
    }

    /// Whether its colours stand for values.
    pub(super) fn has_scale(&self) -> bool {
        !matches!(self, Self::Image(_))
    }

    /// Its pixels on the page, values in the colours of the scale.
    pub(super) fn tile(&self, scale: Option<ColourScale>) -> Canvas {
        let colours = |values: &[f32]| -> Vec<Colour> {
            let scale = scale.expect("a row with values has a scale, or one above has");
            values.iter().map(|&value| scale.colour(value)).collect()
        };
        match self {
            Self::Image(image) => resized(*image, &IMAGE_WIDTHS),
            Self::Error(render, truth) => {
                let pixels = colours(&errors(*render, *truth));
                resized(Rgb8::new(&pixels, truth.width(), truth.height()), &IMAGE_WIDTHS)
            }
            Self::Map(map) => {
                let pixels = colours(&map.values);
                let mut tile = resized(Rgb8::new(&pixels, map.size[0], map.size[1]), &MAP_WIDTHS);
                let factor = tile.width() as f64 / map.size[0] as f64;
                for line in &map.lines {
                    let points: Vec<_> = line.points.iter().map(|&(u, v)| (u * factor, v * factor)).collect();
                    tile.polyline(&points, line.width, line.colour);
                }
                tile
            }
        }
    }
}

/// Mean absolute differences of two images over RGB [grey level].
fn errors(render: Rgb8<'_>, truth: Rgb8<'_>) -> Vec<f32> {
    assert_eq!((render.width(), render.height()), (truth.width(), truth.height()), "images of one size");
    let error = |(a, b): (&Colour, &Colour)| -> f32 {
        (0..3).map(|k| f32::from(a[k].abs_diff(b[k]))).sum::<f32>() / 3.0
    };
    render.pixels().iter().zip(truth.pixels()).map(error).collect()
}

/// Each pixel repeated, or blocks of pixels averaged, until the width is in a range.
fn resized(image: Rgb8<'_>, widths: &RangeInclusive<usize>) -> Canvas {
    let enlarge = widths.start().div_ceil(image.width());
    let reduce = image.width().div_ceil(*widths.end()).min(image.height());
    let (width, height) = (image.width() * enlarge / reduce, image.height() * enlarge / reduce);
    let at = |i: usize| {
        let (x, y) = (i % width * reduce / enlarge, i / width * reduce / enlarge);
        block_mean(image, x, y, reduce)
    };
    let pixels: Vec<Colour> = (0..width * height).map(at).collect();
    let mut tile = Canvas::new(width, height, PAPER);
    tile.paste(0, 0, Rgb8::new(&pixels, width, height));
    tile
}

fn block_mean(image: Rgb8<'_>, x: usize, y: usize, side: usize) -> Colour {
    let mut sum = [0; 3];
    for row in y..y + side {
        for pixel in &image.pixels()[row * image.width() + x..][..side] {
            for (s, &v) in sum.iter_mut().zip(pixel) {
                *s += usize::from(v);
            }
        }
    }
    sum.map(|s| ((s + side * side / 2) / (side * side)) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour_map::ColourMap;

    #[test]
    fn large_images_are_averaged() {
        let pixels: Vec<Colour> = (0..1200 * 4).map(|i| [if i % 2 == 0 { 100 } else { 102 }; 3]).collect();
        let tile = Content::Image(Rgb8::new(&pixels, 1200, 4)).tile(None);
        assert_eq!((tile.width(), tile.height()), (600, 2));
        assert!(tile.pixels().iter().all(|p| *p == [101; 3]));
    }

    #[test]
    fn thin_images_keep_a_pixel() {
        let pixels = vec![[1; 3]; 2000];
        let tile = Content::Image(Rgb8::new(&pixels, 2000, 1)).tile(None);
        assert_eq!((tile.width(), tile.height()), (2000, 1));
    }

    #[test]
    fn large_maps_keep_every_pixel() {
        let map = Map { size: [1200, 2], values: vec![0.0; 2400], ..Map::default() };
        let tile = Content::Map(map).tile(Some(ColourScale::Values(ColourMap::Viridis, [0.0, 1.0])));
        assert_eq!((tile.width(), tile.height()), (1200, 2));
    }

    #[test]
    fn error_grows_from_black_to_the_last_colour() {
        let [truth, far] = [[50; 3], [200; 3]].map(|colour: Colour| vec![colour; 800]);
        let of = |render: &[Colour]| {
            let error = Content::Error(Rgb8::new(render, 200, 4), Rgb8::new(&truth, 200, 4));
            error.tile(Some(ColourScale::Errors(64))).pixel(0, 0)
        };
        assert_eq!(of(&truth), ColourMap::Inferno.at(0.0));
        assert_eq!(of(&far), ColourMap::Inferno.at(1.0));
    }
}

//! What stands in front of refractive things in one view: the nearest opaque thing per cell of the image.
//!
//! A ray per pixel would be exact and too slow for large photographs. One ray per cell misses whatever is narrower than a
//! cell, such as a pole in front of the glass. The mask knows better: where the pole cuts the glass, the cell is partly
//! inside and partly outside of it. Such cells are divided, and each part is looked at through a pixel outside the mask,
//! which is where a view may abstain.

use refraxel_core::radiance::Pixel;
use refraxel_data::{Mask, is_white};
use std::ops::Range;

/// Parts along an edge of a divided cell, at most.
const PARTS: usize = 4;
/// Rays through parts of cells, at most, per ray through a cell.
const MOST_PARTS: usize = 4;
/// The block of a cell that is not divided.
const UNDIVIDED: u32 = u32::MAX;

/// A ray is hidden from where it has lost this share of its light.
pub const OPAQUE: f32 = 0.5;

/// Distance beyond which something opaque hides everything on a ray that shows this [scene unit], infinite where nothing does.
pub fn hidden_beyond(shown: &Pixel<f32>) -> f32 {
    let opacity = 1.0 - shown.transmittance;
    if opacity > OPAQUE { shown.depth / opacity } else { f32::INFINITY }
}

/// Distances from the camera beyond which something opaque hides everything [scene unit], infinite where nothing does.
///
/// One value per square cell of the image, x fastest, rows from the top; cells that the contour of the mask crosses are
/// divided in up to 4×4 parts. Memory: at most 24 bytes per cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Occluders {
    /// Width and height of the image [pixel].
    image: [usize; 2],
    /// Edge of a cell [pixel].
    cell: usize,
    /// Cells per row and column.
    size: [usize; 2],
    /// Seen through the centre of each cell.
    beyond: Vec<f32>,
    /// Parts along an edge of a divided cell.
    parts: usize,
    /// Per cell the number of its block in `finer`; empty where no cell is divided.
    block: Vec<u32>,
    /// Per block `parts`² distances; infinite where no pixel lies outside the mask.
    finer: Vec<f32>,
}

impl Occluders {
    /// Looks for what hides the things of a mask, with rays through the centres of cells of `cell` pixels and through
    /// parts of those cells that the contour crosses: at most five rays per cell. `look` gives the distance at which the
    /// rays of the pixels (row · width + column) become opaque, infinite for those that do not.
    ///
    /// # Panics
    /// If `cell` is 0, or `look` does not answer for every pixel.
    pub fn new(mask: &Mask, cell: usize, look: impl FnOnce(&[usize]) -> Vec<f32>) -> Self {
        assert!(cell > 0, "a cell has at least one pixel");
        let image = [mask.width as usize, mask.height as usize];
        let size = image.map(|n| n.div_ceil(cell));
        let mut map =
            Self { image, cell, size, beyond: Vec::new(), parts: 0, block: Vec::new(), finer: Vec::new() };
        let crossed = map.crossed(mask);
        map.parts = parts(cell, crossed.len(), size[0] * size[1]);
        let mut pixels: Vec<usize> = (0..size[0] * size[1]).map(|c| map.centre(c)).collect();
        let mut places = Vec::new();
        for (block, &of) in crossed.iter().enumerate() {
            for part in 0..map.parts * map.parts {
                if let Some(pixel) = map.outside(mask, of, part) {
                    places.push(block * map.parts * map.parts + part);
                    pixels.push(pixel);
                }
            }
        }
        let mut found = look(&pixels);
        assert_eq!(found.len(), pixels.len(), "one distance per pixel");
        if map.parts > 0 && !crossed.is_empty() {
            map.block = vec![UNDIVIDED; size[0] * size[1]];
            crossed.iter().zip(0..).for_each(|(&c, block)| map.block[c] = block);
            map.finer = vec![f32::INFINITY; crossed.len() * map.parts * map.parts];
            let finer = &found[size[0] * size[1]..];
            places.iter().zip(finer).for_each(|(&place, &d)| map.finer[place] = d);
        }
        found.truncate(size[0] * size[1]);
        found.shrink_to_fit();
        Self { beyond: found, ..map }
    }

    /// The edge of the cells [pixel] at which about `rays` rays go through centres of cells of images of `pixels` in all.
    pub fn cell_for(pixels: u64, rays: f64) -> usize {
        (pixels as f64 / rays).sqrt().ceil().max(1.0) as usize
    }

    /// Most memory of the distances for an image of this size.
    pub fn most_bytes(image: [u32; 2], cell: usize) -> u64 {
        let cells = image.map(|n| u64::from(n).div_ceil(cell as u64));
        let divided = if cell > 1 { 4 * (1 + MOST_PARTS as u64) } else { 0 };
        cells[0] * cells[1] * (4 + divided)
    }

    /// Memory of the distances.
    #[cfg(test)]
    pub fn bytes(&self) -> u64 {
        (4 * (self.beyond.len() + self.block.len() + self.finer.len())) as u64
    }

    /// Width and height of the image [pixel].
    pub(super) fn image(&self) -> [usize; 2] {
        self.image
    }

    /// The nearest in a rectangle of pixels.
    pub(super) fn nearest(&self, columns: Range<usize>, rows: Range<usize>) -> f32 {
        let cells = |r: &Range<usize>| r.start / self.cell..(r.end - 1) / self.cell + 1;
        let all = cells(&rows).flat_map(|y| cells(&columns).map(move |x| (x, y)));
        let nearest = |(x, y): (usize, usize)| match self.block.get(y * self.size[0] + x) {
            None | Some(&UNDIVIDED) => self.beyond[y * self.size[0] + x],
            Some(&block) => {
                let parts = |r: &Range<usize>, at: usize| {
                    let from = r.start.saturating_sub(at * self.cell);
                    let to = (r.end - 1 - at * self.cell).min(self.cell - 1);
                    from * self.parts / self.cell..to * self.parts / self.cell + 1
                };
                let of = &self.finer[block as usize * self.parts * self.parts..];
                let within = parts(&rows, y).flat_map(|j| &of[j * self.parts..][parts(&columns, x)]);
                within.copied().fold(f32::INFINITY, f32::min)
            }
        };
        all.map(nearest).fold(f32::INFINITY, f32::min)
    }

    /// The pixel at the centre of a cell.
    fn centre(&self, cell: usize) -> usize {
        let at = |k: usize, n: usize| (k * self.cell + self.cell / 2).min(n - 1);
        at(cell / self.size[0], self.image[1]) * self.image[0] + at(cell % self.size[0], self.image[0])
    }

    /// The pixels of a cell: columns and rows.
    fn pixels(&self, cell: usize) -> [Range<usize>; 2] {
        let range = |k: usize, n: usize| k * self.cell..((k + 1) * self.cell).min(n);
        [range(cell % self.size[0], self.image[0]), range(cell / self.size[0], self.image[1])]
    }

    /// The cells that lie partly inside and partly outside of a mask.
    fn crossed(&self, mask: &Mask) -> Vec<usize> {
        if self.cell == 1 {
            return Vec::new();
        }
        let crossed = |&cell: &usize| {
            let [columns, mut rows] = self.pixels(cell);
            let first = is_white(mask.coverage[rows.start * self.image[0] + columns.start]);
            rows.any(|y| {
                mask.coverage[y * self.image[0]..][columns.clone()].iter().any(|&c| is_white(c) != first)
            })
        };
        (0..self.size[0] * self.size[1]).filter(crossed).collect()
    }

    /// The pixel outside the mask nearest to the middle of all those of a part of a cell.
    fn outside(&self, mask: &Mask, cell: usize, part: usize) -> Option<usize> {
        let [columns, rows] = self.pixels(cell);
        let within = |r: Range<usize>, k: usize| {
            let edge = |k: usize| r.start + (k * self.cell).div_ceil(self.parts);
            edge(k)..edge(k + 1).min(r.end)
        };
        let (columns, rows) = (within(columns, part % self.parts), within(rows, part / self.parts));
        let all = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        let outside = || all.clone().filter(|(x, y)| !is_white(mask.coverage[y * self.image[0] + x]));
        let (count, sum) = outside().fold((0, [0; 2]), |(n, s), (x, y)| (n + 1, [s[0] + x, s[1] + y]));
        let away = |p: usize, k: usize| (p * count).abs_diff(sum[k]).pow(2);
        let middle = outside().min_by_key(|&(x, y)| away(x, 0) + away(y, 1));
        middle.map(|(x, y)| y * self.image[0] + x)
    }
}

/// Parts along an edge of the cells that are divided: as many as the number of rays allows.
fn parts(cell: usize, crossed: usize, cells: usize) -> usize {
    let affordable = |p: &usize| crossed * p * p <= MOST_PARTS * cells;
    (1..=PARTS.min(cell)).rev().find(affordable).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [960, 800];
    const PIXELS: usize = SIZE[0] * SIZE[1];
    const IMAGE: [u32; 2] = [960, 800];

    /// A disc of glass 600 pixels across, behind a pole four pixels wide.
    fn behind_a_pole() -> Mask {
        let inside = |x: usize, y: usize| x.abs_diff(500).pow(2) + y.abs_diff(400).pow(2) < 90_000;
        let pixels = (0..PIXELS).map(|i| (i % SIZE[0], i / SIZE[0]));
        let coverage = pixels.map(|(x, y)| if inside(x, y) && !is_pole(x) { 255 } else { 0 }).collect();
        Mask { width: IMAGE[0], height: IMAGE[1], coverage }
    }

    fn is_pole(x: usize) -> bool {
        (426..430).contains(&x)
    }

    /// What rays see: the pole at 1, and nothing else.
    fn pole(pixels: &[usize]) -> Vec<f32> {
        pixels.iter().map(|p| if is_pole(p % SIZE[0]) { 1.0 } else { f32::INFINITY }).collect()
    }

    #[test]
    fn a_pole_narrower_than_a_cell_is_seen_wherever_it_cuts_the_mask() {
        // Where a part of a cell shows the pole and the surroundings of the disc, either may be looked at: not at the rim.
        for cell in [1, 2, 5, 13, 24, 49] {
            let map = Occluders::new(&behind_a_pole(), cell, pole);
            let seen = (160..640).all(|y| (426..430).all(|x| map.nearest(x..x + 1, y..y + 1) == 1.0));
            assert!(seen, "cells of {cell} pixels");
        }
    }

    #[test]
    fn rays_through_centres_alone_miss_the_pole() {
        let missed = [5, 13, 24, 49].into_iter().filter(|cell| {
            let map = Occluders::new(&behind_a_pole(), *cell, pole);
            map.beyond.iter().all(|d| d.is_infinite())
        });
        assert!(missed.count() >= 3);
    }

    #[test]
    fn rays_and_memory_stay_within_the_stated_share_of_the_cells() {
        // A chequerboard crosses every cell.
        let dark = |i: usize| (i % SIZE[0] / 3 + i / SIZE[0] / 3).is_multiple_of(2);
        let coverage = (0..PIXELS).map(|i| if dark(i) { 255 } else { 0 }).collect();
        let board = Mask { width: IMAGE[0], height: IMAGE[1], coverage };
        for (mask, cell) in [(&board, 5), (&board, 8), (&behind_a_pole(), 8), (&behind_a_pole(), 1)] {
            let mut asked = 0;
            let map = Occluders::new(mask, cell, |pixels| {
                asked = pixels.len();
                vec![2.0; pixels.len()]
            });
            assert!(asked <= (1 + MOST_PARTS) * map.beyond.len());
            assert!(map.bytes() <= Occluders::most_bytes(IMAGE, cell));
        }
    }

    #[test]
    fn a_cell_per_pixel_answers_for_every_pixel() {
        let map = Occluders::new(&behind_a_pole(), 1, |pixels| pixels.iter().map(|&p| p as f32).collect());
        let at = |p: usize| map.nearest(p % SIZE[0]..p % SIZE[0] + 1, p / SIZE[0]..p / SIZE[0] + 1);
        assert!((0..PIXELS).all(|p| at(p) == p as f32));
        assert_eq!(map.nearest(3..6, 2..5), (2 * SIZE[0] + 3) as f32);
    }
}

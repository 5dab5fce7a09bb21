//! What is inside of the masks of some photographs, as luminance on three rasters, with the rays of its pixels.

use super::detail::Detail;
use crate::rays::{Picture, RaySampler, cells};
use refraxel_core::Ray;
use refraxel_core::structure::luminance;
use refraxel_data::is_white;

/// Pixels inside the masks of a view on the finest raster, about; coarser rasters have as many, whatever size things have, until
/// pixels are those of the photograph.
const PIXELS: f64 = 2500.0;
/// A pixel of a coarse raster counts where this part of it lies inside the mask.
const INSIDE: f32 = 0.9;
/// Fewer pixels on the coarsest raster say nothing.
const LEAST_PIXELS: usize = 40;

/// Photographs of one set of views.
#[derive(Clone)]
pub(crate) struct Photographs {
    /// Per detail of [`Detail::ALL`] one cutting per view.
    cuttings: [Vec<Cutting>; 3],
}

/// What is around the mask of one view.
#[derive(Clone)]
pub(crate) struct Cutting {
    /// Columns and rows; a border of one pixel lies outside the mask.
    pub size: [usize; 2],
    /// Name of the view.
    pub name: String,
    /// Luminance of the photograph [code value]; 0 outside the mask.
    pub luminance: Vec<f32>,
    /// The pixels inside the mask, x fastest.
    pub pixels: Vec<usize>,
    /// Their colours [code value].
    pub colours: Vec<[f32; 3]>,
    /// Their rays: as many of each pixel, one pixel after the other.
    pub rays: Vec<Ray<f32>>,
}

impl Photographs {
    /// Those of some views, of pixels whose rays are chosen; views that show too little are left out.
    pub(crate) fn new(sampler: &RaySampler, views: &[usize], shows: impl Fn(&Ray<f32>) -> bool) -> Self {
        let pictures: Vec<(usize, Picture)> =
            sampler.pictures().enumerate().filter(|(k, _)| views.contains(k)).collect();
        let inside = |p: &Picture| {
            p.refractive().map_or(0, |m| m.coverage.iter().filter(|c| is_white(**c)).count()) as f64
        };
        let shown: Vec<f64> = pictures.iter().map(|(_, p)| inside(p)).filter(|n| *n > 0.0).collect();
        let mean = shown.iter().sum::<f64>() / shown.len().max(1) as f64;
        let edge = (mean / PIXELS).sqrt();
        let is_usable = |(_, p): &&(usize, Picture)| {
            Cutting::new(p, edge, Detail::Coarse, &shows).is_some_and(|c| c.pixels.len() >= LEAST_PIXELS)
        };
        let usable: Vec<&(usize, Picture)> = pictures.iter().filter(is_usable).collect();
        let of = |detail| usable.iter().filter_map(|(_, p)| Cutting::new(p, edge, detail, &shows)).collect();
        Self { cuttings: Detail::ALL.map(of) }
    }

    /// The cuttings of a detail, one per view.
    pub(crate) fn cuttings(&self, detail: Detail) -> &[Cutting] {
        &self.cuttings[detail as usize]
    }

    /// Number of views.
    pub(crate) fn views(&self) -> usize {
        self.cuttings[0].len()
    }
}

impl Cutting {
    fn new(picture: &Picture, edge: f64, detail: Detail, shows: &impl Fn(&Ray<f32>) -> bool) -> Option<Self> {
        let full = [picture.camera.width as usize, picture.camera.height as usize];
        let cell = edge * detail.factor() as f64;
        let whole = full.map(|n| ((n as f64 / cell).round() as usize).clamp(1, n));
        let inside = inside(picture, full, whole, detail);
        let marked = |axis: usize| {
            let at = (0..inside.len()).filter(|&k| inside[k]);
            let along = at.map(|k| if axis == 0 { k % whole[0] } else { k / whole[0] });
            along.fold(None, |range: Option<[usize; 2]>, k| {
                Some(range.map_or([k, k], |[low, high]| [low.min(k), high.max(k)]))
            })
        };
        let ([left, right], [top, bottom]) = (marked(0)?, marked(1)?);
        // One more on each side, also where the mask ends at the edge of the picture.
        let size = [right - left + 3, bottom - top + 3];
        let means = picture.reduced(whole);
        let mut out = Self {
            size,
            name: picture.name().to_owned(),
            luminance: vec![0.0; size[0] * size[1]],
            pixels: Vec::new(),
            colours: Vec::new(),
            rays: Vec::new(),
        };
        for y in top..=bottom {
            for x in left..=right {
                let k = y * whole[0] + x;
                let Some([r, g, b, _]) = means[k].filter(|_| inside[k]) else { continue };
                let Some(rays) = rays(picture, full, whole, [x, y], detail.rays()) else { continue };
                if !rays.iter().all(shows) {
                    continue;
                }
                let pixel = (y - top + 1) * size[0] + x - left + 1;
                out.luminance[pixel] = luminance([r, g, b]);
                out.pixels.push(pixel);
                out.colours.push([r, g, b]);
                out.rays.extend(rays);
            }
        }
        Some(out)
    }
}

/// Which cells of a raster lie inside the mask of a view: of the finest, those whose neighbours do, too.
fn inside(picture: &Picture, full: [usize; 2], whole: [usize; 2], detail: Detail) -> Vec<bool> {
    let mut sums = vec![(0.0_f32, 0.0_f32); whole[0] * whole[1]];
    if let Some(mask) = picture.refractive() {
        for (cell, pixel) in cells(full, whole) {
            let (sum, count) = &mut sums[cell];
            *sum += if is_white(mask.coverage[pixel]) { 1.0 } else { 0.0 };
            *count += 1.0;
        }
    }
    let is_inside: Vec<bool> = sums.iter().map(|(sum, count)| *sum > 0.0 && *sum >= INSIDE * count).collect();
    if detail != Detail::Fine {
        return is_inside;
    }
    let at = |x: usize, y: usize| x < whole[0] && y < whole[1] && is_inside[y * whole[0] + x];
    let is_deep = |k: usize| {
        let (x, y) = (k % whole[0], k / whole[0]);
        let across = x == 0 || at(x - 1, y);
        let down = y == 0 || at(x, y - 1);
        is_inside[k]
            && across
            && down
            && (x + 1 == whole[0] || at(x + 1, y))
            && (y + 1 == whole[1] || at(x, y + 1))
    };
    (0..is_inside.len()).map(is_deep).collect()
}

/// Rays through n × n points of a cell; `None` where the lens sees nothing.
fn rays(
    picture: &Picture,
    full: [usize; 2],
    whole: [usize; 2],
    cell: [usize; 2],
    n: usize,
) -> Option<Vec<Ray<f32>>> {
    let place = |axis: usize, part: usize| {
        (cell[axis] as f64 + (part as f64 + 0.5) / n as f64) * full[axis] as f64 / whole[axis] as f64
    };
    let ray = |k: usize| picture.camera.ray(place(0, k % n), place(1, k / n)).map(|r: Ray<f64>| r.cast());
    (0..n * n).map(ray).collect()
}

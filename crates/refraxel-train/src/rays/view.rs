//! A photograph that rays are drawn from.

use super::pixel::pixel_ray;
use super::shown::over;
use rayon::prelude::*;
use refraxel_core::radiance::Filter;
use refraxel_core::{Camera, Lens, Ray, Vec3};
use refraxel_data::{Mask, MaskMeaning, Photo, is_white};
use std::sync::Arc;

/// Distorted lenses are inverted once per pixel and kept, for at most this many different cameras.
const KEPT_LENSES: usize = 8;

/// Unit directions of all pixel centres in the camera frame; NaN where the lens sees nothing.
pub(super) type DirectionTable = Arc<Vec<Vec3<f32>>>;

/// A photograph with everything needed to draw rays from it.
pub(super) struct TrainingView {
    pub name: String,
    /// Where and with which lens it was taken, as the data say and as learned.
    pub given: Camera,
    pub camera: Camera,
    pub directions: Option<DirectionTable>,
    pub photo: Photo,
    pub meaning: MaskMeaning,
    /// What shows something refractive, where no mask says it.
    pub found: Option<Arc<Mask>>,
    /// What takes the place of either, where its border was found to lie elsewhere.
    pub shifted: Option<Arc<Mask>>,
    /// What gives it the exposure that all have in common.
    pub exposure: Filter<f32>,
}

impl TrainingView {
    /// The ray through a pixel's centre.
    pub(super) fn ray(&self, pixel: usize) -> Option<Ray<f32>> {
        // Lenses that have learned are inverted ray by ray.
        let is_given = self.camera.has_lens_of(&self.given);
        let Some(directions) = self.directions.as_ref().filter(|_| is_given) else {
            return pixel_ray(&self.camera, pixel);
        };
        let d = directions[pixel];
        let pose = &self.camera.world_from_camera;
        let columns = pose.rotation.columns.map(|c| c.cast::<f32>());
        let direction = columns[0] * d.x + columns[1] * d.y + columns[2] * d.z;
        d.is_finite().then(|| Ray { origin: pose.translation.cast(), direction: direction.normalized() })
    }

    /// The colour of a pixel: before something, where pictures are transparent, and of common exposure.
    pub(super) fn colour(&self, pixel: usize, behind: Option<[f32; 3]>) -> [f32; 3] {
        let rgba = self.photo.image.rgba(pixel);
        match behind {
            Some(behind) => over(rgba, behind),
            None => self.exposure.through([rgba[0], rgba[1], rgba[2]]).colour,
        }
    }

    /// The mean colour of the pixels up to `reach` rows and columns from one that count and lie on its side of the border of what is
    /// refractive, theory (4.26): of at most [`TAPS`] × [`TAPS`] of them, evenly spread.
    pub(super) fn mean_colour(&self, pixel: usize, reach: u32, behind: Option<[f32; 3]>) -> [f32; 3] {
        if reach == 0 {
            return self.colour(pixel, behind);
        }
        let mask = self.refractive();
        let inside = |p: usize| mask.is_some_and(|m| is_white(m.coverage[p]));
        let (own, mut sum, mut count) = (inside(pixel), [0.0_f32; 3], 0.0);
        for by in taps(reach).flat_map(|y| taps(reach).map(move |x| [x, y])) {
            let Some(p) = self.moved(pixel, by) else { continue };
            if self.used(p) && inside(p) == own {
                let colour = self.colour(p, behind);
                (0..3).for_each(|c| sum[c] += colour[c].max(0.0).powi(2));
                count += 1.0;
            }
        }
        sum.map(|s| (s / count).sqrt())
    }

    /// How far along the ray of a pixel something was measured [scene unit]; NaN where nothing was, and inside masks of what is
    /// refractive, where sensors of depth see what lies behind.
    pub(super) fn measured(&self, pixel: usize, ray: &Ray<f32>) -> f32 {
        let Some(depth) = &self.photo.depth else { return f32::NAN };
        if self.refractive().is_some_and(|mask| mask.coverage[pixel] > 0) {
            return f32::NAN;
        }
        let [width, height] = [self.photo.image.width as usize, self.photo.image.height as usize];
        let place =
            [(pixel % width, width), (pixel / width, height)].map(|(k, n)| (k as f64 + 0.5) / n as f64);
        let cosine = ray.direction.dot(self.camera.forward().cast());
        if cosine > 0.0 { depth.at(place) / cosine } else { f32::NAN }
    }

    /// The mask of what is refractive.
    pub(super) fn refractive(&self) -> Option<&Arc<Mask>> {
        self.shifted.as_ref().or_else(|| self.stated()).or(self.found.as_ref())
    }

    /// That of the data.
    pub(super) fn stated(&self) -> Option<&Arc<Mask>> {
        self.photo.mask.as_ref().filter(|_| self.meaning == MaskMeaning::Refractive)
    }

    /// The pixel so many columns and rows further, if there is one.
    pub(super) fn moved(&self, pixel: usize, [columns, rows]: [i64; 2]) -> Option<usize> {
        let [width, height] = [self.photo.image.width, self.photo.image.height].map(i64::from);
        let (x, y) = (pixel as i64 % width + columns, pixel as i64 / width + rows);
        let is_there = (0..width).contains(&x) && (0..height).contains(&y);
        is_there.then(|| (y * width + x) as usize)
    }

    /// Neither the pixel nor any within so many rows and columns shows something refractive.
    pub(super) fn clearly_outside(&self, pixel: usize, margin: usize) -> bool {
        let Some(mask) = self.refractive() else { return true };
        let (w, h) = (mask.width as usize, mask.height as usize);
        let (x, y) = (pixel % w, pixel / w);
        let columns = x.saturating_sub(margin)..(x + margin + 1).min(w);
        let mut rows = y.saturating_sub(margin)..(y + margin + 1).min(h);
        rows.all(|y| mask.coverage[y * w..][columns.clone()].iter().all(|c| *c == 0))
    }

    /// Whether a mask lets the pixel count.
    pub(super) fn used(&self, pixel: usize) -> bool {
        is_used(&self.photo, self.meaning, pixel)
    }
}

/// Pixels along an edge of a window that are looked at, at most: the mean of 25 errs by a fifth of their deviation.
pub const TAPS: i64 = 5;

/// Rows or columns of a window that are looked at.
fn taps(reach: u32) -> impl Iterator<Item = i64> {
    let (reach, count) = (i64::from(reach), (2 * i64::from(reach) + 1).min(TAPS));
    (0..count).map(move |k| (2 * k - (count - 1)) * reach / (count - 1))
}

/// Whether a mask of this meaning lets the pixel of a photograph count.
pub fn is_used(photo: &Photo, meaning: MaskMeaning, pixel: usize) -> bool {
    photo.mask.as_ref().is_none_or(|mask| meaning.lets_count(mask.coverage[pixel]))
}

/// The table of a camera whose lens is not inverted ray by ray, one for all cameras with that lens.
pub(super) fn directions_of(
    camera: &Camera,
    kept: &mut Vec<(Camera, DirectionTable)>,
) -> Option<DirectionTable> {
    if camera.lens == Lens::Pinhole {
        return None;
    }
    if let Some((_, found)) = kept.iter().find(|(k, _)| k.has_lens_of(camera)) {
        return Some(Arc::clone(found));
    }
    if kept.len() == KEPT_LENSES {
        return None;
    }
    let count = camera.width as usize * camera.height as usize;
    let blind = Vec3::splat(f32::NAN);
    let all = (0..count).into_par_iter().map(|pixel| {
        let (x, y) = ((pixel as u32 % camera.width), (pixel as u32 / camera.width));
        let d = camera.direction(f64::from(x) + 0.5, f64::from(y) + 0.5);
        d.map_or(blind, |d| d.normalized().cast())
    });
    let all: DirectionTable = Arc::new(all.collect());
    kept.push((*camera, Arc::clone(&all)));
    Some(all)
}

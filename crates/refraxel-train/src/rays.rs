//! Training rays: which pixel of which photograph, its ray and what it should show.

mod draw;
mod inside;
mod picture;
#[cfg(test)]
mod tests;

pub use draw::{Draw, Edition, LANES, MOVE_LANES, OFFSET_LANE, PIXEL_LANE, REDRAWS};
pub(crate) use picture::cells;
pub use picture::{Directions, Picture};

use crate::backend::Batch;
use crate::random::Random;
pub use inside::HALF;
use inside::InsidePixels;
use rayon::prelude::*;
use refraxel_core::radiance::{Filter, Pixel};
use refraxel_core::{Camera, Lens, Ray, Vec3};
use refraxel_data::{Backdrop, Mask, MaskMeaning, Photo, View, is_one_place};
use std::sync::Arc;

/// Unit directions of all pixel centres in the camera frame; NaN where the lens sees nothing.
type DirectionTable = Arc<Vec<Vec3<f32>>>;

/// A photograph with everything needed to draw rays from it.
struct TrainingView {
    name: String,
    /// Where and with which lens it was taken, as the data say and as learned.
    given: Camera,
    camera: Camera,
    directions: Option<DirectionTable>,
    photo: Photo,
    meaning: MaskMeaning,
    /// What shows something refractive, where no mask says it.
    found: Option<Arc<Mask>>,
    /// What takes the place of either, where its border was found to lie elsewhere.
    shifted: Option<Arc<Mask>>,
    /// What gives it the exposure that all have in common.
    exposure: Filter<f32>,
}

/// A view with a mask of refractive things.
#[derive(Clone, Copy, Debug)]
pub struct MaskedView<'a> {
    /// The name of its image.
    pub name: &'a str,
    /// The view.
    pub camera: &'a Camera,
    /// Coverage by refractive things.
    pub mask: &'a Arc<Mask>,
}

/// Which pixels a batch draws from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Selection {
    /// All of them, evenly.
    #[default]
    All,
    /// Those that show nothing refractive, not even in part or so many pixels beside them.
    Outside(u32),
    /// All of them, but at least this share of the rays inside refractive masks.
    Inside(f64),
    /// Those inside refractive masks, each moved by up to so many pixels along both axes: the further outside, the fewer.
    Around(u32),
}

/// The photographs that rays are drawn from.
pub struct RaySampler {
    views: Vec<TrainingView>,
    inside: InsidePixels,
    /// Pixels before each view, and in all.
    first: Vec<u64>,
    transparent: bool,
    random: Random,
    /// Views that batches do not draw from, until they are given back.
    aside: Vec<usize>,
    /// Masks that were found say where outlines are.
    traces_found: bool,
    /// By how much borders of masks were moved outwards [pixel].
    shift: f32,
    photographs: Edition,
    masks: Edition,
}

/// Pixels of a view that is kept aside.
pub struct AsideView {
    /// Its rays and what they should show.
    pub batch: Batch,
    /// Per ray: whether a refractive mask holds it, or there is no mask.
    pub inside: Vec<bool>,
}

/// A ray of a batch.
struct Drawn {
    view: usize,
    pixel: usize,
    ray: Ray<f32>,
    target: [f32; 3],
    behind: [f32; 3],
    offset: f32,
    beside: bool,
}

/// Rays of a view that is kept aside, at most about.
const ASIDE_RAYS: usize = 2500;

/// Distorted lenses are inverted once per pixel and kept, for at most this many different cameras.
const KEPT_LENSES: usize = 8;

impl RaySampler {
    /// Photographs to draw from, each beside its view.
    ///
    /// # Panics
    /// If views and photos are not of the same number.
    pub fn new(views: Vec<View>, photos: Vec<Photo>, backdrop: Backdrop, seed: u64) -> Self {
        assert_eq!(views.len(), photos.len(), "one photo per view");
        let mut kept: Vec<(Camera, DirectionTable)> = Vec::new();
        let mut with_photos = Vec::with_capacity(views.len());
        for (view, photo) in views.into_iter().zip(photos) {
            let directions = directions_of(&view.camera, &mut kept);
            with_photos.push(TrainingView {
                name: view.name,
                given: view.camera,
                camera: view.camera,
                directions,
                photo,
                meaning: view.mask_meaning,
                found: None,
                shifted: None,
                exposure: Filter::clear(),
            });
        }
        let mut first = vec![0];
        for s in &with_photos {
            first.push(first[first.len() - 1] + s.photo.image.len() as u64);
        }
        let inside = InsidePixels::new(with_photos.iter().map(|s| s.refractive().map(|m| &**m)));
        let transparent = backdrop == Backdrop::Transparent;
        let (views, random, aside) = (with_photos, Random::new(seed), Vec::new());
        let (photographs, masks) = (Edition::default(), Edition::default());
        let (traces_found, shift) = (false, 0.0);
        Self { views, inside, first, transparent, random, aside, traces_found, shift, photographs, masks }
    }

    /// From now on batches draw from the other views only: every so many-th is kept aside, `count` in all.
    pub fn keep_aside(&mut self, count: usize) {
        let all = self.views.len();
        let count = count.min(all);
        self.aside = (0..count).map(|k| (2 * k + 1) * all / (2 * count)).collect();
    }

    /// Batches draw from all views again.
    pub fn give_back(&mut self) {
        self.aside.clear();
    }

    /// Number of views that are kept aside.
    pub fn aside(&self) -> usize {
        self.aside.len()
    }

    /// Pixels of the views that are kept aside: half of the rays inside refractive masks, where there are enough.
    pub fn kept_aside(&self) -> Vec<AsideView> {
        self.aside.iter().map(|&view| self.pixels_of(view)).collect()
    }

    fn pixels_of(&self, view: usize) -> AsideView {
        let of = &self.views[view];
        let is_inside = |p: &usize| of.refractive().is_none_or(|m| m.coverage[*p] > 127);
        let all: Vec<usize> = (0..of.photo.image.len()).filter(|p| of.used(*p)).collect();
        let (within, beside): (Vec<usize>, Vec<usize>) = all.into_iter().partition(is_inside);
        let thinned = |pixels: &[usize]| {
            let stride = pixels.len().div_ceil(ASIDE_RAYS / 2).max(1);
            pixels.iter().copied().step_by(stride).collect::<Vec<_>>()
        };
        let mut out = AsideView { batch: Batch::default(), inside: Vec::new() };
        for (pixels, inside) in [(thinned(&within), true), (thinned(&beside), false)] {
            for pixel in pixels {
                let Some(ray) = of.ray(pixel) else { continue };
                out.batch.rays.push(ray);
                out.batch.target.push(of.colour(pixel, self.transparent.then_some(WHITE)));
                out.batch.offset.push(0.5);
                out.batch.behind.extend(self.transparent.then_some(WHITE));
                out.inside.push(inside);
            }
        }
        out
    }

    /// Number of views.
    pub fn views(&self) -> usize {
        self.views.len()
    }

    /// From now on this makes the photographs of common exposure.
    ///
    /// # Panics
    /// If there is not one filter per view.
    pub fn set_exposures(&mut self, filters: &[Filter<f32>]) {
        assert_eq!(filters.len(), self.views.len(), "one filter per view");
        self.views.iter_mut().zip(filters).for_each(|(v, filter)| v.exposure = *filter);
    }

    /// The cameras as the data say.
    pub fn given_cameras(&self) -> impl Iterator<Item = &Camera> {
        self.views.iter().map(|v| &v.given)
    }

    /// The camera of a view.
    pub fn camera(&self, view: usize) -> &Camera {
        &self.views[view].camera
    }

    /// Whether all photographs are taken from one place.
    pub fn is_one_place(&self) -> bool {
        is_one_place(self.views.iter().map(|v| &v.camera))
    }

    /// From now on the camera of a view is what this makes of its number and of what the data say.
    pub fn set_cameras(&mut self, learned: impl Fn(usize, &Camera) -> Camera) {
        for (k, view) in self.views.iter_mut().enumerate() {
            let camera = learned(k, &view.given);
            view.camera = camera;
        }
    }

    /// The photographs as they are.
    pub fn pictures(&self) -> impl Iterator<Item = Picture<'_>> {
        self.views.iter().map(|view| Picture { camera: &view.camera, view, transparent: self.transparent })
    }

    /// From now on these masks show what is refractive in views whose data have none; none: nothing does. `traced`: they say where
    /// outlines are; else only which rays meet something refractive.
    ///
    /// # Panics
    /// If there is neither one entry per view, with masks of the view's size, nor none.
    pub fn set_found(&mut self, masks: Option<Vec<Option<Mask>>>, traced: bool) {
        self.traces_found = traced;
        self.shift_masks(0.0);
        let Some(masks) = masks else {
            self.views.iter_mut().for_each(|v| v.found = None);
            return self.count_inside();
        };
        assert_eq!(masks.len(), self.views.len(), "one entry per view");
        for (view, mask) in self.views.iter_mut().zip(masks) {
            let is_fit = |m: &Mask| m.coverage.len() == view.photo.image.len();
            assert!(mask.as_ref().is_none_or(is_fit), "one coverage per pixel");
            view.found = mask.map(Arc::new);
        }
        self.count_inside();
    }

    /// From now on the border of each refractive mask lies this far further out than the data, or what was found, say [pixel].
    pub fn shift_masks(&mut self, by: f32) {
        if by == self.shift {
            return;
        }
        self.shift = by;
        self.views.par_iter_mut().for_each(|view| {
            view.shifted = None;
            view.shifted = view.refractive().filter(|_| by != 0.0).map(|mask| Arc::new(mask.shifted(by)));
        });
        self.count_inside();
    }

    /// Whether masks that were found say where outlines are.
    pub fn traces_found(&self) -> bool {
        self.traces_found
    }

    /// Number of views whose data have a mask of what is refractive.
    pub fn stated(&self) -> usize {
        self.views.iter().filter(|v| v.stated().is_some()).count()
    }

    fn count_inside(&mut self) {
        self.masks = Edition::default();
        self.inside = InsidePixels::new(self.views.iter().map(|s| s.refractive().map(|m| &**m)));
    }

    /// The refractive masks that say where outlines are.
    pub fn masked_views(&self) -> impl Iterator<Item = MaskedView<'_>> {
        let traces = move |v: &TrainingView| self.traces_found || v.stated().is_some();
        let masks = self.views.iter().map(move |v| v.refractive().filter(|_| traces(v)));
        self.views
            .iter()
            .zip(masks)
            .filter_map(|(v, mask)| Some(MaskedView { name: &v.name, camera: &v.camera, mask: mask? }))
    }

    /// Size of a pixel at a point, the median over the cameras [scene unit].
    pub fn pixel_size(&self, at: Vec3<f32>) -> f32 {
        let size = |s: &TrainingView| {
            let distance = (s.camera.world_from_camera.translation - at.cast()).length();
            distance / s.camera.focal[0].max(s.camera.focal[1])
        };
        let mut sizes: Vec<f64> = self.views.iter().map(size).collect();
        sizes.sort_by(f64::total_cmp);
        sizes.get(sizes.len() / 2).map_or(1.0, |&s| s as f32)
    }

    /// Share of the pixels that lie inside refractive masks.
    pub fn mask_share(&self) -> f64 {
        self.inside.count() as f64 / self.pixels().max(1) as f64
    }

    /// Pixels in all.
    pub fn pixels(&self) -> u64 {
        self.first[self.first.len() - 1]
    }

    /// At most `size` rays through random pixels of all photographs: a function of the seed, the step and the selection.
    pub fn batch(&self, step: u64, size: usize, selection: Selection) -> Batch {
        self.drawn(step, size, selection, &self.aside).0
    }

    /// The same of all views, also of those that are kept aside, and the number of each ray's view.
    pub fn batch_of_views(&self, step: u64, size: usize, selection: Selection) -> (Batch, Vec<usize>) {
        self.drawn(step, size, selection, &[])
    }

    /// At most `size` rays near borders between areas of refractive masks, and how far outside each lies, to the nearest pixel of the
    /// other kind [pixel]: negative inside, at most `reach`. Nothing narrower than that counts: with the distance from a straw that
    /// masks leave out, what rays see would change from the straw to what is behind it.
    pub fn near_borders(&self, step: u64, size: usize, reach: u32) -> (Batch, Vec<f32>) {
        let draw = |i| self.draw(step, i, size as u64, Selection::Around(reach), &self.aside);
        let near = |d: Drawn| {
            let away = self.views[d.view].refractive()?.from_border(d.pixel, reach)?;
            Some((d, away))
        };
        let drawn: Vec<(Drawn, f32)> =
            (0..size as u64).into_par_iter().filter_map(draw).filter_map(near).collect();
        (self.gathered(drawn.iter().map(|(d, _)| d)), drawn.iter().map(|(_, away)| *away).collect())
    }

    fn gathered<'a>(&self, drawn: impl Iterator<Item = &'a Drawn>) -> Batch {
        let mut batch = Batch::default();
        for Drawn { ray, target, behind, offset, beside, .. } in drawn {
            batch.rays.push(*ray);
            batch.target.push(*target);
            batch.offset.push(*offset);
            batch.beside.push(*beside);
            batch.behind.extend(self.transparent.then_some(*behind));
        }
        batch
    }

    fn drawn(&self, step: u64, size: usize, selection: Selection, aside: &[usize]) -> (Batch, Vec<usize>) {
        let draw = |i| self.draw(step, i, size as u64, selection, aside);
        let drawn: Vec<Drawn> = (0..size as u64).into_par_iter().filter_map(draw).collect();
        (self.gathered(drawn.iter()), drawn.iter().map(|d| d.view).collect())
    }

    fn draw(&self, step: u64, i: u64, size: u64, selection: Selection, aside: &[usize]) -> Option<Drawn> {
        let lane = |k: u64| i * LANES + k;
        let from_inside = i < self.rays_inside(size, selection);
        let by = match selection {
            Selection::Around(reach) => MOVE_LANES.map(|k| {
                let (reach, places) = (i64::from(reach), 2 * u64::from(reach) + 1);
                self.random.below(places, step, lane(k)) as i64 - reach
            }),
            _ => [0, 0],
        };
        let (view, pixel, ray) = (0..REDRAWS).find_map(|k| {
            let below = |n: u64| self.random.below(n, step, lane(PIXEL_LANE + k));
            let (view, pixel) = if from_inside {
                let number = below(self.inside.count());
                let view = self.inside.view(number);
                let pixel = self.inside.pixel(number, self.views[view].refractive()?)?;
                (view, self.views[view].moved(pixel, by)?)
            } else {
                let at = below(self.pixels());
                let view = self.first.partition_point(|&f| f <= at) - 1;
                (view, (at - self.first[view]) as usize)
            };
            let of = &self.views[view];
            let ray = of.ray(pixel)?;
            let selected = match selection {
                Selection::Outside(margin) => of.clearly_outside(pixel, margin as usize),
                _ => true,
            };
            let free = !aside.contains(&view);
            (free && of.used(pixel) && selected).then_some((view, pixel, ray))
        })?;
        let behind = std::array::from_fn(|c| self.random.uniform(step, lane(c as u64)) as f32);
        let target = self.views[view].colour(pixel, self.transparent.then_some(behind));
        let offset = self.random.uniform(step, lane(OFFSET_LANE)) as f32;
        let beside = self.views[view].refractive().is_some_and(|mask| mask.coverage[pixel] == 0);
        Some(Drawn { view, pixel, ray, target, behind, offset, beside })
    }

    /// About `count` rays spread evenly over all pixels.
    pub fn spread(&self, count: u64) -> Vec<Ray<f32>> {
        let n = self.pixels();
        let stride = (n / count.max(1)).max(1) | 1;
        let rays = (0..n.div_ceil(stride)).into_par_iter().filter_map(|k| {
            let at = k * stride;
            let view = self.first.partition_point(|&f| f <= at) - 1;
            self.views[view].ray((at - self.first[view]) as usize)
        });
        rays.collect()
    }
}

impl TrainingView {
    /// The ray through a pixel's centre.
    fn ray(&self, pixel: usize) -> Option<Ray<f32>> {
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
    fn colour(&self, pixel: usize, behind: Option<[f32; 3]>) -> [f32; 3] {
        let rgba = self.photo.image.rgba(pixel);
        match behind {
            Some(behind) => over(rgba, behind),
            None => self.exposure.through([rgba[0], rgba[1], rgba[2]]).colour,
        }
    }

    /// The mask of what is refractive.
    fn refractive(&self) -> Option<&Arc<Mask>> {
        self.shifted.as_ref().or_else(|| self.stated()).or(self.found.as_ref())
    }

    /// That of the data.
    fn stated(&self) -> Option<&Arc<Mask>> {
        self.photo.mask.as_ref().filter(|_| self.meaning == MaskMeaning::Refractive)
    }

    /// The pixel so many columns and rows further, if there is one.
    fn moved(&self, pixel: usize, [columns, rows]: [i64; 2]) -> Option<usize> {
        let [width, height] = [self.photo.image.width, self.photo.image.height].map(i64::from);
        let (x, y) = (pixel as i64 % width + columns, pixel as i64 / width + rows);
        let is_there = (0..width).contains(&x) && (0..height).contains(&y);
        is_there.then(|| (y * width + x) as usize)
    }

    /// Neither the pixel nor any within so many rows and columns shows something refractive.
    fn clearly_outside(&self, pixel: usize, margin: usize) -> bool {
        let Some(mask) = self.refractive() else { return true };
        let (w, h) = (mask.width as usize, mask.height as usize);
        let (x, y) = (pixel % w, pixel / w);
        let columns = x.saturating_sub(margin)..(x + margin + 1).min(w);
        let mut rows = y.saturating_sub(margin)..(y + margin + 1).min(h);
        rows.all(|y| mask.coverage[y * w..][columns.clone()].iter().all(|c| *c == 0))
    }

    /// Whether a mask lets the pixel count.
    fn used(&self, pixel: usize) -> bool {
        is_used(&self.photo, self.meaning, pixel)
    }
}

/// Whether a mask of this meaning lets the pixel of a photograph count.
pub fn is_used(photo: &Photo, meaning: MaskMeaning, pixel: usize) -> bool {
    let Some(mask) = &photo.mask else { return true };
    match meaning {
        MaskMeaning::Refractive => true,
        MaskMeaning::Keep => mask.coverage[pixel] > 127,
        MaskMeaning::Ignore => mask.coverage[pixel] <= 127,
    }
}

/// A transparent pixel before something.
pub fn over([r, g, b, alpha]: [f32; 4], behind: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|c| [r, g, b][c] * alpha + behind[c] * (1.0 - alpha))
}

/// The colour C of each ray of a batch, from what rays show over the model's own background. Where a batch brings its own
/// radiance behind the field, the model's is white.
pub fn shown(pixels: &[Pixel<f32>], batch: &Batch) -> Vec<[f32; 3]> {
    let colour = |(ray, pixel): (usize, &Pixel<f32>)| {
        let behind: [f32; 3] = batch.behind.get(ray).map_or([0.0; 3], |b| [0, 1, 2].map(|c| b[c] - WHITE[c]));
        [0, 1, 2].map(|c| pixel.colour[c] + pixel.transmittance * behind[c])
    };
    pixels.iter().enumerate().map(colour).collect()
}

/// |C − target|² of each ray of a batch, from what rays [show](shown).
pub fn squared_errors(pixels: &[Pixel<f32>], batch: &Batch) -> Vec<f64> {
    let error = |(colour, target): ([f32; 3], &[f32; 3])| {
        (0..3).map(|c| f64::from(colour[c] - target[c]).powi(2)).sum()
    };
    shown(pixels, batch).into_iter().zip(&batch.target).map(error).collect()
}

/// The colour behind transparent pictures in renderings and scores.
pub const WHITE: [f32; 3] = [1.0; 3];

/// The ray through the centre of pixel `row * width + column`.
pub fn pixel_ray(camera: &Camera, pixel: usize) -> Option<Ray<f32>> {
    ray_within(camera, pixel, [0.5; 2])
}

/// The ray through a point of a pixel; (0, 0) is its upper left corner, (1, 1) its lower right one.
pub fn ray_within(camera: &Camera, pixel: usize, at: [f64; 2]) -> Option<Ray<f32>> {
    let (x, y) = (pixel as u32 % camera.width, pixel as u32 / camera.width);
    camera.ray(f64::from(x) + at[0], f64::from(y) + at[1]).map(|r| r.cast())
}

fn directions_of(camera: &Camera, kept: &mut Vec<(Camera, DirectionTable)>) -> Option<DirectionTable> {
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
        let at = [f64::from(x) + 0.5 - camera.center[0], f64::from(y) + 0.5 - camera.center[1]];
        let d = camera.lens.direction([at[0] / camera.focal[0], at[1] / camera.focal[1]]);
        d.map_or(blind, |d| d.normalized().cast())
    });
    let all: DirectionTable = Arc::new(all.collect());
    kept.push((*camera, Arc::clone(&all)));
    Some(all)
}

//! Draws training rays: which pixel of which photograph, its ray and what it should show.

use super::batch::Batch;
use super::edition::Edition;
use super::inside::InsidePixels;
use super::lanes::{LANES, MOVE_LANES, OFFSET_LANE, PIXEL_LANE, REDRAWS};
use super::picture::Picture;
use super::pixel::pixel_size;
use super::selection::Selection;
use super::shown::WHITE;
use super::view::{DirectionTable, TrainingView, directions_of};
use crate::random::Random;
use rayon::prelude::*;
use refraxel_core::radiance::Filter;
use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::{Backdrop, Mask, Photo, View, is_one_place, is_white};
use std::sync::Arc;

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

/// The photographs that rays are drawn from.
pub struct RaySampler {
    pub(super) views: Vec<TrainingView>,
    inside: InsidePixels,
    /// Pixels before each view, and in all.
    first: Vec<u64>,
    transparent: bool,
    /// Some photographs have depth maps.
    measures: bool,
    pub(super) random: Random,
    /// Views that batches do not draw from, until they are given back.
    aside: Vec<usize>,
    /// Those of them that are given back last.
    witnesses: Vec<usize>,
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
    depth: f32,
}

/// How photographs are looked at.
#[derive(Clone, Copy, Default)]
struct Sight<'a> {
    /// Views that are not.
    aside: &'a [usize],
    /// Half the width of the window over which colours are averaged [pixel].
    reach: u32,
}

/// One in so many of the views that are kept aside stays there longer.
const WITNESSES: usize = 3;
/// Rays of a view that is kept aside, at most about.
const ASIDE_RAYS: usize = 2500;

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
        let measures = with_photos.iter().any(|s| s.photo.depth.is_some());
        let (views, random) = (with_photos, Random::new(seed));
        let (aside, witnesses) = (Vec::new(), Vec::new());
        let (photographs, masks) = (Edition::default(), Edition::default());
        let (traces_found, shift) = (false, 0.0);
        Self {
            views,
            inside,
            first,
            transparent,
            measures,
            random,
            aside,
            witnesses,
            traces_found,
            shift,
            photographs,
            masks,
        }
    }

    /// From now on batches draw from the other views only: every so many-th is kept aside, `count` in all.
    pub fn keep_aside(&mut self, count: usize) {
        let all = self.views.len();
        let count = count.min(all);
        self.aside = (0..count).map(|k| (2 * k + 1) * all / (2 * count)).collect();
        self.witnesses = self.aside.iter().copied().step_by(WITNESSES).collect();
    }

    /// Batches draw from all views again.
    pub fn give_back(&mut self) {
        self.aside.clear();
    }

    /// Batches draw from all views again but the witnesses.
    pub fn give_back_but_witnesses(&mut self) {
        self.aside.clone_from(&self.witnesses);
    }

    /// Pixels of the witnesses: of a third of the views that were kept aside.
    pub fn witnesses(&self) -> Vec<AsideView> {
        self.witnesses.iter().map(|&view| self.pixels_of(view)).collect()
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
        let is_inside = |p: &usize| of.refractive().is_none_or(|m| is_white(m.coverage[*p]));
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
        pixel_size(self.views.iter().map(|view| &view.camera), at.cast()) as f32
    }

    /// Share of the pixels that lie inside refractive masks.
    pub fn mask_share(&self) -> f64 {
        self.inside.count() as f64 / self.pixels().max(1) as f64
    }

    /// Pixels in all.
    pub fn pixels(&self) -> u64 {
        self.first[self.first.len() - 1]
    }

    /// At most `size` rays through pixels of all photographs, which take turns: a function of the seed, the step and the selection.
    pub fn batch(&self, step: u64, size: usize, selection: Selection) -> Batch {
        self.blurred_batch(step, size, selection, 0)
    }

    /// The same, of photographs blurred by as much as a [`Draw`](super::Draw) says.
    pub(super) fn blurred_batch(&self, step: u64, size: usize, selection: Selection, reach: u32) -> Batch {
        self.drawn(step, size, selection, Sight { aside: &self.aside, reach }).0
    }

    /// The same of all views, also of those that are kept aside, and the number of each ray's view.
    pub fn batch_of_views(&self, step: u64, size: usize, selection: Selection) -> (Batch, Vec<usize>) {
        self.drawn(step, size, selection, Sight::default())
    }

    /// At most `size` rays near borders between areas of refractive masks, and how far outside each lies, to the nearest pixel of the
    /// other kind [pixel]: negative inside, at most `reach`. Nothing narrower than that counts: with the distance from a straw that
    /// masks leave out, what rays see would change from the straw to what is behind it.
    pub fn near_borders(&self, step: u64, size: usize, reach: u32) -> (Batch, Vec<f32>) {
        let sight = Sight { aside: &self.aside, reach: 0 };
        let draw = |i| self.draw(step, i, size as u64, Selection::Around(reach), sight);
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
        for Drawn { ray, target, behind, offset, beside, depth, .. } in drawn {
            batch.rays.push(*ray);
            batch.target.push(*target);
            batch.offset.push(*offset);
            batch.beside.push(*beside);
            batch.behind.extend(self.transparent.then_some(*behind));
            batch.depth.extend(self.measures.then_some(*depth));
        }
        batch
    }

    fn drawn(&self, step: u64, size: usize, selection: Selection, sight: Sight) -> (Batch, Vec<usize>) {
        let draw = |i| self.draw(step, i, size as u64, selection, sight);
        let drawn: Vec<Drawn> = (0..size as u64).into_par_iter().filter_map(draw).collect();
        (self.gathered(drawn.iter()), drawn.iter().map(|d| d.view).collect())
    }

    fn draw(&self, step: u64, i: u64, size: u64, selection: Selection, sight: Sight) -> Option<Drawn> {
        let lane = |k: u64| i * LANES + k;
        let inside = self.rays_inside(size, selection);
        let from_inside = i < inside;
        let by = match selection {
            Selection::Around(reach) => MOVE_LANES.map(|k| {
                let (reach, places) = (i64::from(reach), 2 * u64::from(reach) + 1);
                self.random.below(places, step, lane(k)) as i64 - reach
            }),
            _ => [0, 0],
        };
        let (view, pixel, ray) = (0..REDRAWS).find_map(|k| {
            let below = |n: u64, ray: u64, rays: u64| match k {
                0 => self.random.turn(n, step, ray, rays),
                _ => self.random.below(n, step, lane(PIXEL_LANE + k)),
            };
            let (view, pixel) = if from_inside {
                let number = below(self.inside.count(), i, inside);
                let view = self.inside.view(number);
                let pixel = self.inside.pixel(number, self.views[view].refractive()?)?;
                (view, self.views[view].moved(pixel, by)?)
            } else {
                let at = below(self.pixels(), i - inside, size - inside);
                let view = self.first.partition_point(|&f| f <= at) - 1;
                (view, (at - self.first[view]) as usize)
            };
            let of = &self.views[view];
            let ray = of.ray(pixel)?;
            let selected = match selection {
                Selection::Outside(margin) => of.clearly_outside(pixel, margin as usize),
                _ => true,
            };
            let free = !sight.aside.contains(&view);
            (free && of.used(pixel) && selected).then_some((view, pixel, ray))
        })?;
        let behind = std::array::from_fn(|c| self.random.uniform(step, lane(c as u64)) as f32);
        let target = self.views[view].mean_colour(pixel, sight.reach, self.transparent.then_some(behind));
        let offset = self.random.uniform(step, lane(OFFSET_LANE)) as f32;
        let beside = self.views[view].refractive().is_some_and(|mask| mask.coverage[pixel] == 0);
        let depth = self.views[view].measured(pixel, &ray);
        Some(Drawn { view, pixel, ray, target, behind, offset, beside, depth })
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

    /// How many rays of a batch, the first ones, are drawn inside refractive masks alone.
    pub(super) fn rays_inside(&self, size: u64, selection: Selection) -> u64 {
        match selection {
            Selection::Inside(share) => (self.extra_inside(share) * size as f64).ceil() as u64,
            Selection::Around(_) if self.inside.count() > 0 => size,
            _ => 0,
        }
    }

    /// Share of a batch to draw from inside alone, so that `share` of it lies inside in all.
    fn extra_inside(&self, share: f64) -> f64 {
        let natural = self.mask_share();
        if self.inside.count() == 0 || natural >= share { 0.0 } else { (share - natural) / (1.0 - natural) }
    }

    /// Changes with the masks of what is refractive.
    pub fn masks_edition(&self) -> &Edition {
        &self.masks
    }

    /// That of the photographs themselves, of their masks of what may be used, and of the lenses that the data say: they never change.
    pub fn photographs_edition(&self) -> &Edition {
        &self.photographs
    }

    /// Whether what lies behind the photographs is random.
    pub fn is_transparent(&self) -> bool {
        self.transparent
    }

    /// Whether batches draw from a view.
    pub fn is_aside(&self, view: usize) -> bool {
        self.aside.contains(&view)
    }
}

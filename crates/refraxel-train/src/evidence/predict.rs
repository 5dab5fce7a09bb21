//! What a candidate should show: rays through it, and what their exit rays meet in the field of straight rays.

use super::detail::Detail;
use super::photographs::Cutting;
use super::{Photographs, Scores};
use crate::backend::{Backend, Layers, Marching};
use crate::model::Refraction;
use rayon::prelude::*;
use refraxel_core::optics::PathEnd;
use refraxel_core::radiance::Pixel;
use refraxel_core::structure::{Pictures, luminance};
use refraxel_core::{Extent, Path, Ray};

/// A ray counts where it ends in something, to this transmittance, or before a known backdrop: elsewhere nobody knows what it
/// should show.
const MOST_TRANSMITTANCE: f32 = 0.1;
/// A path that meets more surfaces says little: errors of the shape grow with each.
const MOST_EVENTS: usize = 8;
/// A pixel counts where this part of its rays does.
const COUNTED: f32 = 0.7;

/// What a candidate should show in the views of some photographs.
pub(crate) struct Predicted {
    detail: Detail,
    /// Per view.
    pictures: Vec<PredictedPicture>,
}

/// What it should show in one view.
struct PredictedPicture {
    /// Luminance of each pixel of the [cutting](Cutting) [code value]; 0 where it does not count.
    shown: Vec<f32>,
    /// 1 where a pixel counts.
    weight: Vec<f32>,
    /// Which of its rays do.
    counted: Vec<bool>,
}

/// How rays go on behind a medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Way {
    /// As they leave it.
    Bent,
    /// As they came, from beside the place where the bent ones leave: one looks straight through.
    Straight,
}

/// The prediction of a medium, theory (4.24): paths by its optics, then straight on through the field that `backend` holds, from the
/// last surface on. `backend` bends nothing, and is clear where the medium is.
pub(crate) fn predict(
    backend: &dyn Backend,
    marching: &Marching,
    photographs: &Photographs,
    detail: Detail,
    medium: &Refraction,
    way: Way,
) -> Predicted {
    let cuttings: Vec<&Cutting> = photographs.cuttings(detail).iter().collect();
    let (exits, pixels) = behind(backend, marching, &rays_of(&cuttings), medium, way);
    Predicted::of(detail, &cuttings, &exits, &pixels, backend.domain().extent)
}

/// The rays that go on behind a medium, and what each shows.
pub(super) fn behind(
    backend: &dyn Backend,
    marching: &Marching,
    rays: &[Ray<f32>],
    medium: &Refraction,
    way: Way,
) -> (Vec<Option<Ray<f32>>>, Vec<Pixel<f32>>) {
    let tracer = medium.tracer(backend.domain(), 0.0);
    let exit = |path: &mut Path<f32>, ray: &Ray<f32>| {
        tracer.trace_into(ray, path);
        let exit = exit_of(path, ray)?;
        let beside = || ray.at(ray.direction.dot(exit.origin - ray.origin));
        Some(if way == Way::Bent { exit } else { Ray { origin: beside(), direction: ray.direction } })
    };
    let exits: Vec<Option<Ray<f32>>> =
        rays.par_iter().with_min_len(256).map_init(Path::default, exit).collect();
    let asked: Vec<Ray<f32>> = exits.iter().flatten().copied().collect();
    let pixels = backend.render(&asked, &Marching { near: 0.0, ..*marching }, Layers::All);
    (exits, pixels)
}

/// What a backend shows of the same pixels, with whatever it bends.
pub(crate) fn rendered(
    backend: &dyn Backend,
    marching: &Marching,
    photographs: &Photographs,
    detail: Detail,
) -> Predicted {
    let cuttings: Vec<&Cutting> = photographs.cuttings(detail).iter().collect();
    let rays = rays_of(&cuttings);
    let pixels = backend.render(&rays, marching, Layers::All);
    let shown: Vec<Option<f32>> = pixels.iter().map(|p| Some(luminance(p.colour))).collect();
    Predicted::new(detail, &cuttings, &shown)
}

/// The rays of all pixels of some views, one view after the other.
pub(super) fn rays_of(cuttings: &[&Cutting]) -> Vec<Ray<f32>> {
    cuttings.iter().flat_map(|c| c.rays.iter().copied()).collect()
}

/// The ray that leaves a medium, from the last surface that it met; `None` where it met nothing, is caught, or met too many surfaces.
pub(super) fn exit_of(path: &Path<f32>, ray: &Ray<f32>) -> Option<Ray<f32>> {
    let events = path.events().count();
    let bends = events > 0 || path.bends(ray);
    let is_known = path.end == PathEnd::Escaped && bends && events <= MOST_EVENTS;
    let last = path.segments.last().filter(|_| is_known)?;
    let exit = Ray { origin: last.start, direction: path.exit.direction };
    Some(exit).filter(|e| e.origin.is_finite() && e.direction.is_finite())
}

impl Predicted {
    /// From what the exit rays show. They count where they end in something, or before the backdrop of a bounded scene.
    pub(super) fn of(
        detail: Detail,
        cuttings: &[&Cutting],
        exits: &[Option<Ray<f32>>],
        pixels: &[Pixel<f32>],
        extent: Extent,
    ) -> Self {
        let mut pixels = pixels.iter();
        let shown: Vec<Option<f32>> = exits
            .iter()
            .map(|exit| {
                let pixel = exit.and_then(|_| pixels.next())?;
                let is_known = extent == Extent::Bounded || pixel.transmittance <= MOST_TRANSMITTANCE;
                is_known.then(|| luminance(pixel.colour))
            })
            .collect();
        Self::new(detail, cuttings, &shown)
    }

    /// From one luminance per ray.
    fn new(detail: Detail, cuttings: &[&Cutting], shown: &[Option<f32>]) -> Self {
        let each = detail.rays() * detail.rays();
        let mut rest = shown;
        let picture = |cutting: &&Cutting| {
            let (own, others) = rest.split_at(cutting.rays.len());
            rest = others;
            let mut out = PredictedPicture {
                shown: vec![0.0; cutting.luminance.len()],
                weight: vec![0.0; cutting.luminance.len()],
                counted: own.iter().map(Option::is_some).collect(),
            };
            for (pixel, rays) in cutting.pixels.iter().zip(own.chunks_exact(each)) {
                let counted = rays.iter().flatten().count() as f32;
                if counted >= COUNTED * each as f32 {
                    out.shown[*pixel] = rays.iter().flatten().sum::<f32>() / counted;
                    out.weight[*pixel] = 1.0;
                }
            }
            out
        };
        Self { detail, pictures: cuttings.iter().map(picture).collect() }
    }

    /// How alike the prediction and the photographs are.
    pub(crate) fn scores(&self, photographs: &Photographs) -> Scores {
        self.compared(photographs, self)
    }

    /// How alike other pictures of the same pixels are to the photographs, where this prediction counts.
    pub(crate) fn scores_of(&self, other: &Self, photographs: &Photographs) -> Scores {
        other.compared(photographs, self)
    }

    fn compared(&self, photographs: &Photographs, where_counts: &Self) -> Scores {
        let structure = self.detail.structure();
        let cuttings = photographs.cuttings(self.detail);
        let views = self.pictures.par_iter().zip(&where_counts.pictures).zip(cuttings);
        let score = |((own, counts), cutting): ((&PredictedPicture, &PredictedPicture), &Cutting)| {
            let (size, shown, weight) = (cutting.size, &own.shown[..], &counts.weight[..]);
            let photograph = &cutting.luminance[..];
            structure.similarity(&Pictures { size, shown, photograph, weight }).map(|s| s.score)
        };
        Scores(views.map(score).collect())
    }

    /// How alike each prediction is to the photograph of the next view, cut out around its own mask: what any two pictures of the same
    /// things have in common.
    pub(crate) fn scores_of_others(&self, photographs: &Photographs) -> Scores {
        let structure = self.detail.structure();
        let cuttings = photographs.cuttings(self.detail);
        let n = cuttings.len();
        let score = |k: usize| {
            let (own, cutting, other) = (&self.pictures[k], &cuttings[k], &cuttings[(k + 1) % n]);
            let size = [0, 1].map(|a| cutting.size[a].min(other.size[a]));
            let cut = |of: &[f32], width: usize| -> Vec<f32> {
                (0..size[1]).flat_map(|y| of[y * width..][..size[0]].iter().copied()).collect()
            };
            let shown = cut(&own.shown, cutting.size[0]);
            let mut weight = cut(&own.weight, cutting.size[0]);
            let mut inside = vec![0.0; other.luminance.len()];
            other.pixels.iter().for_each(|p| inside[*p] = 1.0);
            let (photograph, inside) = (cut(&other.luminance, other.size[0]), cut(&inside, other.size[0]));
            weight.iter_mut().zip(&inside).for_each(|(w, i)| *w *= i);
            let pictures = Pictures { size, shown: &shown, photograph: &photograph, weight: &weight };
            structure.similarity(&pictures).map(|s| s.score)
        };
        Scores((0..if n > 1 { n } else { 0 }).map(score).collect())
    }

    /// The derivative of the mean score over views by the luminance that each ray shows, theory (4.25).
    pub(super) fn gradient(&self, cuttings: &[&Cutting]) -> Vec<f32> {
        let (structure, each) = (self.detail.structure(), self.detail.rays() * self.detail.rays());
        let of_view = |(picture, cutting): (&PredictedPicture, &&Cutting)| {
            let (size, shown, weight) = (cutting.size, &picture.shown[..], &picture.weight[..]);
            let pictures = Pictures { size, shown, photograph: &cutting.luminance, weight };
            let Some((_, d_shown)) = structure.similarity_vjp(&pictures) else {
                return (false, vec![0.0; cutting.rays.len()]);
            };
            let mut d_rays = Vec::with_capacity(cutting.rays.len());
            for (pixel, counted) in cutting.pixels.iter().zip(picture.counted.chunks_exact(each)) {
                let count = counted.iter().filter(|c| **c).count().max(1) as f32;
                // forward: shown = Σ rays / count
                let d = picture.weight[*pixel] * d_shown[*pixel] / count;
                d_rays.extend(counted.iter().map(|c| if *c { d } else { 0.0 }));
            }
            (true, d_rays)
        };
        let views: Vec<(bool, Vec<f32>)> = self.pictures.par_iter().zip(cuttings).map(of_view).collect();
        let scored = views.iter().filter(|v| v.0).count().max(1) as f32;
        views.into_iter().flat_map(|v| v.1).map(|d| d / scored).collect()
    }
}

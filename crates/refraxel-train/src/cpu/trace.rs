//! The paths of rays through the medium, and on the way back what their rays and the index that bent them receive.

use super::packet::{Packet, PacketRay};
use super::record::IndexSample;
use super::view::View;
use crate::backend::{IndexObjective, RayGradient};
use refraxel_core::optics::{PartialReflectionAdjoint, PathAdjoint, RayAdjoint, Tracer};
use refraxel_core::radiance::{Filter, Segment, SegmentAdjoint};
use refraxel_core::{IndexGradient, IndexGrid, LevelSet, Path, Ray, Vec3};

/// The first stage: the paths of some rays.
#[inline(always)]
pub(super) fn trace(view: &View, rays: &[Ray<f32>], packet: &mut Packet) {
    packet.rays.clear();
    for (ray, path) in rays.iter().zip(&mut packet.paths) {
        let bent = trace_ray(view, ray, path);
        packet.rays.push(PacketRay {
            bent,
            exit: path.exit,
            samples: 0..0,
            left: 1.0,
            mirrored: 0..0,
            through: Filter::clear(),
        });
    }
}

/// The path of a ray; whether it may bend. Of a straight ray there are its exit and its segments: one, or none where it misses the
/// scene.
#[inline(always)]
pub(super) fn trace_ray(view: &View, ray: &Ray<f32>, path: &mut Path<f32>) -> bool {
    match view.tracer.as_ref().filter(|_| view.scene.refraction.admits(ray)) {
        Some(tracer) => {
            tracer.trace_into(ray, path);
            true
        }
        None => {
            path.exit = *ray;
            path.segments.clear();
            path.segments.extend(Segment::straight(ray, view.scene.marcher.domain(), view.marching.near));
            false
        }
    }
}

/// The path of a ray, and what it receives.
pub(super) struct PathVjp<'a> {
    pub ray: &'a Ray<f32>,
    /// dLoss/d(direction) of the exit ray, tangential.
    pub d_exit: Vec3<f32>,
    /// The path, where the ray bends.
    pub bent: Option<BentPath<'a>>,
}

/// A path that bends.
#[derive(Clone, Copy)]
pub(super) struct BentPath<'a> {
    pub tracer: &'a Tracer<'a, f32>,
    pub path: &'a Path<f32>,
    pub learns_from: LearnsFrom,
    /// dLoss/d(partial reflections) of the path, from the first on.
    pub d_reflections: &'a [PartialReflectionAdjoint<f32>],
    /// What the segments receive through what they absorb; empty where nothing does.
    pub d_lengths: &'a [SegmentAdjoint<f32>],
}

impl PathVjp<'_> {
    /// The way back of the first stage: dLoss/d(origin, direction) of the ray from dLoss/d(segments), theory (3.14), without what it
    /// shows; what index samples receive is noted, theory (2.16).
    #[inline(always)]
    pub(super) fn trace_vjp(
        &self,
        d_segments: &mut [SegmentAdjoint<f32>],
        index_samples: &mut Vec<IndexSample>,
    ) -> RayGradient {
        let Some(BentPath { tracer, path, learns_from, d_reflections, d_lengths }) = self.bent else {
            let direction = d_segments[0].momentum + self.d_exit;
            return RayGradient { origin: d_segments[0].start, direction, ..RayGradient::zero() };
        };
        for (sum, d) in d_segments.iter_mut().zip(d_lengths) {
            sum.momentum += d.momentum;
            sum.end += d.end;
        }
        let exit = RayAdjoint { origin: Vec3::zero(), direction: self.d_exit };
        let d_path = PathAdjoint { segments: d_segments, reflections: d_reflections, exit };
        let mut noted = IndexSamples { list: index_samples, learns_from };
        let d = tracer.vjp(self.ray, path, &d_path, &mut noted);
        RayGradient { origin: d.origin, direction: d.direction, ..RayGradient::zero() }
    }
}

/// What learns from a path: what it meets surfaces seldom enough for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct LearnsFrom {
    index: bool,
    pub(super) surface: bool,
}

impl LearnsFrom {
    pub(super) const NOTHING: Self = Self { index: false, surface: false };

    /// Everything, where no objective says otherwise.
    pub(super) fn of(path: &Path<f32>, objective: Option<&IndexObjective>) -> Self {
        let events = path.events().count();
        let within = |most: fn(&IndexObjective) -> u32| objective.is_none_or(|o| events <= most(o) as usize);
        Self { index: within(|o| o.index_events), surface: within(|o| o.surface_events) }
    }
}

/// Notes index samples for a later scatter.
struct IndexSamples<'a> {
    list: &'a mut Vec<IndexSample>,
    learns_from: LearnsFrom,
}

impl IndexGradient<f32> for IndexSamples<'_> {
    #[inline(always)]
    fn add(&mut self, region: usize, _: &IndexGrid<f32>, x: Vec3<f32>, d_value: f32, d_gradient: Vec3<f32>) {
        if self.learns_from.index {
            let region = region as u32;
            self.list.push(IndexSample { region, surface: false, x, d_value, d_gradient });
        }
    }
    #[inline(always)]
    fn add_level_set(
        &mut self,
        region: usize,
        _: &LevelSet<f32>,
        x: Vec3<f32>,
        d_value: f32,
        d_gradient: Vec3<f32>,
    ) {
        if self.learns_from.surface {
            let region = region as u32;
            self.list.push(IndexSample { region, surface: true, x, d_value, d_gradient });
        }
    }
}

//! From the records of a path's samples back to the path: its ray, and the index that bent it.

use super::colour::{SampleStencil, shade_vjp};
use super::layout::{LANES, MAX_BLOCKS, voxels};
use super::record::{IndexSample, Record};
use super::sample::RaySamples;
use super::scene::Scene;
use crate::backend::{IndexObjective, RayGradient};
use fearless_simd::Simd;
use refraxel_core::grid::trilinear;
use refraxel_core::optics::{PartialReflectionAdjoint, PathAdjoint, RayAdjoint, Tracer};
use refraxel_core::radiance::SegmentAdjoint;
use refraxel_core::{IndexGradient, IndexGrid, LevelSet, Path, Ray, Vec3};

/// dLoss/d(start, momentum) per segment of a path.
pub(super) type SegmentSums = Vec<SegmentAdjoint<f32>>;

/// What the adjoint of a ray starts from.
pub(super) struct RayVjp<'a> {
    pub ray: &'a Ray<f32>,
    /// Its samples, and their records in the same order.
    pub samples: RaySamples<'a>,
    pub records: &'a [Record],
    /// dLoss/d(direction) of the exit ray, tangential.
    pub d_exit: Vec3<f32>,
    /// The path, where the ray bends.
    pub bent: Option<BentPath<'a>>,
    /// All samples count. Otherwise those before the first index sample are left out: no index moves them.
    pub all: bool,
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

impl RayVjp<'_> {
    /// dLoss/d(origin, direction) of the ray, theory (3.14), without what it shows; what index samples receive is noted, theory (2.16).
    #[inline(always)]
    pub(super) fn run<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        scene: &Scene,
        sums: &mut SegmentSums,
        index_samples: &mut Vec<IndexSample>,
    ) -> RayGradient {
        self.add_samples::<S, BLOCKS>(simd, scene, sums);
        let Some(BentPath { tracer, path, learns_from, d_reflections, d_lengths }) = self.bent else {
            let direction = sums[0].momentum + self.d_exit;
            return RayGradient { origin: sums[0].start, direction, ..RayGradient::zero() };
        };
        for (sum, d) in sums.iter_mut().zip(d_lengths) {
            sum.momentum += d.momentum;
            sum.end += d.end;
        }
        let exit = RayAdjoint { origin: Vec3::zero(), direction: self.d_exit };
        let d_path = PathAdjoint { segments: &sums[..], reflections: d_reflections, exit };
        let mut noted = IndexSamples { list: index_samples, learns_from };
        let d = tracer.vjp(self.ray, path, &d_path, &mut noted);
        RayGradient { origin: d.origin, direction: d.direction, ..RayGradient::zero() }
    }

    /// dLoss/d(start, momentum) of the segments, from the samples on them.
    #[inline(always)]
    fn add_samples<S: Simd, const BLOCKS: usize>(&self, simd: S, scene: &Scene, sums: &mut SegmentSums) {
        let segments = self.bent.map_or(1, |b| b.path.segments.len());
        let fixed = if self.all { 0 } else { 1 };
        sums.clear();
        sums.resize(segments, SegmentAdjoint::default());
        let colour = voxels::<BLOCKS>(&scene.field.colour);
        let mut records = self.records;
        for samples in self.samples.samples.chunk_by(|a, b| a.segment == b.segment) {
            let (own, others) = records.split_at(samples.len());
            records = others;
            let on = self.samples.segment_of(&samples[0]);
            if (on.place as usize) < fixed {
                continue;
            }
            let (coloured, sum) = (scene.layout.with(&on.basis), &mut sums[on.place as usize]);
            let mut d_basis = [[0.0; LANES]; MAX_BLOCKS];
            for (s, r) in samples.iter().zip(own) {
                let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
                let stencil =
                    SampleStencil { corners: &s.corners, weights: &s.weights, fraction: s.fraction };
                let d_node = shade_vjp(simd, colour, stencil, coloured, r.d_colour, &mut d_basis);
                let d_node = d_node + trilinear::gradient(s.fraction, &theta_at) * r.d_theta;
                let d_x = scene.field.domain.node_vjp(on.segment.at(s.t), d_node);
                // dLoss/dτ · dτ/d|p| with τ = σ dt |p|.
                let d_tau = if s.slope > 0.0 { r.d_theta / s.slope } else { 0.0 };
                sum.start += d_x;
                sum.momentum += d_x * s.t + on.unit * (d_tau * s.tau / on.speed);
            }
            // All samples of a segment have one direction, and what it receives is linear in what they owe.
            let d_unit = scene.layout.basis_vjp(on.unit, &d_basis);
            sum.momentum += (d_unit - on.unit * on.unit.dot(d_unit)) / on.speed;
        }
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

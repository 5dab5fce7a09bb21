//! From the records of a path's samples back to the path: its ray, and the index that bent it.

use super::Scene;
use super::colour::{shade_vjp, voxels};
use super::march::Sample;
use super::tape::{IndexSample, Record};
use super::trace::MarchedSegment;
use fearless_simd::Simd;
use refraxel_core::grid::trilinear;
use refraxel_core::optics::{self, PartialReflectionAdjoint, RayAdjoint, Tracer};
use refraxel_core::radiance::SegmentAdjoint;
use refraxel_core::{IndexGradient, IndexGrid, LevelSet, Path, Ray, Vec3};

/// dLoss/d(start, momentum) per segment of a path.
pub(super) type SegmentSums = Vec<SegmentAdjoint<f32>>;

/// What the adjoint of a path needs besides its samples.
pub(super) struct PathAdjoint<'a> {
    pub ray: &'a Ray<f32>,
    /// dLoss/d(direction) of the exit ray, tangential.
    pub d_exit: Vec3<f32>,
    /// All samples count. Otherwise those before the first index_sample are left out: no index moves them.
    pub all: bool,
    /// The index learns from the path: it meets surfaces seldom enough.
    pub counts: bool,
    /// dLoss/d(partial reflections) of the path, from the first on.
    pub d_reflections: &'a [PartialReflectionAdjoint<f32>],
}

impl PathAdjoint<'_> {
    /// dLoss/d(origin, direction) of the ray, theory (3.14); what index_samples receive is noted, theory (2.16).
    #[inline(always)]
    pub(super) fn run<S: Simd, const BLOCKS: usize>(
        &self,
        simd: S,
        scene: &Scene,
        (samples, records, marched): (&[Sample], &[Record], &[MarchedSegment]),
        bent: Option<(&Tracer<f32>, &Path<f32>)>,
        (sums, index_samples): (&mut SegmentSums, &mut Vec<IndexSample>),
    ) -> (Vec3<f32>, Vec3<f32>) {
        let segments = bent.map_or(1, |(_, path)| path.segments.len());
        let fixed = if self.all { 0 } else { 1 };
        sums.clear();
        sums.resize(segments, SegmentAdjoint::default());
        let colour = voxels::<BLOCKS>(&scene.field.colour);
        for (s, r) in samples.iter().zip(records) {
            let marched_segment = &marched[s.segment as usize];
            if (marched_segment.place as usize) < fixed {
                continue;
            }
            let theta_at = s.corners.map(|v| scene.field.density[v as usize]);
            let sample = (&s.corners, &s.weights, s.fraction);
            let (d_node, d_basis) =
                shade_vjp(simd, colour, sample, (scene.layout, &marched_segment.basis), r.d_colour);
            let d_node = d_node + trilinear::gradient(s.fraction, &theta_at) * r.d_theta;
            let d_x = scene.field.domain.node_vjp(marched_segment.segment.at(s.t), d_node);
            let d_unit = scene.layout.basis_vjp(marched_segment.unit, &d_basis);
            // dLoss/dτ · dτ/d|p| with τ = σ dt |p|.
            let d_tau = if s.slope > 0.0 { r.d_theta / s.slope } else { 0.0 };
            let tangent = d_unit - marched_segment.unit * marched_segment.unit.dot(d_unit);
            let sum = &mut sums[marched_segment.place as usize];
            sum.start += d_x;
            sum.momentum +=
                d_x * s.t + (marched_segment.unit * (d_tau * s.tau) + tangent) / marched_segment.speed;
        }
        let Some((tracer, path)) = bent else {
            return (sums[0].start, sums[0].momentum + self.d_exit);
        };
        let exit = RayAdjoint { origin: Vec3::zero(), direction: self.d_exit };
        let mut index_samples = IndexSampleTape { list: index_samples, wanted: self.counts };
        let d_path = optics::PathAdjoint { segments: sums, reflections: self.d_reflections, exit };
        let d = tracer.vjp(self.ray, path, &d_path, &mut index_samples);
        (d.origin, d.direction)
    }
}

/// Notes index_samples for a later scatter.
struct IndexSampleTape<'a> {
    list: &'a mut Vec<IndexSample>,
    /// The path counts.
    wanted: bool,
}

impl IndexGradient<f32> for IndexSampleTape<'_> {
    #[inline(always)]
    fn add(&mut self, region: usize, _: &IndexGrid<f32>, x: Vec3<f32>, d_w: f32, d_force: Vec3<f32>) {
        if self.wanted {
            self.list.push(IndexSample { region: region as u32, surface: false, x, d: (d_w, d_force) });
        }
    }
    #[inline(always)]
    fn add_level_set(
        &mut self,
        region: usize,
        _: &LevelSet<f32>,
        x: Vec3<f32>,
        d_phi: f32,
        d_gradient: Vec3<f32>,
    ) {
        if self.wanted {
            self.list.push(IndexSample { region: region as u32, surface: true, x, d: (d_phi, d_gradient) });
        }
    }
}

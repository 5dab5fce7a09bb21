//! Throughput of rays that bend.

use super::objective::index;
use super::options::BenchOptions;
use super::scene::{BALL_NODES, ball, ball_bounds, model};
use super::throughput::{Throughput, throughput};
use crate::backend::Backend;
use crate::cpu::CpuBackend;
use crate::model::{MirrorSource, ProbeLayout, Reflection, Refraction};
use refraxel_core::sh::ShDegree;
use refraxel_core::{IndexGrid, Interpolation, Vec3};
use serde::Serialize;

const PROBES: ProbeLayout = ProbeLayout { longest: 8, degree: ShDegree::MAX };

/// Rays that bend, in all ways there are.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Refractive {
    /// A ball with a sharp surface, whose shape and index learn.
    #[serde(flatten)]
    pub sharp: Throughput,
    /// A ball with a transition of two voxels, all of whose nodes learn.
    pub smooth: Throughput,
    /// Time of a training step on random rays per sample, over that of straight rays: sharp.
    pub cost_per_sample: f64,
    /// The same: smooth.
    pub smooth_cost_per_sample: f64,
    /// The ball with a sharp surface that mirrors what learned probes hold.
    pub mirrored: Throughput,
    /// Time of a training step on random rays with a surface that mirrors, over that with one that does not.
    pub mirrored_cost: f64,
}

/// Measure rays that pass a ball of glass of half the width of the box, on an index grid of 64³ nodes.
pub fn refractive(options: &BenchOptions, straight: &Throughput) -> Refractive {
    let soft = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.5) / 0.02).tanh();
    let smooth =
        IndexGrid::from_control_values(ball_bounds(), [BALL_NODES; 3], Interpolation::CubicBSpline, soft);
    let measured = |medium: Refraction, layout: Option<ProbeLayout>| {
        let mut backend = CpuBackend::new(model(options.grid));
        backend.set_medium(medium);
        if let Some(layout) = &layout {
            let reflection = Reflection::of(backend.medium(), MirrorSource::Learned, layout);
            backend.set_reflection(reflection);
        }
        throughput(backend, options, Some(index()))
    };
    let (sharp, smooth) = (measured(ball(), None), measured(Refraction::of(vec![smooth]), None));
    let mirrored = measured(ball(), Some(PROBES));
    let mirrored_cost = sharp.train_msamples_per_s_per_core / mirrored.train_msamples_per_s_per_core;
    let cost = |t: &Throughput| straight.train_msamples_per_s_per_core / t.train_msamples_per_s_per_core;
    Refractive {
        sharp,
        smooth,
        cost_per_sample: cost(&sharp),
        smooth_cost_per_sample: cost(&smooth),
        mirrored,
        mirrored_cost,
    }
}

//! Throughput of a device other than the CPU, on the scene and the rays of the others.

use super::objective::{MARCHING, index, objective};
use super::options::BenchOptions;
use super::rays::{coherent_batch, random_batch};
use super::scene::ball;
use super::timing::best_within;
use crate::backend::{Backend, Batch, Layers, Objective};
use serde::Serialize;
use std::time::Instant;

/// Steps that are submitted before anybody waits, as in training.
const STEPS: u64 = 8;
/// No repetition of a measurement begins later than this [s].
const PATIENCE: f64 = 2.0;

/// Millions of samples per second of a device as a whole.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeviceThroughput {
    /// Rendering, coherent rays.
    pub forward_msamples_per_s: f64,
    /// Rendering, random rays.
    pub forward_random_msamples_per_s: f64,
    /// Training on random rays: forward, adjoint, gradient sums and optimiser step.
    pub train_msamples_per_s: f64,
    /// The same for coherent rays.
    pub train_coherent_msamples_per_s: f64,
    /// Rays per second of training on random rays.
    pub train_rays_per_s: f64,
}

/// How fast whole pictures are rendered, from rays on the host to pixels on the host.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrameRate {
    /// Pixels along each edge.
    pub size: u32,
    /// Pictures per second.
    pub frames_per_s: f64,
    /// Thousands of rays per second.
    pub krays_per_s: f64,
}

/// Some steps that were trained without a wait in between.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// How many.
    pub steps: u64,
    /// All rays of all steps.
    pub rays: u64,
    /// All samples.
    pub samples: u64,
    /// From the first submission to the last outcome.
    pub seconds: f64,
}

/// A backend that is measured.
pub struct DeviceBench<B> {
    backend: B,
    objective: Objective,
    options: BenchOptions,
    random: Batch,
    coherent: Batch,
}

impl<B: Backend> DeviceBench<B> {
    /// Measures a backend that holds the [model](super::model) of these options, and straight rays at first.
    pub fn new(backend: B, options: &BenchOptions) -> Self {
        let (random, coherent) = (random_batch(options.rays), coherent_batch(options.rays));
        Self { backend, objective: objective(), options: *options, random, coherent }
    }

    /// From now on rays bend, in a ball of glass of half the width of the box, whose shape and index learn.
    pub fn bend(&mut self) {
        self.backend.set_medium(ball());
        self.objective.index = Some(index());
    }

    /// The backend.
    pub fn backend(&self) -> &B {
        &self.backend
    }

    /// Random rays, and what is minimised on them.
    pub fn training(&self) -> (&Batch, &Objective) {
        (&self.random, &self.objective)
    }

    /// Train on random rays.
    pub fn round(&mut self) -> Round {
        round(&mut self.backend, &self.random, &self.objective)
    }

    /// Measure rendering and training.
    pub fn throughput(&mut self) -> DeviceThroughput {
        let Self { backend, objective, options, random, coherent } = self;
        let n = options.repetitions;
        let mut train = |batch: &Batch| {
            let mut samples = 0;
            let seconds = best_within(PATIENCE, n, || samples = round(backend, batch, objective).samples)
                / STEPS as f64;
            (samples as f64 / STEPS as f64, seconds)
        };
        let ((random_samples, random_seconds), (coherent_samples, coherent_seconds)) =
            (train(random), train(coherent));
        let forward = |batch: &Batch, samples: f64| samples / rendering(&*backend, batch, n) / 1e6;
        DeviceThroughput {
            forward_msamples_per_s: forward(coherent, coherent_samples),
            forward_random_msamples_per_s: forward(random, random_samples),
            train_msamples_per_s: random_samples / random_seconds / 1e6,
            train_coherent_msamples_per_s: coherent_samples / coherent_seconds / 1e6,
            train_rays_per_s: options.rays as f64 / random_seconds,
        }
    }

    /// Measure pictures of so many pixels along each edge.
    pub fn frames(&self, size: u32) -> FrameRate {
        let batch = coherent_batch(size as usize * size as usize);
        let frames_per_s = 1.0 / rendering(&self.backend, &batch, self.options.repetitions);
        FrameRate { size, frames_per_s, krays_per_s: frames_per_s * batch.rays.len() as f64 / 1e3 }
    }
}

/// Seconds that a rendering takes.
fn rendering(backend: &impl Backend, batch: &Batch, repetitions: usize) -> f64 {
    best_within(PATIENCE, repetitions, || drop(backend.render(&batch.rays, &MARCHING, Layers::All)))
}

fn round(backend: &mut impl Backend, batch: &Batch, objective: &Objective) -> Round {
    let start = Instant::now();
    (0..STEPS).for_each(|step| backend.submit(batch, objective, step));
    let samples = backend.outcomes(true).iter().map(|o| o.samples).sum();
    Round {
        steps: STEPS,
        rays: STEPS * batch.rays.len() as u64,
        samples,
        seconds: start.elapsed().as_secs_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BenchGrid, model};
    use super::*;
    use crate::CpuBackend;

    #[test]
    fn a_device_is_measured_by_the_samples_that_it_takes() {
        let options = BenchOptions { grid: BenchGrid::Dense(16), rays: 64, repetitions: 1, is_quick: true };
        let mut bench = DeviceBench::new(CpuBackend::new(model(options.grid)), &options);
        for bends in [false, true] {
            if bends {
                bench.bend();
            }
            let found = bench.throughput();
            // A ray crosses about 16 voxels, and never more than the diagonal.
            let samples_per_ray = found.train_msamples_per_s * 1e6 / found.train_rays_per_s;
            assert!((8.0..28.0).contains(&samples_per_ray), "{samples_per_ray}");
            assert!(found.forward_msamples_per_s > 0.0 && found.forward_random_msamples_per_s > 0.0);
            let round = bench.round();
            assert!((round.rays, round.samples / round.rays > 7) == (64 * STEPS, true), "{round:?}");
        }
        let frames = bench.frames(8);
        assert!((frames.krays_per_s / frames.frames_per_s - 0.064).abs() < 1e-9);
    }
}

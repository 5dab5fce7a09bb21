//! Throughput on one thread and on all, of straight rays and of whatever the scene holds.

use super::objective::MARCHING;
use super::options::BenchOptions;
use super::rays::{coherent_batch, random_batch};
use super::scene::model;
use super::timing::{best, learn, samples_of};
use crate::backend::{Backend, Batch, IndexObjective, Layers};
use crate::cpu::CpuBackend;
use serde::Serialize;

/// Millions of samples per second, per core and on all threads.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Throughput {
    /// Rendering, coherent rays, one thread.
    pub forward_msamples_per_s_per_core: f64,
    /// Rendering, random rays, one thread.
    pub forward_random_msamples_per_s_per_core: f64,
    /// Forward, adjoint, gradient sums and optimiser step, random rays, one thread.
    pub train_msamples_per_s_per_core: f64,
    /// The same for coherent rays.
    pub train_coherent_msamples_per_s_per_core: f64,
    /// Forward and adjoint alone, random rays, one thread.
    pub gradient_random_msamples_per_s_per_core: f64,
    /// Training on random rays with all threads.
    pub train_msamples_per_s: f64,
    /// Rays per second of the same.
    pub train_rays_per_s: f64,
    /// Rendering coherent rays with all threads.
    pub forward_msamples_per_s: f64,
    /// Threads that "all" means.
    pub threads: usize,
    /// Training speed on all threads over that on one.
    pub thread_speedup: f64,
}

/// Measure straight rays.
pub fn straight(options: &BenchOptions) -> Throughput {
    throughput(CpuBackend::new(model(options.grid)), options, None)
}

pub(super) fn throughput(
    mut backend: CpuBackend,
    options: &BenchOptions,
    index: Option<IndexObjective>,
) -> Throughput {
    let learn = |backend: &mut CpuBackend, batch: &Batch, n: usize| learn(backend, batch, n, index);
    let (random, coherent) = (random_batch(options.rays), coherent_batch(options.rays));
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    let n = options.repetitions;
    let samples = learn(&mut backend, &random, 1).samples;
    let forward = |b: &CpuBackend, batch: &Batch| {
        let samples = samples_of(b, batch) as f64;
        samples / best(n, || drop(b.render(&batch.rays, &MARCHING, Layers::All))) / 1e6
    };
    let single = one.install(|| {
        let coherent_forward = forward(&backend, &coherent);
        let random_forward = forward(&backend, &random);
        let gradient = samples as f64 / best(n, || _ = samples_of(&backend, &random)) / 1e6;
        let train_random = learn(&mut backend, &random, n);
        let train_coherent = learn(&mut backend, &coherent, n);
        (coherent_forward, random_forward, gradient, train_random.rate(), train_coherent.rate())
    });
    let all = learn(&mut backend, &random, n);
    Throughput {
        forward_msamples_per_s_per_core: single.0,
        forward_random_msamples_per_s_per_core: single.1,
        gradient_random_msamples_per_s_per_core: single.2,
        train_msamples_per_s_per_core: single.3,
        train_coherent_msamples_per_s_per_core: single.4,
        train_msamples_per_s: all.rate(),
        train_rays_per_s: options.rays as f64 / all.seconds,
        forward_msamples_per_s: forward(&backend, &coherent),
        threads: rayon::current_num_threads(),
        thread_speedup: all.rate() / single.3,
    }
}

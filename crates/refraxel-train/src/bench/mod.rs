//! Throughput of this machine on a fixed, dense scene: every sample inside the box is evaluated, nothing is skipped.
//!
//! 128³ voxels with density and SH of degree 2 (28 channels), steps of one voxel. *Coherent* rays are 8 × 8 tiles of one
//! picture; *random* rays come from all around and hit the box anywhere, as training batches do.

mod on_device;

pub use on_device::{DeviceThroughput, straight_on};

use crate::backend::{
    Backend, Batch, IndexObjective, Layers, Marching, Objective, ReflectionObjective, step,
};
use crate::cpu::CpuBackend;
use crate::model::{MirrorSource, Model, ProbeLayout, Reflection, Refraction};
use crate::options::Options;
use crate::random::Random;
use crate::schedule::index_objective;
use refraxel_core::sh::ShDegree;
use refraxel_core::{
    Aabb, Background, BrickMap, Camera, Domain, Extent, IndexGrid, Interpolation, LevelSet, Medium, Ray,
    Vec3, VoxelField, vec3,
};
use serde::Serialize;
use std::time::Instant;

/// Size and patience of a benchmark.
#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    /// Nodes per axis.
    pub resolution: u32,
    /// Rays of a batch.
    pub rays: usize,
    /// Repetitions; the best counts.
    pub repetitions: usize,
}

impl BenchOptions {
    /// A benchmark of a minute, or of a few seconds.
    pub fn suited_to(quick: bool) -> Self {
        let (rays, repetitions) = if quick { (4096, 3) } else { (16_384, 15) };
        Self { resolution: 128, rays, repetitions }
    }
}

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

/// Measure straight rays.
pub fn straight(options: &BenchOptions) -> Throughput {
    throughput(scene(options.resolution), options, None)
}

/// Measure rays that pass a ball of glass of half the width of the box, on an index grid of 64³ nodes.
pub fn refractive(options: &BenchOptions, straight: &Throughput) -> Refractive {
    let bounds = Aabb::new(Vec3::splat(-0.6), Vec3::splat(0.6));
    let surface = LevelSet::from_samples(bounds, [64; 3], |x: Vec3<f32>| x.length() - 0.5);
    let soft = |x: Vec3<f32>| 1.25 - 0.25 * ((x.length() - 0.5) / 0.02).tanh();
    let smooth = IndexGrid::from_control_values(bounds, [64; 3], Interpolation::CubicBSpline, soft);
    let measured = |grid: IndexGrid<f32>, layout: Option<ProbeLayout>| {
        let mut backend = scene(options.resolution);
        let medium = Medium::new(vec![grid]).expect("one region overlaps no other");
        backend.set_medium(Refraction { medium, ..Refraction::none() });
        if let Some(layout) = &layout {
            let reflection = Reflection::of(backend.medium(), MirrorSource::Learned, layout);
            backend.set_reflection(reflection);
        }
        throughput(backend, options, Some(index()))
    };
    let (sharp, smooth) = (measured(IndexGrid::sharp(surface.clone(), 1.5), None), measured(smooth, None));
    let mirrored = measured(IndexGrid::sharp(surface, 1.5), Some(PROBES));
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

fn throughput(mut backend: CpuBackend, options: &BenchOptions, index: Option<IndexObjective>) -> Throughput {
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

/// Name of the widest vector instructions that this machine has and the kernels use.
pub fn simd_level() -> String {
    let level = format!("{:?}", fearless_simd::Level::new()).to_lowercase();
    level.split('(').next().unwrap_or_default().to_owned()
}

const MARCHING: Marching = Marching { step: 1.0, near: 0.0, min_optical_depth: 0.0, min_transmittance: 0.0 };

/// The index learns as by default, at rates so small that the scene stays what it is.
fn index() -> IndexObjective {
    let usual = index_objective(&Options::default(), 0.0);
    IndexObjective { rate: 1e-7, surface_rate: 1e-6, surface_smooth: 1e-4, ..usual }
}

const PROBES: ProbeLayout = ProbeLayout { longest: 8, degree: ShDegree::MAX };

fn objective() -> Objective {
    Objective {
        marching: MARCHING,
        bent_weight: 1.0,
        sparsity: 0.0,
        opacity: 0.0,
        tv_density: 0.0,
        tv_colour: 0.0,
        tv_period: 1,
        rate_density: 1e-6,
        rate_colour: 1e-6,
        rate_view: 1.0,
        rate_background: 0.0,
        index: None,
        reflection: None,
        absorption: None,
    }
}

/// Samples of a step, and its seconds.
#[derive(Clone, Copy)]
struct Timed {
    samples: u64,
    seconds: f64,
}

impl Timed {
    /// Million samples per second.
    fn rate(self) -> f64 {
        self.samples as f64 / self.seconds / 1e6
    }
}

/// The best of `n` steps.
fn learn(backend: &mut CpuBackend, batch: &Batch, n: usize, index: Option<IndexObjective>) -> Timed {
    let mut samples = 0;
    let reflection =
        index.map(|_| ReflectionObjective { rate: 1e-6, rate_strength: 1e-7, rate_clearcoat: 0.0 });
    let objective = Objective { index, reflection, ..objective() };
    let seconds = best(n, || samples = step(backend, batch, &objective, 1).samples);
    Timed { samples, seconds }
}

fn samples_of(backend: &CpuBackend, batch: &Batch) -> u64 {
    backend.gradient_tapes(batch, &objective())
}

fn best(n: usize, mut work: impl FnMut()) -> f64 {
    (0..n.max(1))
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

fn scene(resolution: u32) -> CpuBackend {
    CpuBackend::new(model(resolution))
}

/// A translucent box of smooth structure.
fn model(resolution: u32) -> Model {
    let bounds = Aabb::new(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
    let domain = Domain::with_longest(bounds, Extent::Bounded, resolution);
    let map = BrickMap::dense(domain.resolution);
    let mut field = VoxelField::uniform(domain, map, ShDegree::new(2).expect("2 is a degree"), -3.0);
    for (i, v) in field.density.iter_mut().enumerate() {
        *v = -3.0 + (i as f32 * 1e-3).sin();
    }
    for (i, v) in field.colour.iter_mut().enumerate() {
        *v = 0.2 * (i as f32 * 0.37).sin();
    }
    field.clear_empty_brick();
    Model::straight(field, Background::Constant([1.0; 3]))
}

fn batch_of(rays: Vec<Ray<f32>>) -> Batch {
    let n = rays.len();
    Batch { rays, target: vec![[0.5; 3]; n], offset: vec![0.5; n], ..Batch::default() }
}

/// Rays from cameras all around at distance 4 towards points near the box's middle.
fn random_batch(n: usize) -> Batch {
    let random = Random::new(1);
    let rays = (0..n as u64).map(|i| {
        let u = |k: u64| random.uniform(i, k) as f32;
        let (azimuth, height) = (std::f32::consts::TAU * u(0), 0.1 + 0.8 * u(1));
        let flat = (1.0 - height * height).sqrt();
        let origin = vec3(flat * azimuth.cos(), flat * azimuth.sin(), height) * 4.0;
        let target = vec3(u(2) - 0.5, u(3) - 0.5, u(4) - 0.5) * 1.2;
        Ray { origin, direction: (target - origin).normalized() }
    });
    batch_of(rays.collect())
}

/// The middle of a picture in 8 × 8 tiles.
fn coherent_batch(n: usize) -> Batch {
    let side = ((n as f64).sqrt() as u32).next_multiple_of(8);
    let eye = vec3(2.6, 1.9, 2.4);
    let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.35, [side, side]);
    let rays = (0..n as u32).map(|i| {
        let (tile, within) = (i / 64, i % 64);
        let (x, y) = (tile % (side / 8) * 8 + within % 8, tile / (side / 8) * 8 + within / 8);
        camera.ray(f64::from(x) + 0.5, f64::from(y) + 0.5).expect("a pinhole has no blind pixel").cast()
    });
    batch_of(rays.collect())
}

//! `refraxel bench`: measures how fast this machine renders and trains.

use super::threads::set_threads;
use crate::cli::BenchArgs;
use crate::console::Console;
use crate::device::{self, Opened};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use crate::table::Table;
use anyhow::Context;
use rayon::prelude::*;
use refraxel_core::{Camera, ShDegree};
use refraxel_data::synth::{Sampling, SceneOptions, cameras, render_view, scene};
use refraxel_train::bench::{
    BenchGrid, BenchOptions, Refractive, Throughput, refractive, simd_level, straight,
};
use refraxel_train::plan::bytes_per_voxel;
use serde::Serialize;
use std::time::Instant;

/// All measurements, each the best of several repetitions.
#[derive(Serialize)]
struct Report {
    straight: Throughput,
    refractive: Refractive,
    synth: Synth,
    memory: Vec<Memory>,
    machine: Machine,
}

#[derive(Serialize)]
struct Synth {
    /// Camera rays of the exact tracer on the glass ball, all threads.
    rays_per_s: f64,
}

#[derive(Serialize)]
struct Memory {
    sh_degree: u8,
    /// Parameters and moments.
    bytes_per_voxel: u64,
}

#[derive(Serialize)]
struct Machine {
    grid: BenchGrid,
    threads: usize,
    simd: String,
    architecture: &'static str,
    repetitions: usize,
}

/// The verb.
pub fn run(args: &BenchArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    match device::open(args.device, None)?.opened {
        Opened::Cpu | Opened::ProcessGroup(..) => cpu(args),
        Opened::Gpu(gpu) => device::bench(gpu, args),
    }
}

fn cpu(args: &BenchArgs) -> Result<(), Failure> {
    let console = Console::new(args.work.json);
    let mut progress = Progress::new(Show::suited(args.work.quiet || args.work.json), "bench", 3);
    let options = BenchOptions { grid: args.grid, ..BenchOptions::suited_to(args.quick) };
    let straight = straight(&options);
    progress.set(1, "straight rays measured");
    let refractive = refractive(&options, &straight);
    progress.set(2, "bent rays measured");
    let synth = Synth { rays_per_s: synth(if args.quick { 1 } else { 5 })? };
    progress.finish("");
    let memory = |d: u8| {
        ShDegree::new(d).map(|degree| Memory { sh_degree: d, bytes_per_voxel: bytes_per_voxel(degree) })
    };
    let machine = Machine {
        grid: options.grid,
        threads: straight.threads,
        simd: simd_level(),
        architecture: std::env::consts::ARCH,
        repetitions: options.repetitions,
    };
    let report =
        Report { straight, refractive, synth, memory: (0..=3).filter_map(memory).collect(), machine };
    console.result(&report.text(), &report).or_exit(Exit::Io)
}

/// Camera rays per second of the exact tracer, the best of some repetitions.
fn synth(repetitions: usize) -> Result<f64, Failure> {
    let scene = scene("glass_ball", &SceneOptions::default())
        .context("the scene of the benchmark is missing")
        .or_exit(Exit::BadInput)?;
    let views: Vec<(u64, Camera)> = (0..).zip(cameras(scene.elevations, 4, 1, [100; 2])).collect();
    let traced =
        |(view, camera): &(u64, Camera)| render_view(&scene, camera, *view, &Sampling::default()).samples;
    let rate = |_| {
        let start = Instant::now();
        let samples: u64 = views.par_iter().map(traced).sum();
        samples as f64 / start.elapsed().as_secs_f64()
    };
    Ok((0..repetitions).map(rate).fold(0.0, f64::max))
}

impl Report {
    fn text(&self) -> String {
        let (s, m) = (&self.straight, &self.machine);
        let mut speed =
            Table::new(&["million samples per second", "one thread", &format!("{} threads", m.threads)]);
        let mut row = |name: &str, one: f64, all: Option<f64>| {
            speed.row(vec![
                name.to_owned(),
                format!("{one:.1}"),
                all.map_or(String::new(), |v| format!("{v:.1}")),
            ]);
        };
        let mut rows = |kind: &str, t: &Throughput| {
            row(
                &format!("{kind}: render, coherent rays"),
                t.forward_msamples_per_s_per_core,
                Some(t.forward_msamples_per_s),
            );
            row(&format!("{kind}: render, random rays"), t.forward_random_msamples_per_s_per_core, None);
            row(&format!("{kind}: train, coherent rays"), t.train_coherent_msamples_per_s_per_core, None);
            row(
                &format!("{kind}: train, random rays"),
                t.train_msamples_per_s_per_core,
                Some(t.train_msamples_per_s),
            );
        };
        rows("straight", s);
        rows("bent, sharp surface", &self.refractive.sharp);
        rows("bent, smooth transition", &self.refractive.smooth);
        rows("bent, mirroring sharp surface", &self.refractive.mirrored);
        let memory: Vec<String> =
            self.memory.iter().map(|m| format!("{} (degree {})", m.bytes_per_voxel, m.sh_degree)).collect();
        format!(
            "{}, SH degree 2, steps of one voxel, no empty space skipped; best of {}; {} on {}\n{}\n\
             training: {:.0} thousand rays per second, {:.2}× one thread\n\
             a training sample costs {:.2}× that of straight rays with a sharp surface, and {:.2}× with a smooth transition\n\
             a mirroring surface makes a training step {:.2}× as long\n\
             exact tracer, glass ball: {:.2} million camera rays per second\n\
             bytes per stored voxel with its moments: {}",
            m.grid,
            m.repetitions,
            m.simd,
            m.architecture,
            speed.text(),
            s.train_rays_per_s / 1e3,
            s.thread_speedup,
            self.refractive.cost_per_sample,
            self.refractive.smooth_cost_per_sample,
            self.refractive.mirrored_cost,
            self.synth.rays_per_s / 1e6,
            memory.join(", "),
        )
    }
}

//! `refraxel bench --device gpu`: how fast a GPU renders and trains, and how near its kernels come to what its memory can do.

use super::gpu::{Gpu, name};
use super::refusals::unusable;
use crate::cli::BenchArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use crate::table::Table;
use refraxel_core::ShDegree;
use refraxel_gpu::{Adapter, GpuBackend, GpuError, KernelTime};
use refraxel_train::bench::{
    BenchGrid, BenchOptions, DEGREE, DeviceBench, DeviceThroughput, FrameRate, Round, model, voxels,
};
use refraxel_train::model::Optimiser;
use serde::Serialize;

/// Edges of the pictures that are rendered [pixel].
const PICTURES: [u32; 2] = [800, 1600];

/// All measurements, each the best of several repetitions.
#[derive(Serialize)]
struct Report {
    straight: Measured,
    /// A ball of glass stands in the scene, whose shape and index learn.
    sharp: Measured,
    /// Read and written by a kernel that copies [GB/s].
    copy_gb_per_s: f64,
    grid: BenchGrid,
    /// Voxels that are stored.
    voxels: usize,
    device: Adapter,
    repetitions: usize,
}

#[derive(Serialize)]
struct Measured {
    #[serde(flatten)]
    throughput: DeviceThroughput,
    frames: Vec<FrameRate>,
    /// Share of the time of training in which kernels run; `None` where the adapter has no clock.
    busy: Option<f64>,
    /// What takes that time, the longest first.
    kernels: Vec<KernelShare>,
}

#[derive(Serialize)]
struct KernelShare {
    kernel: &'static str,
    /// Of the time in which kernels run.
    share: f64,
    /// Of one training step.
    milliseconds: f64,
    /// What the kernel reads and writes of the field, caches included [GB/s].
    gb_per_s: Option<f64>,
    /// The same over what copying reaches.
    of_copy: Option<f64>,
}

/// Measures straight rays and rays that bend.
pub fn bench(gpu: Gpu, args: &BenchArgs) -> Result<(), Failure> {
    let mut progress = Progress::new(Show::suited(args.work.quiet || args.work.json), "bench", 3);
    let options = BenchOptions { grid: args.grid, ..BenchOptions::suited_to(args.quick) };
    let report = report(&gpu, &options, &mut progress);
    // What a kernel could not finish has no time either.
    let found = report.and_then(|report| gpu.fault().map_or(Ok(report), Err));
    match found {
        Ok(report) => {
            progress.finish("");
            Console::new(args.work.json).result(&report.text(), &report).or_exit(Exit::Io)
        }
        Err(error) => {
            progress.abandon("");
            Err(unusable(error))
        }
    }
}

fn report(gpu: &Gpu, options: &BenchOptions, progress: &mut Progress) -> Result<Report, GpuError> {
    let voxels = voxels(options.grid);
    let degree = ShDegree::new(DEGREE).unwrap_or_default();
    GpuBackend::fits(gpu, degree, voxels, true)?; // before the host has made so large a model
    let copy = gpu.copy_rate()?;
    progress.set(1, "copying measured");
    let model = model(options.grid);
    let backend = GpuBackend::resumed(gpu.clone(), &model, &Optimiser::new(&model))?;
    drop(model);
    let mut bench = DeviceBench::new(backend, options);
    let straight = measured(&mut bench, options, copy)?;
    progress.set(2, "straight rays measured");
    bench.bend();
    let sharp = measured(&mut bench, options, copy)?;
    let (device, repetitions) = (gpu.adapter().clone(), options.repetitions);
    let (copy_gb_per_s, grid) = (copy / 1e9, options.grid);
    Ok(Report { straight, sharp, copy_gb_per_s, grid, voxels, device, repetitions })
}

fn measured(
    bench: &mut DeviceBench<GpuBackend>,
    options: &BenchOptions,
    copy: f64,
) -> Result<Measured, GpuError> {
    let throughput = bench.throughput();
    let sizes = if options.is_quick { &[][..] } else { &PICTURES };
    let frames = sizes.iter().map(|&size| bench.frames(size)).collect();
    let gpu = bench.backend().gpu().clone();
    let has_clock = gpu.start_clock();
    let round = bench.round();
    let times = gpu.stop_clock()?;
    let in_kernels: f64 = times.iter().map(|t| t.seconds).sum();
    let (batch, objective) = bench.training();
    let moved = bench.backend().moved(batch, objective)?;
    let share = |t: &KernelTime| share_of(t, bench.backend(), &round, (moved, in_kernels, copy));
    let mut kernels: Vec<KernelShare> = times.iter().map(share).collect();
    kernels.sort_by(|a, b| b.share.total_cmp(&a.share));
    bench.backend().gpu().fault().map_or(Ok(()), Err)?;
    Ok(Measured { throughput, frames, busy: has_clock.then(|| in_kernels / round.seconds), kernels })
}

/// What a kernel took of a round in which a step moves so many voxels, and all kernels take so many seconds.
fn share_of(
    time: &KernelTime,
    backend: &GpuBackend,
    round: &Round,
    (moved, in_kernels, copy): (u64, f64, f64),
) -> KernelShare {
    let bytes = backend.bytes_of(time.kernel, round.samples / round.steps, moved);
    // Paths are followed by several passes a step; a kernel that runs now and then has fewer.
    let times = round.steps.min(time.passes as u64);
    let rate = bytes.map(|bytes| (bytes * times) as f64 / time.seconds);
    KernelShare {
        kernel: time.kernel,
        share: time.seconds / in_kernels,
        milliseconds: 1e3 * time.seconds / round.steps as f64,
        gb_per_s: rate.map(|rate| rate / 1e9),
        of_copy: rate.map(|rate| rate / copy),
    }
}

impl Report {
    fn text(&self) -> String {
        let both = [&self.straight, &self.sharp];
        let mut speed = Table::new(&["million samples per second", "straight rays", "sharp surface"]);
        let mut row = |what: &str, of: fn(&DeviceThroughput) -> f64| {
            let cells = both.map(|m| format!("{:.1}", of(&m.throughput)));
            speed.row([vec![what.to_owned()], cells.to_vec()].concat());
        };
        row("render, coherent rays", |t| t.forward_msamples_per_s);
        row("render, random rays", |t| t.forward_random_msamples_per_s);
        row("train, coherent rays", |t| t.train_coherent_msamples_per_s);
        row("train, random rays", |t| t.train_msamples_per_s);
        let rays = both.map(|m| format!("{:.1}", m.throughput.train_rays_per_s / 1e3));
        format!(
            "{}, {} stored, SH degree {DEGREE}, steps of one voxel, no empty space skipped; best of {}; {}\n{}\n\
             training: {} thousand rays per second, where rays bend {}\n{}{}copying reads and writes {:.0} GB/s\n{}",
            self.grid,
            self.voxels,
            self.repetitions,
            name(&self.device),
            speed.text(),
            rays[0],
            rays[1],
            pictures("straight", &self.straight),
            pictures("bent", &self.sharp),
            self.copy_gb_per_s,
            self.kernels(),
        )
    }

    /// What takes the time of a training step.
    fn kernels(&self) -> String {
        if self.straight.busy.is_none() {
            return "kernels: the adapter has no clock".to_owned();
        }
        let mut table = Table::new(&["kernel", "rays", "ms per step", "share", "GB/s", "of copying"]);
        let text = |v: Option<f64>, decimals: usize| v.map_or(String::new(), |v| format!("{v:.decimals$}"));
        for (rays, measured) in [("straight", &self.straight), ("bent", &self.sharp)] {
            for k in &measured.kernels {
                table.row(vec![
                    k.kernel.to_owned(),
                    rays.to_owned(),
                    format!("{:.3}", k.milliseconds),
                    format!("{:.2}", k.share),
                    text(k.gb_per_s, 1),
                    text(k.of_copy, 2),
                ]);
            }
            table.row(vec!["all".to_owned(), rays.to_owned(), String::new(), text(measured.busy, 2)]);
        }
        format!("{}\n`all`: the share of the time of training in which kernels run", table.text())
    }
}

/// The rate of pictures, a line each.
fn pictures(rays: &str, measured: &Measured) -> String {
    let line = |f: &FrameRate| {
        format!(
            "pictures of {0} × {0}, {rays} rays: {1:.2} per second, {2:.1} thousand rays per second\n",
            f.size, f.frames_per_s, f.krays_per_s
        )
    };
    measured.frames.iter().map(line).collect()
}

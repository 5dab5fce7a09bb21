//! The jobs of a plan, carried out by all threads.

use super::photographs::Photographs;
use super::plan::Plan;
use super::renderings::Renderings;
use crate::synth::dataset::Cost;
use crate::synth::error::SynthError;
use crate::synth::output::files::create_folder;
use crate::synth::output::manifest::{Manifest, State, prepare};
use crate::synth::output::options::SynthOptions;
use rayon::prelude::*;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Pictures finished, including those found from an interrupted run.
    pub done: usize,
    /// Pictures in all (twins count).
    pub total: usize,
}

/// What a run has made.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The dataset's folder.
    pub out: PathBuf,
    /// Pictures rendered by this run.
    pub rendered: usize,
    /// Pictures kept from an interrupted run.
    pub kept: usize,
    /// What rendering has cost; no samples when everything was kept.
    pub cost: Cost,
    /// Mean share of a sample's energy that ended at the depth limit.
    pub lost_energy: f64,
}

/// How far the threads of a run are.
#[derive(Clone, Copy, Debug)]
struct Status {
    progress: Progress,
    is_stopped: bool,
}

/// Writes the dataset of a scene. `progress` is called after every finished picture and may stop the run.
///
/// Files appear under their final names only when they are whole. A second run with the same options keeps finished
/// pictures; with other options, it replaces a dataset that this program made and refuses any other. The same options
/// give the same bytes.
///
/// # Errors
/// Every variant of [`SynthError`], before anything is written where the options are at fault.
pub fn synthesize(
    options: &SynthOptions,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Summary, SynthError> {
    options.check()?;
    let run = || match options.photographic {
        None => carry_out(&Renderings::new(options)?, options, progress),
        Some(with) => carry_out(&Photographs::new(options, with)?, options, progress),
    };
    match options.threads {
        None => run(),
        Some(threads) => rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|source| SynthError::Threads { threads, source })?
            .install(run),
    }
}

fn carry_out<P: Plan>(
    plan: &P,
    options: &SynthOptions,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Summary, SynthError> {
    let out = &options.out;
    create_folder(out)?;
    let manifest = prepare(out, &plan.parameters())?;
    let jobs = plan.jobs();
    for folder in plan.folders() {
        create_folder(&out.join(folder))?;
    }
    let missing: Vec<P::Job> = jobs.iter().copied().filter(|j| !plan.picture(j).exists()).collect();
    let kept = jobs.len() - missing.len();
    let start = Instant::now();
    let mut cost = render(plan, &missing, Progress { done: kept, total: jobs.len() }, progress)?;
    cost.seconds = start.elapsed().as_secs_f64();
    if manifest.state != State::Complete || !missing.is_empty() {
        plan.write_truth()?;
        Manifest { state: State::Complete, ..manifest }.write(out)?;
    }
    let lost_energy = if cost.samples == 0 { 0.0 } else { cost.tally.lost / cost.samples as f64 };
    Ok(Summary { out: out.clone(), rendered: missing.len(), kept, cost, lost_energy })
}

fn render<P: Plan>(
    plan: &P,
    jobs: &[P::Job],
    start: Progress,
    progress: &(dyn Fn(Progress) -> ControlFlow<()> + Sync),
) -> Result<Cost, SynthError> {
    let status = Mutex::new(Status { progress: start, is_stopped: false });
    let lock = || status.lock().unwrap_or_else(|e| e.into_inner());
    let each = |job: &P::Job| {
        let Status { progress: before, is_stopped } = *lock();
        if is_stopped {
            return Err(SynthError::Stopped { done: before.done, total: before.total });
        }
        let cost = plan.render_one(job)?;
        let mut now = lock();
        now.progress.done += 1;
        now.is_stopped |= progress(now.progress).is_break();
        Ok(cost)
    };
    let costs: Vec<Cost> = jobs.par_iter().map(each).collect::<Result<_, SynthError>>()?;
    Ok(costs.into_iter().fold(Cost::default(), Cost::plus))
}

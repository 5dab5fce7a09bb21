//! `refraxel eval`: renders a split of a run and scores it.

use super::dataset::data_failure;
use super::evaluation::{Evaluated, Evaluation, LearnedShift, Rays, folder, folder_of_index};
use super::files::create_folder;
use super::interrupts::{cancel, watch_for_interrupts};
use super::loaded::{Loaded, load_run};
use super::reopen::reopen;
use super::sheet::{self, Row, Scored, chosen, png_path, save_image};
use super::threads::set_threads;
use crate::cli::EvalArgs;
use crate::console::Console;
use crate::device::ModelViewer;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use anyhow::{Context, anyhow};
use refraxel_core::Ray;
use refraxel_data::atomic::remove_leftovers;
use refraxel_data::{Backdrop, IndexSource, Part, View, load_photo};
use refraxel_train::backend::Layers;
use refraxel_train::device::DeviceChoice;
use refraxel_train::evaluation::{EvaluateError, Rendering, evaluate_by, truth};
use refraxel_train::events::Observer;
use refraxel_train::metrics::ImageScore;
use refraxel_train::run::check_path;
use refraxel_train::schedule::rendering_marching;
use refraxel_train::{Backend, refraction_search};
use std::path::Path;

/// Nodes along the longest edge of the grid on which an index file is sampled.
const NODES: u32 = 192;

/// The verb.
pub fn run(args: &EvalArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let (evaluation, out) = match &args.index_from {
        None => (evaluate(&args.run, args.split, args.renderer.device, show)?, folder(&args.run, args.split)),
        Some(file) => {
            let mut run = load_run(&args.run)?;
            take_index(&mut run, &args.run, file)?;
            let out = folder_of_index(&args.run, args.split);
            let mut evaluation = evaluate_in(run, args.split, args.renderer.device, &out, show)?;
            evaluation.run.index_from = Some(file.clone());
            evaluation.write(&out)?;
            (evaluation, out)
        }
    };
    print(&evaluation, &out, args.split, Console::new(args.work.json))
}

/// Bends the rays of a run by the index of a file.
fn take_index(run: &mut Loaded, folder: &Path, file: &Path) -> Result<(), Failure> {
    let refused = || format!("cannot bend the rays of {} by {}", folder.display(), file.display());
    check_path(file).or_exit(Exit::BadInput)?;
    let mut options = run.options.clone();
    if let Some(&index) = run.backend.medium().mean_indices().first() {
        options.search.guess = index as f32;
    }
    let bounds = options.refraction.stated_box();
    let source = IndexSource::read(file, bounds).with_context(refused).or_exit(Exit::BadInput)?;
    let (origin, scene) = (run.plan.origin, run.plan.finest.bounds.cast());
    source.check_scale(&origin.to_world(scene)).with_context(refused).or_exit(Exit::BadInput)?;
    let source = origin.to_local(source);
    let mirrors = run.backend.mirroring().regions;
    let mut known = refraction_search::known_refraction(&source, NODES, &options);
    let bodies = known.medium.regions().len();
    if mirrors == 1 && bodies > 1 {
        known = refraction_search::known_field(&source, NODES, &options);
    } else if mirrors > 0 && mirrors != bodies {
        let error = anyhow!(
            "the run has {mirrors} mirroring bodies, but the file describes {bodies}; each body needs its own \
             radiance caches"
        );
        return Err(error).with_context(refused).or_exit(Exit::BadInput);
    }
    // A file says nothing of colour.
    for (region, tint) in run.backend.medium().absorption().into_iter().enumerate() {
        if region < known.medium.regions().len() {
            known.medium.region_mut(region).set_absorption(tint);
        }
    }
    run.backend.set_medium(known);
    Ok(())
}

/// Renders and scores a split of a run on a device; writes the pictures and metrics.json.
pub fn evaluate(
    run_folder: &Path,
    split: Part,
    device: DeviceChoice,
    show: Show,
) -> Result<Evaluation, Failure> {
    let (run, out) = (load_run(run_folder)?, folder(run_folder, split));
    let evaluation = evaluate_in(run, split, device, &out, show)?;
    evaluation.write(&out)?;
    Ok(evaluation)
}

fn evaluate_in(
    mut run: Loaded,
    split: Part,
    device: DeviceChoice,
    out: &Path,
    show: Show,
) -> Result<Evaluation, Failure> {
    let data = reopen(&run)?;
    for folder in [Some(out), out.parent()].into_iter().flatten() {
        let _ = remove_leftovers(folder, |_| true); // failing to do so harms nobody
    }
    let count = split.views(&data).len();
    let marching = rendering_marching(&run.options, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let viewer = ModelViewer::open(device, &run.backend, &marching, show)?;
    let pixels = |rays: &[Ray<f32>]| viewer.render(&run.backend, rays, &marching, Layers::All);
    let mut progress = Progress::new(show, "rendering", count as u64);
    let mut drawn =
        Drawn { out, backdrop: data.backdrop, count, rows: Vec::new(), done: 0, progress: &mut progress };
    let mut each = |view: &View, rendering: &Rendering, score: &ImageScore| drawn.add(view, rendering, score);
    let cancel = cancel();
    let mut ignore = |_| {};
    let mut observer = Observer::new(&cancel, &mut ignore);
    let evaluated = evaluate_by(run.learned(&marching), &data, split, pixels, &mut observer, &mut each);
    let rows = drawn.rows;
    let found = match evaluated {
        Ok(found) => found,
        Err(failure) => {
            progress.abandon("");
            return Err(failure);
        }
    };
    sheet::draw(&rows, &["rendering".to_owned()], "", &out.with_extension("png"))?;
    progress.finish("");
    let evaluated = Evaluated {
        data: run.source.path.clone().unwrap_or_default(),
        truth_crc32: found.truth_crc32,
        step: run.state.step,
        seconds: run.state.seconds,
        device: run.state.device,
        rendered_by: Some(viewer.device()),
        voxels: run.backend.map().voxels() as u64,
        resolution: run.backend.domain().resolution,
        rays: Some(Rays::of(run.backend.medium())),
        index_from: None,
    };
    let how = || if split == Part::Train { LEARNED } else { FOUND }.to_owned();
    let poses = run.alignment.poses.as_ref();
    let poses = poses.map(|p| LearnedShift { shift: p.shift(), evaluated: how() });
    let exposures = run.alignment.exposures.as_ref();
    let exposures = exposures.map(|e| LearnedShift { shift: e.shift(), evaluated: how() });
    let (scores, ior, verdict) = (found.scores, found.index, run.state.verdict);
    Ok(Evaluation { scores, ior, verdict, poses, exposures, run: evaluated })
}

/// How cameras and exposures of evaluated views were found.
const LEARNED: &str = "have learned";
const FOUND: &str = "were found by half of their own pixels";

/// The pictures of an evaluation.
struct Drawn<'a> {
    out: &'a Path,
    backdrop: Backdrop,
    /// Views in all.
    count: usize,
    /// The views of the sheet.
    rows: Vec<Row>,
    done: usize,
    progress: &'a mut Progress,
}

impl Drawn<'_> {
    /// Saves the rendering of the next view.
    fn add(&mut self, view: &View, rendering: &Rendering, score: &ImageScore) -> Result<(), Failure> {
        create_folder(self.out)?;
        save_image(&png_path(self.out, &view.name), rendering)?;
        if chosen(self.count).any(|c| c == self.done) {
            let photo = load_photo(view).map_err(data_failure)?;
            self.rows.push(Row {
                name: view.name.clone(),
                size: [rendering.width as usize, rendering.height as usize],
                truth: Some(truth(&photo, self.backdrop)),
                renderings: vec![Scored { pixels: rendering.colour.clone(), psnr: score.psnr }],
            });
        }
        self.done += 1;
        self.progress.set(self.done as u64, &format!("{:.2} dB", score.psnr));
        Ok(())
    }
}

/// Failures of the library while it evaluates.
impl From<EvaluateError> for Failure {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Data(e) => data_failure(e),
            EvaluateError::Metrics(e) => e.into(),
            EvaluateError::NoViews { .. } => Self::new(Exit::BadInput, error),
            EvaluateError::Cancelled(_) => Exit::Interrupted
                .because("stopped before all images were rendered; run `refraxel eval` again to score them"),
        }
    }
}

/// Prints an evaluation and where its files are.
pub fn print(evaluation: &Evaluation, out: &Path, split: Part, console: Console) -> Result<(), Failure> {
    let text = format!(
        "{}\nprotocol: {}\npictures: {}, scores: {}",
        evaluation.text(split),
        evaluation.scores.protocol,
        out.with_extension("png").display(),
        out.join("metrics.json").display(),
    );
    console.result(&text, evaluation).or_exit(Exit::Io)
}

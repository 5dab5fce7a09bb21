//! `refraxel eval`: renders a split of a run and scores it.

use super::evaluation::{Evaluated, Evaluation, Rays, folder, folder_of_index};
use super::sheet::{self, Row, Scored, chosen, png_path, save_image};
use super::{create_folder, interrupted, load_photos, reopen, set_threads, watch_for_interrupts};
use crate::cli::{EvalArgs, SplitName};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use anyhow::{Context, anyhow};
use refraxel_data::Dataset;
use refraxel_data::synth::IndexTruth;
use refraxel_train::Backend;
use refraxel_train::Refraction;
use refraxel_train::evaluate::{render, score, truth, truth_checksum};
use refraxel_train::index_error::{IndexError, index_error};
use refraxel_train::metrics::{ImageScore, Scores};
use refraxel_train::recipe;
use refraxel_train::run::{Loaded, load_run};
use refraxel_train::schedule::rendering_marching;
use std::path::Path;

/// Nodes along the longest edge of the grid on which an index file is sampled.
const NODES: u32 = 192;

/// The verb.
pub fn run(args: &EvalArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let (evaluation, out) = match &args.index_from {
        None => (evaluate(&args.run, args.split, show)?, folder(&args.run, args.split)),
        Some(file) => {
            let mut run = load_run(&args.run)?;
            take_index(&mut run, &args.run, file)?;
            let out = folder_of_index(&args.run, args.split);
            let mut evaluation = evaluate_in(run, args.split, &out, show)?;
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
    let (own, mut options) = (run.backend.refraction(), run.options.clone());
    if let Some(&index) = own.mean_indices().first() {
        options.search.guess = index as f32;
    }
    let index = recipe::stated(file, NODES, &options).with_context(refused).or_exit(Exit::BadInput)?;
    let mirrors = run.backend.reflection().mirrors.len();
    if mirrors > 1 {
        let error =
            anyhow!("the run has {mirrors} separate mirroring bodies, but the file describes one region");
        return Err(error).with_context(refused).or_exit(Exit::BadInput);
    }
    run.backend.set_refraction(index);
    Ok(())
}

/// The views of a split.
pub fn split_views(data: &Dataset, split: SplitName) -> &[usize] {
    match split {
        SplitName::Train => &data.split.train,
        SplitName::Val => &data.split.val,
        SplitName::Test => &data.split.test,
    }
}

/// Renders and scores a split of a run; writes the pictures and metrics.json.
pub fn evaluate(run_folder: &Path, split: SplitName, show: Show) -> Result<Evaluation, Failure> {
    let (run, out) = (load_run(run_folder)?, folder(run_folder, split));
    let evaluation = evaluate_in(run, split, &out, show)?;
    evaluation.write(&out)?;
    Ok(evaluation)
}

fn evaluate_in(mut run: Loaded, split: SplitName, out: &Path, show: Show) -> Result<Evaluation, Failure> {
    let data = reopen(&run)?;
    let indices = split_views(&data, split).to_vec();
    if indices.is_empty() {
        let (data, split) = (run.source.path.display(), split.name());
        let advice = "hold some out with --holdout, or evaluate --split train";
        let error = anyhow!("{data} has no {split} images to evaluate; {advice}");
        return Err(Failure::new(Exit::BadInput, error));
    }
    let (scores, truth_crc32) = render_and_score(&mut run, &data, &indices, out, show)?;
    let field = run.backend.field();
    let evaluated = Evaluated {
        data: run.source.path.clone(),
        truth_crc32,
        step: run.state.step,
        seconds: run.state.seconds,
        voxels: field.map.voxels() as u64,
        resolution: field.domain.resolution,
        rays: Some(Rays::of(run.backend.refraction())),
        index_from: None,
    };
    Ok(Evaluation { scores, ior: index_errors(&data, run.backend.refraction()), run: evaluated })
}

/// Prints an evaluation and where its files are.
pub fn print(evaluation: &Evaluation, out: &Path, split: SplitName, console: Console) -> Result<(), Failure> {
    let text = format!(
        "{}\nprotocol: {}\npictures: {}, scores: {}",
        evaluation.text(split),
        evaluation.scores.protocol,
        out.with_extension("png").display(),
        out.join("metrics.json").display(),
    );
    console.result(&text, evaluation).or_exit(Exit::Io)
}

/// Errors of the index where the truth is known. Straight rays mean an index of 1 everywhere.
fn index_errors(data: &Dataset, refraction: &Refraction) -> Option<IndexError> {
    let truth = IndexTruth::from_scene_json(data.truth.as_ref()?)?;
    Some(index_error(&truth, |x| refraction.index(x.cast()).into()))
}

/// The scores, and the checksum of the truths.
fn render_and_score(
    run: &mut Loaded,
    data: &Dataset,
    indices: &[usize],
    out: &Path,
    show: Show,
) -> Result<(Scores, String), Failure> {
    let marching = rendering_marching(&run.options, run.plan.near);
    run.backend.refresh_occupancy(&marching);
    let photos = load_photos(data, indices, show)?;
    create_folder(out)?;
    let truths: Vec<_> = photos.iter().map(|photo| truth(photo, run.plan.backdrop)).collect();
    let mut progress = Progress::new(show, "rendering", indices.len() as u64);
    let (mut scores, mut rows): (Vec<ImageScore>, Vec<Row>) = Default::default();
    for (k, (&i, photo)) in indices.iter().zip(&photos).enumerate() {
        if interrupted() {
            progress.abandon("");
            let error =
                anyhow!("stopped before all images were rendered; run `refraxel eval` again to score them");
            return Err(Failure::new(Exit::Interrupted, error));
        }
        let view = &data.views[i];
        let rendering = render(&run.backend, &view.camera, &marching);
        let score = score(&rendering, view, photo, run.plan.backdrop)?;
        save_image(&png_path(out, &view.name), &rendering)?;
        progress.set(k as u64 + 1, &format!("{:.2} dB", score.psnr));
        if chosen(indices.len()).any(|c| c == k) {
            rows.push(Row {
                name: view.name.clone(),
                size: [rendering.width as usize, rendering.height as usize],
                truth: Some(truths[k].clone()),
                renderings: vec![Scored { pixels: rendering.colour, psnr: score.psnr }],
            });
        }
        scores.push(score);
    }
    sheet::draw(&rows, &["rendering".to_owned()], "", &out.with_extension("png"))?;
    progress.finish("");
    Ok((Scores::new(scores), truth_checksum(truths.iter().map(Vec::as_slice))))
}

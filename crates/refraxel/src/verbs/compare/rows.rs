//! The images that are shown of each run, beside the truth where that is asked for.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::dataset::data_failure;
use crate::verbs::evaluation::{Evaluation, folder};
use crate::verbs::loaded::load_run;
use crate::verbs::reopen::reopen;
use crate::verbs::sheet::{ROWS, Row, Scored, chosen, png_path};
use anyhow::{Context, anyhow};
use refraxel_data::photographs::stored_pixels;
use refraxel_data::{Part, load_photo};
use refraxel_train::evaluation::truth;
use std::path::{Path, PathBuf};

/// The pictures of a few images, with the truth where it is asked for.
pub fn rows(runs: &[PathBuf], evaluations: &[Evaluation], with_truth: bool) -> Result<Vec<Row>, Failure> {
    let images = &evaluations[0].scores.per_image;
    let shown = shown(evaluations);
    let mut truths =
        if with_truth { truth_images(&runs[0], images.len(), &shown)? } else { Vec::new() }.into_iter();
    let mut rows = Vec::new();
    for k in shown {
        let (size, renderings) = renderings(runs, evaluations, k)?;
        let truth = truths.next();
        if truth.as_ref().is_some_and(|t| t.len() != size[0] * size[1]) {
            return Err(again(&runs[0], anyhow!("{} is not of the size of its truth", images[k].name)));
        }
        rows.push(Row { name: images[k].name.clone(), size, truth, renderings });
    }
    Ok(rows)
}

/// The pictures that all runs have rendered of one image, and their size.
pub(super) fn renderings(
    runs: &[PathBuf],
    evaluations: &[Evaluation],
    image: usize,
) -> Result<([usize; 2], Vec<Scored>), Failure> {
    let mut size = [0; 2];
    let mut renderings = Vec::new();
    for (run, evaluation) in runs.iter().zip(evaluations) {
        let score = &evaluation.scores.per_image[image];
        let (pixels, found) = read_rendering(&png_path(&folder(run, Part::Test), &score.name), run)?;
        if size != [0; 2] && size != found {
            return Err(again(run, anyhow!("the rendering of {} has another size", score.name)));
        }
        size = found;
        renderings.push(Scored { pixels, psnr: score.psnr });
    }
    Ok((size, renderings))
}

/// The images that are shown: the most telling one, then others, evenly spread.
fn shown(evaluations: &[Evaluation]) -> Vec<usize> {
    let count = evaluations[0].scores.per_image.len();
    let first = telling(evaluations);
    let others = chosen(count).filter(|&k| Some(k) != first);
    first.into_iter().chain(others).take(ROWS).collect()
}

/// The image whose squared errors differ most between runs, inside the masks where there are any; `None` for one run.
pub(super) fn telling(evaluations: &[Evaluation]) -> Option<usize> {
    let count = evaluations[0].scores.per_image.len();
    let spread = |k: usize| {
        let scores = evaluations.iter().map(|e| &e.scores.per_image[k]);
        let errors = scores.map(|s| 10f64.powf(-0.1 * s.psnr_inside.unwrap_or(s.psnr)));
        let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    (0..count).filter(|&k| spread(k) > 0.0).max_by(|&a, &b| spread(a).total_cmp(&spread(b)))
}

/// The photographs of the test split that are shown, of a run that was evaluated on so many.
fn truth_images(run: &Path, count: usize, shown: &[usize]) -> Result<Vec<Vec<[u8; 3]>>, Failure> {
    let loaded = load_run(run)?;
    let data = reopen(&loaded)?;
    if data.split.test.len() != count {
        let found = data.split.test.len();
        return Err(again(run, anyhow!("its dataset has {found} test images now, not {count}")));
    }
    let load = |k: usize| {
        let photo = load_photo(&data.views[data.split.test[k]]).map_err(data_failure)?;
        Ok(truth(&photo, loaded.plan.backdrop))
    };
    shown.iter().copied().map(load).collect()
}

fn read_rendering(path: &Path, run: &Path) -> Result<(Vec<[u8; 3]>, [usize; 2]), Failure> {
    let image = stored_pixels(path)
        .with_context(|| {
            format!("cannot read {}; run `refraxel eval {}` again", path.display(), run.display())
        })
        .or_exit(Exit::BadInput)?
        .into_rgb8();
    let size = [image.width() as usize, image.height() as usize];
    Ok((image.into_raw().as_chunks().0.to_vec(), size))
}

fn again(run: &Path, error: anyhow::Error) -> Failure {
    let advice = format!(
        "the pictures of {run} do not fit its scores; run `refraxel eval {run}` again",
        run = run.display()
    );
    Failure::new(Exit::BadInput, error.context(advice))
}

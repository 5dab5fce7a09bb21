//! `refraxel compare`: shows evaluated runs in a table and side by side.

mod wipe;

use super::evaluation::{Evaluation, Rays, folder};
use super::loaded::load_run;
use super::sheet::{self, ROWS, Row, Scored, chosen, png_path};
use super::{create_folder, data_failure, reopen};
use crate::cli::{CompareArgs, SplitName};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::table::{Table, count, score};
use anyhow::{Context, anyhow};
use refraxel_data::load_photo;
use refraxel_train::evaluation::IndexError;
use refraxel_train::evaluation::truth;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// One run of the comparison.
#[derive(Serialize)]
struct Compared {
    run: PathBuf,
    rays: Option<Rays>,
    psnr: Option<f64>,
    ssim: Option<f64>,
    psnr_inside: Option<f64>,
    psnr_outside: Option<f64>,
    minutes: f64,
    voxels: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    ior: Option<IndexError>,
}

#[derive(Serialize)]
struct Report {
    images: usize,
    protocol: String,
    runs: Vec<Compared>,
    #[serde(skip_serializing_if = "Option::is_none")]
    picture: Option<PathBuf>,
    /// The animated picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    wipe: Option<PathBuf>,
}

/// The verb.
pub fn run(args: &CompareArgs) -> Result<(), Failure> {
    args.wipe.as_ref().map_or(Ok(()), |out| wipe::check(out, args.runs.len()))?;
    let evaluations: Vec<Evaluation> =
        args.runs.iter().map(|run| Evaluation::of_test(run)).collect::<Result<_, _>>()?;
    check_same_images(&args.runs, &evaluations)?;
    let picture = match &args.out {
        Some(out) => {
            let rows = rows(&args.runs, &evaluations, args.truth)?;
            create_folder(out)?;
            let path = out.join("comparison.png");
            sheet::draw(&rows, &captions(&args.runs, &evaluations), "", &path)?;
            Some(path)
        }
        None => None,
    };
    if let Some(out) = &args.wipe {
        write_wipe(args, &evaluations, out)?;
    }
    let compared = args.runs.iter().zip(&evaluations).map(|(run, e)| Compared {
        run: run.clone(),
        rays: e.run.rays,
        psnr: e.scores.psnr,
        ssim: e.scores.ssim,
        psnr_inside: e.scores.psnr_inside,
        psnr_outside: e.scores.psnr_outside,
        minutes: e.run.seconds / 60.0,
        voxels: e.run.voxels,
        ior: e.ior,
    });
    let first = &evaluations[0].scores; // at least one run is required
    let (images, protocol) = (first.images, first.protocol.clone());
    let report = Report { images, protocol, runs: compared.collect(), picture, wipe: args.wipe.clone() };
    Console::new(args.json).result(&report.text(), &report).or_exit(Exit::Io)
}

/// Caption of each run's column: the shape of its rays, and its name where two runs have the same.
fn captions(runs: &[PathBuf], evaluations: &[Evaluation]) -> Vec<String> {
    let rays: Vec<Option<Rays>> = evaluations.iter().map(|e| e.run.rays).collect();
    let caption = |(run, &kind): (&PathBuf, &Option<Rays>)| {
        let name = run.file_name().map_or(run.display().to_string(), |n| n.to_string_lossy().into_owned());
        let alike = rays.iter().filter(|&&r| r == kind).count();
        match kind {
            Some(kind) if alike == 1 && runs.len() > 1 => format!("{} rays", kind.name()),
            Some(kind) => format!("{}: {name}", kind.name()),
            None => name,
        }
    };
    runs.iter().zip(&rays).map(caption).collect()
}

/// Refuses runs that were scored on different images or by different protocols.
fn check_same_images(runs: &[PathBuf], evaluations: &[Evaluation]) -> Result<(), Failure> {
    let first = &evaluations[0];
    for (run, e) in runs.iter().zip(evaluations) {
        if e.run.truth_crc32 != first.run.truth_crc32 || e.scores.images != first.scores.images {
            let error = anyhow!(
                "{} was evaluated on {} images of {}, but {} on {} images of {}, and they are not the same; evaluate both \
                 on one dataset and split",
                run.display(),
                e.scores.images,
                e.run.data.display(),
                runs[0].display(),
                first.scores.images,
                first.run.data.display(),
            );
            return Err(Failure::new(Exit::BadInput, error));
        }
        if e.scores.protocol != first.scores.protocol {
            let (run, other) = (run.display(), runs[0].display());
            let error = anyhow!("{run} and {other} were scored by different protocols; evaluate both again");
            return Err(Failure::new(Exit::BadInput, error));
        }
    }
    Ok(())
}

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
fn renderings(
    runs: &[PathBuf],
    evaluations: &[Evaluation],
    image: usize,
) -> Result<([usize; 2], Vec<Scored>), Failure> {
    let mut size = [0; 2];
    let mut renderings = Vec::new();
    for (run, evaluation) in runs.iter().zip(evaluations) {
        let score = &evaluation.scores.per_image[image];
        let (pixels, found) = read_rendering(&png_path(&folder(run, SplitName::Test), &score.name), run)?;
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
fn telling(evaluations: &[Evaluation]) -> Option<usize> {
    let count = evaluations[0].scores.per_image.len();
    let spread = |k: usize| {
        let scores = evaluations.iter().map(|e| &e.scores.per_image[k]);
        let errors = scores.map(|s| 10f64.powf(-0.1 * s.psnr_inside.unwrap_or(s.psnr)));
        let (low, high) = errors.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        high - low
    };
    (0..count).filter(|&k| spread(k) > 0.0).max_by(|&a, &b| spread(a).total_cmp(&spread(b)))
}

/// Writes the animated picture of two runs.
fn write_wipe(args: &CompareArgs, evaluations: &[Evaluation], out: &Path) -> Result<(), Failure> {
    let images = &evaluations[0].scores.per_image;
    let image = match &args.view {
        None => telling(evaluations).unwrap_or(0),
        Some(name) => images.iter().position(|i| i.name == *name).ok_or_else(|| {
            let names: Vec<&str> = images.iter().map(|i| i.name.as_str()).collect();
            let error =
                anyhow!("--view {name}: there is no such image; expected one of {}", names.join(", "));
            Failure::new(Exit::BadInput, error)
        })?,
    };
    let (size, renderings) = renderings(&args.runs, evaluations, image)?;
    let captions = captions(&args.runs, evaluations);
    let side = |k: usize| {
        let score = &evaluations[k].scores.per_image[image];
        let psnr = score.psnr_inside.unwrap_or(score.psnr);
        wipe::Side { caption: format!("{} {psnr:.1} dB", captions[k]), pixels: &renderings[k].pixels }
    };
    wipe::write(&[side(0), side(1)], size, out)
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
    let image = image::open(path)
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

impl Report {
    fn text(&self) -> String {
        let with_index = self.runs.iter().any(|r| r.ior.is_some());
        let mut headings = vec!["run", "rays", "PSNR", "SSIM", "inside", "outside", "minutes", "voxels"];
        if with_index {
            headings.extend(["index inside", "true index", "index error inside"]);
        }
        let mut table = Table::new(&headings);
        for r in &self.runs {
            let mut cells = vec![
                r.run.display().to_string(),
                r.rays.map_or("–", Rays::name).to_owned(),
                score(r.psnr, 2),
                score(r.ssim, 4),
                score(r.psnr_inside, 2),
                score(r.psnr_outside, 2),
                format!("{:.1}", r.minutes),
                count(r.voxels),
            ];
            if with_index {
                let index = r.ior.unwrap_or_default();
                let of_index = [index.mean_inside, index.true_mean_inside, index.mae_inside];
                cells.extend(of_index.map(|n| score(n, 3)));
            }
            table.row(cells);
        }
        let picture = self.picture.as_ref().map_or(String::new(), |p| format!("\npicture: {}", p.display()));
        let wipe = self.wipe.as_ref().map_or(String::new(), |p| format!("\nwipe: {}", p.display()));
        format!("{}\n{} test images; protocol: {}{picture}{wipe}", table.text(), self.images, self.protocol)
    }
}

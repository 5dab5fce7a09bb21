//! The walk of a comparison: scores, then pictures, then the table.

use super::report::{Compared, Report};
use super::rows::{renderings, rows, telling};
use super::wipe;
use crate::cli::CompareArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::evaluation::{Evaluation, Rays};
use crate::verbs::files::create_folder;
use crate::verbs::sheet;
use std::path::{Path, PathBuf};

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
            return Err(Exit::BadInput.because(format!(
                "{} was evaluated on {} images of {}, but {} on {} images of {}, and they are not the same; evaluate both \
                 on one dataset and split",
                run.display(),
                e.scores.images,
                e.run.data.display(),
                runs[0].display(),
                first.scores.images,
                first.run.data.display(),
            )));
        }
        if e.scores.protocol != first.scores.protocol {
            let (run, other) = (run.display(), runs[0].display());
            return Err(Exit::BadInput.because(format!(
                "{run} and {other} were scored by different protocols; evaluate both again"
            )));
        }
    }
    Ok(())
}

/// Writes the animated picture of two runs.
fn write_wipe(args: &CompareArgs, evaluations: &[Evaluation], out: &Path) -> Result<(), Failure> {
    let images = &evaluations[0].scores.per_image;
    let image = match &args.view {
        None => telling(evaluations).unwrap_or(0),
        Some(name) => images.iter().position(|i| i.name == *name).ok_or_else(|| {
            let names: Vec<&str> = images.iter().map(|i| i.name.as_str()).collect();
            Exit::BadInput.because(format!(
                "--view {name}: there is no such image; expected one of {}",
                names.join(", ")
            ))
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

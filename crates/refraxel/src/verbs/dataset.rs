//! How a dataset is opened as the command line says, what a run stores of that, and what is said where it fails.

use crate::cli::ReadingArgs;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Show, counter};
use crate::shell::quoted_path;
use anyhow::Context;
use refraxel_core::Vec3;
use refraxel_data::{DataError, Dataset, OpenOptions, Photo, Problem, Reduction, Severity};
use std::io::{self, Write};
use std::path::Path;

/// The options for reading a dataset from the command line.
pub fn open_options(reading: &ReadingArgs) -> OpenOptions {
    OpenOptions {
        holdout: reading.holdout.map(|n| n as usize),
        allow_outside: reading.allow_outside,
        backdrop: reading.backdrop,
        alpha: reading.alpha,
        mask_meaning: reading.mask_meaning,
        orientation: reading.orientation,
        crop: reading.crop.unwrap_or_default(),
        up: reading.up.map(Vec3::from),
        origin: None,
    }
}

/// Reads all photographs of the dataset at `path` with fewer pixels, where a run asks for it as a number.
pub fn reduce(data: &mut Dataset, downscale: Option<u32>, path: &Path, show: Show) -> Result<(), Failure> {
    let Some(number) = downscale else { return Ok(()) };
    let context = || format!("the photographs of {} cannot be reduced by {number}", path.display());
    let reduction = Reduction::try_from(number).with_context(context).or_exit(Exit::BadInput)?;
    let size = |data: &Dataset| data.views.first().map(|v| format!("{}x{}", v.camera.width, v.camera.height));
    let before = size(data);
    let all: Vec<usize> = (0..data.views.len()).collect();
    let count = data.reduce(&all, reduction);
    if count == 0 {
        return Ok(());
    }
    let first =
        before.zip(size(data)).map(|(from, to)| format!("; the first has {to} pixels instead of {from}"));
    show.say(&format!(
        "note: {count} of {} photographs are reduced{}, and scored so",
        all.len(),
        first.unwrap_or_default()
    ));
    Ok(())
}

/// The same, and where nothing is asked for, photographs that are too large are reduced, which the dataset's findings say. Returns what a run
/// has to store.
pub fn reduce_or_fit(
    data: &mut Dataset,
    downscale: Option<u32>,
    path: &Path,
    show: Show,
) -> Result<Option<u32>, Failure> {
    if downscale.is_some() {
        return reduce(data, downscale, path, show).map(|()| downscale);
    }
    Ok(data.fit().map(u32::from))
}

/// Says what was decided about a dataset and what is doubtful in it, before any work; warnings even where no progress is shown.
pub fn say_findings(data: &Dataset, show: Show) {
    for Problem { severity, message } in &data.problems {
        let text = format!("{}: {message}", severity.name());
        match severity {
            Severity::Note => show.say(&text),
            Severity::Warning => drop(writeln!(io::stderr(), "{text}")), // what nobody can read is no reason to stop
        }
    }
}

/// The failure of a dataset: [`Exit::Io`] for files that cannot be read, [`Exit::BadInput`] for everything else.
///
/// Where poses are missing, the message says which command computes them.
pub fn data_failure(error: DataError) -> Failure {
    if let DataError::NoPoses { path, .. } | DataError::Video { path } = &error {
        let source = quoted_path(path);
        let commands =
            format!("  refraxel import {source} --out scene\n  refraxel train scene --out run --minutes 10");
        return Exit::BadInput.because(format!("{error}:\n{commands}"));
    }
    let exit = match &error {
        DataError::Read { source, .. } if source.kind() != io::ErrorKind::NotFound => Exit::Io,
        _ => Exit::BadInput,
    };
    Failure::new(exit, error)
}

/// Decodes photographs with a progress bar.
pub fn load_photos(data: &Dataset, indices: &[usize], show: Show) -> Result<Vec<Photo>, Failure> {
    let loaded = counter(show, "images", indices.len());
    data.load_photos(indices, |_| loaded()).map_err(data_failure)
}

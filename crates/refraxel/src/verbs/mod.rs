//! What each verb of the command line does.

pub mod bench;
pub mod compare;
pub mod demo;
pub mod eval;
pub mod evaluation;
pub mod export;
pub mod import;
pub mod inspect;
pub mod interrupts;
pub mod known_index;
pub mod loaded;
pub mod mask;
pub mod options;
pub mod render;
pub mod sheet;
pub mod sweep;
pub mod synth;
pub mod train;
pub mod view;

use crate::cli::{ReadingArgs, WorkArgs};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Progress, Show};
use crate::shell::quoted_path;
use anyhow::{Context, anyhow};
use loaded::Loaded;
use refraxel_core::Vec3;
use refraxel_data::limits::{JSON_BYTES, open_regular};
use refraxel_data::{DataError, Dataset, MaskMeaning, OpenOptions, Photo, Reduction};
use refraxel_train::run::Source;
use refraxel_train::session::SessionError;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
pub use train::session_failure;

/// Starts as many threads as asked for.
pub fn set_threads(work: &WorkArgs) -> Result<(), Failure> {
    set_thread_count(work.threads)
}

/// Starts so many threads, or one per core.
pub fn set_thread_count(threads: Option<u16>) -> Result<(), Failure> {
    let threads = threads.map_or(0, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .context("cannot start the threads; try a smaller --threads")
        .or_exit(Exit::Io)
}

/// The options for reading a dataset from the command line.
pub fn open_options(reading: &ReadingArgs) -> OpenOptions {
    OpenOptions {
        holdout: reading.holdout.map(|n| n as usize),
        allow_outside: reading.allow_outside,
        backdrop: None,
        mask_meaning: reading.mask_meaning.map(MaskMeaning::from),
        crop: reading.crop.unwrap_or_default(),
        up: reading.up.map(Vec3::from),
    }
}

/// The description of a dataset that a run stores, so that the dataset can be read again in the same way.
pub fn source_of(path: &Path, options: &OpenOptions, data: &Dataset) -> Source {
    Source {
        path: Some(absolute(path)),
        holdout: options.holdout,
        mask_meaning: options.mask_meaning.map(|m| meaning_name(m).to_owned()),
        allow_outside: options.allow_outside,
        crop: Some(options.crop).filter(|crop| !crop.is_none()),
        up: options.up.map(Vec3::to_array),
        ..Source::of(data)
    }
}

/// A path from the root, so that it holds in any folder.
pub fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
}

/// The name of a mask's meaning on the command line.
pub fn meaning_name(meaning: MaskMeaning) -> &'static str {
    match meaning {
        MaskMeaning::Refractive => "refractive",
        MaskMeaning::Keep => "keep",
        MaskMeaning::Ignore => "ignore",
    }
}

/// Opens the dataset of a run again, with the options of the training.
///
/// Where poses have learned, refuses data with other training views: which pose is whose would be unknown, and what was learned
/// is the way from where the cameras were.
pub fn reopen(run: &Loaded) -> Result<Dataset, Failure> {
    let data = reopen_source(&run.source)?;
    let names = data.split.train.iter().map(|&i| &data.views[i].name);
    if run.alignment.poses.is_some() && !names.eq(&run.source.train) {
        let was = run.source.train.len();
        let error = anyhow!(
            "{} has {} training photographs now, and the run has learned the poses of {was} of other names; bring them back",
            run.source.path.as_deref().unwrap_or(Path::new("the dataset")).display(),
            data.split.train.len(),
        );
        return Err(Failure::new(Exit::BadInput, error));
    }
    if run.alignment.poses.is_some() && run.source.has_other_views_than(&data) {
        return Err(Failure::new(Exit::BadInput, SessionError::OtherPhotographs));
    }
    Ok(data)
}

/// Opens the dataset that a run was trained on, with the options of the training.
pub fn reopen_source(source: &Source) -> Result<Dataset, Failure> {
    let mask_meaning = match source.mask_meaning.as_deref() {
        Some("refractive") => Some(MaskMeaning::Refractive),
        Some("keep") => Some(MaskMeaning::Keep),
        Some("ignore") => Some(MaskMeaning::Ignore),
        _ => None,
    };
    let options = OpenOptions {
        holdout: source.holdout,
        allow_outside: source.allow_outside,
        backdrop: None,
        mask_meaning,
        crop: source.crop.unwrap_or_default(),
        up: source.up.map(Vec3::from),
    };
    let nowhere = "the run was trained on data in memory, which no file holds; evaluate it in the program that trained it";
    let path = source.path.as_ref().context(nowhere).or_exit(Exit::BadInput)?;
    let mut data = Dataset::open(path, &options).map_err(data_failure)?;
    reduce(&mut data, source.downscale, path, Show::Nothing)?;
    Ok(data)
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
    let first =
        before.zip(size(data)).map(|(from, to)| format!("; the first has {to} pixels instead of {from}"));
    show.say(&format!(
        "note: {count} of {} photographs are reduced{}, and scored so",
        all.len(),
        first.unwrap_or_default()
    ));
    Ok(())
}

/// The failure of a dataset: [`Exit::Io`] for files that cannot be read, [`Exit::BadInput`] for everything else.
///
/// Where poses are missing, the message says which command computes them.
pub fn data_failure(error: DataError) -> Failure {
    if let DataError::NoPoses { path, .. } | DataError::Video { path } = &error {
        let source = quoted_path(path);
        let commands =
            format!("  refraxel import {source} --out scene\n  refraxel train scene --out run --minutes 10");
        return Failure::new(Exit::BadInput, anyhow!("{error}:\n{commands}"));
    }
    let exit = match &error {
        DataError::Read { source, .. } if source.kind() != io::ErrorKind::NotFound => Exit::Io,
        _ => Exit::BadInput,
    };
    Failure::new(exit, error)
}

/// Decodes photographs with a progress bar.
pub fn load_photos(data: &Dataset, indices: &[usize], show: Show) -> Result<Vec<Photo>, Failure> {
    let progress = Mutex::new((Progress::new(show, "images", indices.len() as u64), 0));
    let photos = data.load_photos(indices, |_| {
        if let Ok(mut shown) = progress.lock() {
            let (progress, loaded) = &mut *shown;
            *loaded += 1;
            progress.set(*loaded, "");
        }
    });
    photos.map_err(data_failure)
}

/// Reads a small text file: a [regular](open_regular) one, whose size is bounded as that of JSON of a dataset is. Bytes that are not
/// UTF-8 become U+FFFD and then fail where they are parsed.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    open_regular(path)?.take(JSON_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > JSON_BYTES {
        let what = format!("it is larger than {} MiB", JSON_BYTES >> 20);
        return Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Creates a folder and its parents.
pub fn create_folder(path: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(path)
        .with_context(|| format!("cannot create the folder {}", path.display()))
        .or_exit(Exit::Io)
}

//! The walk of a search for masks: the data and what is pointed at, the search, then the files.

use super::earlier::{forget, refuse_complete, refuse_other_masks};
use super::finding::{found, options};
use super::paths::{folder, targets};
use super::pointed::Pointed;
use super::writing::{Written, write};
use crate::cli::MaskArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::dataset::{data_failure, open_options};
use crate::verbs::files::absolute;
use crate::verbs::interrupts::{cancel, watch_for_interrupts};
use crate::verbs::threads::set_threads;
use refraxel_data::{Dataset, MaskMeaning, OpenOptions, Photo, PhotoSource, load_photo};
use refraxel_train::run::Source;
use refraxel_train::session::Setup;
use serde::Serialize;
use std::path::PathBuf;
use std::sync::Arc;

/// What was made.
#[derive(Serialize)]
struct Made {
    /// Folder of the masks.
    masks: PathBuf,
    /// Masks written.
    written: usize,
    /// Masks that were there before, and are as they were.
    kept: usize,
    /// Share of the pixels of all photographs that all of them cover.
    covered: f64,
    /// How well straight rays separate what was found from everything else, 0 to 1.
    separation: f64,
    /// A picture of some of them.
    picture: PathBuf,
}

/// The verb.
pub fn run(args: &MaskArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    let reading = open_options(&args.reading);
    if !reading.crop.is_none() {
        return Err(Exit::Usage
            .because("masks are made of whole photographs; leave --crop out here, and give it to `train`"));
    }
    let mut data = Dataset::open(&args.data, &reading).map_err(data_failure)?;
    let out = folder(args, &data)?;
    refuse_other_masks(&data)?;
    if args.overwrite {
        forget(&mut data, &out);
    }
    refuse_complete(&data)?;
    let options = options(args, &data)?;
    let pointed = Pointed::new(args, &data)?;
    let targets = targets(&data, &out)?;
    for (view, mask) in &pointed.outlines {
        let photo = load_photo(&data.views[*view]).map_err(data_failure)?;
        let of = &mut data.views[*view];
        of.source = PhotoSource::Memory(Photo { mask: Some(Arc::clone(mask)), ..photo });
        of.mask_meaning = MaskMeaning::Refractive;
    }
    let source = Source::of_files(absolute(&args.data), &reading, &data);
    let data_kept = data.clone();
    let setup = Setup { data, options, index: None, source, cancel: cancel() };
    let (gate, separation) = found(&setup, &pointed.hints, show)?;
    let Written { written, kept, covered, picture } = write(&data_kept, &targets, &gate, &out, show)?;
    let text = format!(
        "{written} masks written in {}, {kept} kept; they cover {:.1} % of all pixels (separation {separation:.2})\nlook at {}: \
         correct or delete wrong masks (the same command makes missing ones anew), then {}",
        out.display(),
        100.0 * covered,
        picture.display(),
        what_next(args, &reading),
    );
    let made = Made { masks: out, written, kept, covered, separation, picture };
    Console::new(args.work.json).result(&text, &made).or_exit(Exit::Io)
}

/// What people do with masks.
fn what_next(args: &MaskArgs, reading: &OpenOptions) -> String {
    let data = args.data.display();
    let is_masked = |data: &Dataset| data.split.train.iter().all(|&v| data.views[v].has_mask());
    match Dataset::open(&args.data, reading) {
        Ok(again) if is_masked(&again) => format!("train: refraxel train {data} --out RUN"),
        _ => format!(
            "put them where {data} is read with masks: in its folder glass_masks, or under the key it names them by"
        ),
    }
}

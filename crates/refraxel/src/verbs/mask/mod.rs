//! `refraxel mask`: masks of what is refractive, found by what straight rays cannot explain and by what somebody points at.

mod pointed;

use super::interrupts::{cancel, interrupted, watch_for_interrupts};
use super::sheet::{chosen, save_png};
use super::{absolute, create_folder, data_failure, load_photos, open_options, set_threads, source_of};
use crate::cli::MaskArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::train::{ProgressDisplay, session_failure};
use anyhow::anyhow;
use pointed::Pointed;
use refraxel_data::{
    Dataset, Mask, MaskMeaning, OpenOptions, Photo, PhotoSource, View, load_mask_of, load_photo, scene_region,
};
use refraxel_train::detection::{self, Found, Hints};
use refraxel_train::evaluation::truth;
use refraxel_train::events::{Event, Task};
use refraxel_train::metrics::Rgb8;
use refraxel_train::model::Gate;
use refraxel_train::options::Switch;
use refraxel_train::session::Setup;
use refraxel_train::{Options, refraction_search};
use serde::Serialize;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

/// Masks of large photographs are projected in squares of so many pixels, so that a view takes at most about this many rays.
const PROJECTED: f64 = 4e5;
/// Brightness of what a mask leaves out, in pictures of masks.
const DIMMED: u16 = 3;

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
        let error =
            anyhow!("masks are made of whole photographs; leave --crop out here, and give it to `train`");
        return Err(Failure::new(Exit::Usage, error));
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
    let source = source_of(&args.data, &reading, &data);
    let data_kept = data.clone();
    let setup = Setup { data, options, index: None, source, cancel: cancel() };
    let (gate, separation) = found(&setup, &pointed.hints, show)?;
    let Written { written, kept, covered, picture } = write(&data_kept, &targets, &gate, &out, show)?;
    let text = format!(
        "{written} masks written in {}, {kept} kept; they cover {:.1} % of all pixels (separation {separation:.2})\nlook at {}: \
         correct or delete masks that are wrong (this command makes those anew that are missing), then {}",
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

/// Where the masks go: where the program looks for them, if nobody says where.
fn folder(args: &MaskArgs, data: &Dataset) -> Result<PathBuf, Failure> {
    let usual = || data.root.as_ref().map(|root| root.join("glass_masks"));
    let nowhere =
        || Failure::new(Exit::Usage, anyhow!("the data are in no folder; say where masks go with --out"));
    args.out.clone().or_else(usual).ok_or_else(nowhere)
}

/// Where the mask of a view lies in its folder: as the image lies in the dataset's.
fn path(data: &Dataset, view: &View) -> PathBuf {
    let inside = match (&view.source, &data.root) {
        (PhotoSource::Files { image, .. }, Some(root)) => image.strip_prefix(root).ok(),
        _ => None,
    };
    let stays_inside = |path: &&Path| path.components().all(|c| matches!(c, Component::Normal(_)));
    inside.filter(stays_inside).unwrap_or(Path::new(&view.name)).with_extension("png")
}

/// The file of each view's mask. Refuses two views with one file.
fn targets(data: &Dataset, out: &Path) -> Result<Vec<PathBuf>, Failure> {
    let all: Vec<PathBuf> = data.views.iter().map(|view| out.join(path(data, view))).collect();
    let mut sorted: Vec<&PathBuf> = all.iter().collect();
    sorted.sort();
    match sorted.windows(2).find(|two| two[0] == two[1]) {
        None => Ok(all),
        Some(two) => {
            let error = anyhow!(
                "two photographs would share the mask {}; give their files different names, or put them into the dataset's folder",
                two[0].display()
            );
            Err(Failure::new(Exit::BadInput, error))
        }
    }
}

/// Masks in the folder are made anew.
fn forget(data: &mut Dataset, out: &Path) {
    let out = absolute(out);
    for view in &mut data.views {
        if let PhotoSource::Files { mask, .. } = &mut view.source {
            mask.take_if(|mask| absolute(mask).starts_with(&out));
        }
    }
}

/// Refuses data whose masks say which pixels to use: masks of glass would take their place.
fn refuse_other_masks(data: &Dataset) -> Result<(), Failure> {
    let other = data.views.iter().find(|v| v.has_mask() && v.mask_meaning != MaskMeaning::Refractive);
    let Some(view) = other else { return Ok(()) };
    let error = anyhow!(
        "the mask of {} is taken to say which pixels to use, and a photograph has one mask; if its white means glass, say \
         --mask-meaning refractive, else take such masks away",
        view.name
    );
    Err(Failure::new(Exit::BadInput, error))
}

/// Refuses data in which nothing is to be found.
fn refuse_complete(data: &Dataset) -> Result<(), Failure> {
    let is_masked =
        |v: &usize| data.views[*v].has_mask() && data.views[*v].mask_meaning == MaskMeaning::Refractive;
    if !data.split.train.iter().all(is_masked) {
        return Ok(());
    }
    let error = anyhow!(
        "all {} training views have masks of refractive things already; delete those that are wrong, and this makes them anew; \
         --overwrite makes all masks in the folder anew",
        data.split.train.len()
    );
    Err(Failure::new(Exit::BadInput, error))
}

/// Options of a detector that is sent alone.
fn options(args: &MaskArgs, data: &Dataset) -> Result<Options, Failure> {
    let mut options = Options::suited_to(scene_region(data).unbounded);
    super::options::set_all(&args.settings, &mut options)?;
    (options.refraction.bend, options.detection.enabled) = (Switch::On, Switch::On);
    options.checked().or_exit(Exit::Usage)
}

/// Looks for what straight rays cannot explain; what it is, and its separation.
fn found(setup: &Setup, hints: &Hints, show: Show) -> Result<(Gate, f64), Failure> {
    let mut watch = ProgressDisplay::new(show);
    let mut is_loaded = false;
    let found = setup.detect(hints, &mut |event| match event {
        Event::Progress { task: Task::LoadingPhotos, .. } => watch.load(&event),
        _ => {
            if !std::mem::replace(&mut is_loaded, true) {
                watch.start(None);
            }
            watch.tell(&event);
        }
    });
    watch.end(found.is_ok());
    if interrupted() {
        let note = anyhow!("stopped before anything was found; no mask was written");
        return Err(Failure::new(Exit::Interrupted, note));
    }
    let Found { gate, separation } = found.map_err(session_failure)?;
    let nothing = || match setup.data.views.iter().filter(|v| v.has_mask()).count() {
        masks if masks >= refraction_search::LEAST_MASKS => anyhow!(
            "nothing was found that straight rays cannot explain; {masks} photographs have masks, which is enough to train with: \
             their hull says what the others show"
        ),
        _ => anyhow!(
            "nothing was found that straight rays cannot explain; point at the glass in some photographs with --click VIEW X Y, \
             --box VIEW X0 Y0 X1 Y1 or --outline VIEW X,Y X,Y X,Y"
        ),
    };
    let gate = gate.ok_or_else(|| Failure::new(Exit::BadInput, nothing()))?;
    Ok((gate, separation))
}

/// What was written.
struct Written {
    written: usize,
    kept: usize,
    covered: f64,
    picture: PathBuf,
}

/// Writes masks of the views that have no file of one, and a picture of some of all.
fn write(
    data: &Dataset,
    targets: &[PathBuf],
    gate: &Gate,
    out: &Path,
    show: Show,
) -> Result<Written, Failure> {
    create_folder(out)?;
    let found = std::slice::from_ref(gate);
    let (mut inside, mut pixels, mut kept) = (0, 0, 0);
    let shown: Vec<usize> = chosen(data.views.len()).collect();
    let photos = load_photos(data, &shown, show)?;
    let mut rows = Vec::new();
    for (k, (view, path)) in data.views.iter().zip(targets).enumerate() {
        let camera = &view.camera;
        let edge = (f64::from(camera.width) * f64::from(camera.height) / PROJECTED).sqrt().max(1.0);
        let given = given(view)?;
        let is_kept = given.is_some() && matches!(view.source, PhotoSource::Files { .. });
        kept += usize::from(is_kept);
        let mask = given.unwrap_or_else(|| Arc::new(detection::mask(found, camera, edge)));
        inside += mask.coverage.iter().filter(|c| **c > 127).count();
        pixels += mask.coverage.len();
        if !is_kept {
            path.parent().map_or(Ok(()), create_folder)?;
            save_png(path, &mask.coverage, [mask.width, mask.height], image::ExtendedColorType::L8)?;
        }
        if let Some(row) = shown.iter().position(|&s| s == k) {
            rows.push((view.name.clone(), dimmed(&photos[row], data, &mask), mask));
        }
    }
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    let picture = out.with_file_name(format!("{name}_overview.png"));
    draw(&rows, &picture)?;
    Ok(Written {
        written: data.views.len() - kept,
        kept,
        covered: inside as f64 / pixels.max(1) as f64,
        picture,
    })
}

/// The mask of what is refractive that a view has.
fn given(view: &View) -> Result<Option<Arc<Mask>>, Failure> {
    if !view.has_mask() || view.mask_meaning != MaskMeaning::Refractive {
        return Ok(None);
    }
    load_mask_of(view).map_err(data_failure)
}

/// The photograph, dark beside what its mask shows.
fn dimmed(photo: &Photo, data: &Dataset, mask: &Mask) -> Vec<[u8; 3]> {
    let dim = |(rgb, coverage): ([u8; 3], &u8)| {
        if *coverage > 127 { rgb } else { rgb.map(|c| (u16::from(c) / DIMMED) as u8) }
    };
    truth(photo, data.backdrop).into_iter().zip(&mask.coverage).map(dim).collect()
}

fn draw(rows: &[(String, Vec<[u8; 3]>, Arc<Mask>)], path: &Path) -> Result<(), Failure> {
    use crate::picture::{Comparison, Content, Panel};
    let panels = rows.iter().map(|(name, pixels, mask)| {
        let image = Rgb8::new(pixels, mask.width as usize, mask.height as usize);
        vec![Panel { content: Content::Image(image), note: name.clone() }]
    });
    let picture = Comparison {
        title: "masks: dark is left out".to_owned(),
        columns: vec![String::new()],
        rows: panels.collect(),
        full_error: u8::MAX,
    };
    Ok(picture.draw().save_png(path)?)
}

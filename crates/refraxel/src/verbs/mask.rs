//! `refraxel mask`: masks of what is refractive, found by what straight rays cannot explain and by what somebody points at.

mod pointed;

use super::interrupts::{cancel, interrupted, watch_for_interrupts};
use super::sheet::{chosen, save_png};
use super::{create_folder, data_failure, load_photos, open_options, set_threads, source_of};
use crate::cli::MaskArgs;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::verbs::train::{Watch, session_failure};
use anyhow::anyhow;
use pointed::Pointed;
use refraxel_data::{Dataset, Mask, MaskMeaning, Photo, PhotoSource, View, load_photo, scene_region};
use refraxel_train::evaluation::truth;
use refraxel_train::events::{Event, Task};
use refraxel_train::metrics::Rgb8;
use refraxel_train::model::Gate;
use refraxel_train::options::Switch;
use refraxel_train::session::{Session, Setup, Until};
use refraxel_train::{CpuBackend, Options, recipe};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Masks of large photographs are projected in squares of so many pixels, so that a view takes at most about this many rays.
const PROJECTED: f64 = 4e5;
/// Steps of training between two looks at whether all is found.
const AT_A_TIME: u64 = 10;
/// Brightness of what a mask leaves out, in pictures of masks.
const DIMMED: u16 = 3;

/// What was made.
#[derive(Serialize)]
struct Made {
    /// Folder of the masks.
    masks: PathBuf,
    /// Masks written.
    written: usize,
    /// Of them, how many somebody had made before.
    stated: usize,
    /// Share of the pixels of all photographs that they cover.
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
    let mut data = Dataset::open(&args.data, &reading).map_err(data_failure)?;
    let out = folder(args, &data)?;
    refuse_earlier(&out, args.overwrite)?;
    refuse_complete(&data)?;
    let options = options(args, &data)?;
    let pointed = Pointed::new(args, &data)?;
    let paths: Vec<PathBuf> = data.views.iter().map(|view| path(&data, view)).collect();
    for (view, mask) in &pointed.outlines {
        let photo = load_photo(&data.views[*view]).map_err(data_failure)?;
        let of = &mut data.views[*view];
        of.source = PhotoSource::Memory(Photo { mask: Some(Arc::clone(mask)), ..photo });
        of.mask_meaning = MaskMeaning::Refractive;
    }
    let source = source_of(&args.data, &reading, &data);
    let data_kept = data.clone();
    let setup = Setup { data, options, index: None, hints: pointed.hints, source, cancel: cancel() };
    let (gate, separation) = found(setup, show)?;
    let made = write(&data_kept, &paths, &gate, &out, show)?;
    let Written { written, stated, covered, picture } = made;
    let text = format!(
        "{written} masks in {} ({stated} of them as they were), {:.1} % of all pixels, separation {separation:.2}\nlook at {} and \
         correct them where they are wrong, then: refraxel train {} --out RUN",
        out.display(),
        100.0 * covered,
        picture.display(),
        args.data.display(),
    );
    let made = Made { masks: out, written, stated, covered, separation, picture };
    Console::new(args.work.json).result(&text, &made).or_exit(Exit::Io)
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
    inside.unwrap_or(Path::new(&view.name)).with_extension("png")
}

fn refuse_earlier(out: &Path, overwrite: bool) -> Result<(), Failure> {
    let is_empty = std::fs::read_dir(out).map_or(true, |mut entries| entries.next().is_none());
    if is_empty || overwrite {
        return Ok(());
    }
    let error = anyhow!(
        "{} holds files already; replace the masks there by --overwrite (which uses them as they are where they mark something), \
         or choose another folder with --out",
        out.display()
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
        "all {} training views have masks of refractive things already; take away those that are wrong, and this makes them anew",
        data.split.train.len()
    );
    Err(Failure::new(Exit::BadInput, error))
}

/// Options of a training that only seeks.
fn options(args: &MaskArgs, data: &Dataset) -> Result<Options, Failure> {
    let mut options = Options::suited_to(scene_region(data).unbounded);
    (options.refraction.bend, options.seek.enabled) = (Switch::On, Switch::On);
    for setting in &args.settings {
        options.set(&setting.key, &setting.value).or_exit(Exit::Usage)?;
    }
    options.checked().or_exit(Exit::Usage)
}

/// Trains with straight rays until something is found; what it is, and its separation.
fn found(setup: Setup, show: Show) -> Result<(Gate, f64), Failure> {
    let looks = setup.options.seek.looks;
    let mut watch = Watch::new(show);
    let session = Session::start(setup, CpuBackend::new, &mut |event| watch.load(&event));
    let mut session: Session<CpuBackend> = session.map_err(session_failure)?;
    let last = session.options().refraction.straight_steps
        + session.options().seek.pause * u64::from(looks.saturating_sub(1));
    watch.start(Some(last));
    let mut separation = 0.0;
    while session.state().looks.count < looks && !session.state().stays_straight {
        let step = session.state().step;
        watch.stands(step as f64 / last as f64);
        let run = session.run(Until::step(step + AT_A_TIME), &mut |event| match event {
            Event::Progress { task: Task::Training, .. } | Event::Record(_) => {}
            Event::Sought { separation: found, .. } => {
                separation = found;
                watch.tell(&event);
            }
            _ => watch.tell(&event),
        });
        run.map_err(session_failure)?;
        if interrupted() {
            let note = anyhow!("stopped before anything was found; no mask was written");
            return Err(Failure::new(Exit::Interrupted, note));
        }
    }
    watch.end(true);
    let nothing = || {
        anyhow!(
            "nothing was found that straight rays cannot explain; point at the glass in some photographs with --click VIEW X Y, \
             --box VIEW X0 Y0 X1 Y1 or --outline VIEW X,Y X,Y X,Y"
        )
    };
    let gate = session.sought().cloned().ok_or_else(|| Failure::new(Exit::BadInput, nothing()))?;
    Ok((gate, separation))
}

/// What was written.
struct Written {
    written: usize,
    stated: usize,
    covered: f64,
    picture: PathBuf,
}

/// Writes the masks of all views, those that there are as they are, and a picture of some.
fn write(data: &Dataset, paths: &[PathBuf], gate: &Gate, out: &Path, show: Show) -> Result<Written, Failure> {
    create_folder(out)?;
    let found = std::slice::from_ref(gate);
    let (mut inside, mut pixels, mut stated) = (0, 0, 0);
    let shown: Vec<usize> = chosen(data.views.len()).collect();
    let photos = load_photos(data, &shown, show)?;
    let mut rows = Vec::new();
    for (k, (view, path)) in data.views.iter().zip(paths).enumerate() {
        let camera = &view.camera;
        let edge = (f64::from(camera.width) * f64::from(camera.height) / PROJECTED).sqrt().max(1.0);
        let given = given(view)?;
        stated += usize::from(given.is_some());
        let mask = given.unwrap_or_else(|| Arc::new(recipe::mask(found, camera, edge)));
        inside += mask.coverage.iter().filter(|c| **c > 127).count();
        pixels += mask.coverage.len();
        let path = out.join(path);
        path.parent().map_or(Ok(()), create_folder)?;
        save_png(&path, &mask.coverage, [mask.width, mask.height], image::ExtendedColorType::L8)?;
        if let Some(row) = shown.iter().position(|&s| s == k) {
            rows.push((view.name.clone(), dimmed(&photos[row], data, &mask), mask));
        }
    }
    let picture = PathBuf::from(format!("{}.png", out.display()));
    draw(&rows, &picture)?;
    Ok(Written { written: data.views.len(), stated, covered: inside as f64 / pixels.max(1) as f64, picture })
}

/// The mask of what is refractive that a view has.
fn given(view: &View) -> Result<Option<Arc<Mask>>, Failure> {
    if !view.has_mask() || view.mask_meaning != MaskMeaning::Refractive {
        return Ok(None);
    }
    Ok(load_photo(view).map_err(data_failure)?.mask)
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

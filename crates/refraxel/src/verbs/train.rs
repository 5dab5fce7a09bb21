//! `refraxel train`: from a dataset to an evaluated run.

use super::eval::evaluate;
use super::{
    create_folder, data_failure, interrupted, load_photos, open_options, options, set_threads, source_of,
    watch_for_interrupts,
};
use crate::cli::{Refraction, SplitName, TrainArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::plot::{Plot, Series};
use crate::progress::{Progress, Show};
use anyhow::{Context, anyhow};
use refraxel_data::{Dataset, MaskMeaning, Photo, View, scene_region};
use refraxel_train::checkpoint::{remove_leftovers, write_atomic};
use refraxel_train::options::Switch;
use refraxel_train::run::{CHECKPOINT, Loaded, Source, load_run, save_run};
use refraxel_train::schedule::Phase;
use refraxel_train::trainer::Record;
use refraxel_train::{Options, TrainError, Trainer, recipe};
use std::num::NonZeroU64;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two checkpoints.
const SAVE_EVERY: Duration = Duration::from_secs(60);

/// The verb.
pub fn run(args: &TrainArgs) -> Result<(), Failure> {
    if args.options {
        return options::print(args);
    }
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let show = Show::suited(args.work.quiet || args.work.json);
    train(args, show)?;
    let evaluation = evaluate(args.out(), SplitName::Test, show)?;
    let out = super::evaluation::folder(args.out(), SplitName::Test);
    super::eval::print(&evaluation, &out, SplitName::Test, Console::new(args.work.json))
}

/// Trains to the end and saves; an interruption is a failure, after saving.
pub fn train(args: &TrainArgs, show: Show) -> Result<(), Failure> {
    // Everything that can be wrong with the input is found before the first file is written.
    let reading = open_options(&args.reading);
    let data = Dataset::open(args.data(), &reading).map_err(data_failure)?;
    let source = source_of(args.data(), &reading, &data);
    let saved = if args.resume { Some(saved(args, &source, show)?) } else { None };
    let options = match &saved {
        Some(run) => run.options.clone(),
        None => options_of_new_run(args, &data, show)?,
    };
    let photos = load_photos(&data, &data.split.train, show)?;
    let validation = validation_view(&data)?;
    let trainer = match saved {
        Some(run) => Trainer::resumed(options, run.plan, run.backend, run.state, (&data, photos, validation)),
        None => Trainer::new(options, &data, photos, validation),
    };
    create_folder(args.out())?;
    let mut log = Log::open(args.out(), trainer.state().step)?;
    let (step, finished) = learn(trainer, args.out(), &source, &mut log, show)?;
    if !finished {
        let note = anyhow!("stopped at step {step} and saved; the same command with --resume goes on");
        return Err(Failure::new(Exit::Interrupted, note));
    }
    Ok(())
}

/// The options of a run that begins, if they suit the dataset.
fn options_of_new_run(args: &TrainArgs, data: &Dataset, show: Show) -> Result<Options, Failure> {
    let mut usual = Options::suited_to(scene_region(data).unbounded);
    usual.refraction.bend = bending(args, data);
    let options = options::read(args, usual, show)?;
    recipe::check(&options, is_masked(data)).or_exit(Exit::BadInput)?;
    Ok(options)
}

/// Whether rays bend: as asked for, or where something says what is refractive.
fn bending(args: &TrainArgs, data: &Dataset) -> Switch {
    let said = args.refraction_box.is_some() || args.index_from.is_some();
    match args.refraction {
        Refraction::Off => Switch::Off,
        Refraction::On => Switch::On,
        Refraction::Auto if said || is_masked(data) => Switch::On,
        Refraction::Auto => Switch::Off,
    }
}

/// Some training view has a mask of what is refractive.
fn is_masked(data: &Dataset) -> bool {
    let views = data.split.train.iter().map(|&i| &data.views[i]);
    views.into_iter().any(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive)
}

/// The run to go on with, if its data and options are still the same.
fn saved(args: &TrainArgs, source: &Source, show: Show) -> Result<Loaded, Failure> {
    let mut run = load_run(args.out())?;
    if run.source.train != source.train {
        let (out, was) = (args.out().display(), run.source.train.len());
        let (data, is) = (args.data().display(), source.train.len());
        let error = anyhow!(
            "{out} was trained on other images ({was} of them) than {data} offers now ({is}); resume with the same \
             dataset and split, or start a new run"
        );
        return Err(Failure::new(Exit::BadInput, error));
    }
    run.options = options::resumed(args, run.options, show)?;
    Ok(run)
}

/// The first validation view, or the first test view of a dataset without any.
fn validation_view(data: &Dataset) -> Result<Option<(View, Photo)>, Failure> {
    let Some(&first) = data.split.val.first() else { return Ok(None) };
    let photo = refraxel_data::load_photo(&data.views[first]).map_err(data_failure)?;
    Ok(Some((data.views[first].clone(), photo)))
}

/// Train to the end and save; the last step, and false when interrupted before the end.
fn learn(
    mut trainer: Trainer,
    out: &Path,
    source: &Source,
    log: &mut Log,
    show: Show,
) -> Result<(u64, bool), Failure> {
    // Leftovers of killed saves; failing to remove them harms nobody.
    let _ = remove_leftovers(&out.join(CHECKPOINT));
    // Of a time budget nobody knows the steps: thousandths of the time are shown instead.
    let parts = if trainer.options().run.minutes > 0.0 { 1000 } else { trainer.options().run.steps };
    let mut progress = Progress::new(show, "training", parts);
    let mut saved = Instant::now();
    let mut last: Option<Record> = None;
    let stop_after = NonZeroU64::new(trainer.options().run.stop_after).map_or(u64::MAX, u64::from);
    while !trainer.finished() && !interrupted() && trainer.state().step < stop_after {
        if let Some(record) = trainer.step().map_err(train_failure)? {
            log.write(&record)?;
            record.events.iter().for_each(|events| progress.say(events));
            last = Some(record);
        }
        let note = last.as_ref().map(note).unwrap_or_default();
        progress.set((trainer.progress().0 * parts as f64).round() as u64, &note);
        if saved.elapsed() > SAVE_EVERY {
            save(&mut trainer, out, source)?;
            saved = Instant::now();
        }
    }
    save(&mut trainer, out, source)?;
    log.draw(out)?;
    let finished = trainer.finished();
    progress.finish(&last.as_ref().map(note).unwrap_or_default());
    Ok((trainer.state().step, finished))
}

fn note(r: &Record) -> String {
    let phase = match r.phase {
        Phase::Straight => "straight".to_owned(),
        Phase::Index => "index alone".to_owned(),
        Phase::Joint => "all together".to_owned(),
    };
    let index: Vec<String> = r.index.iter().take(3).map(|n| format!("{n:.3}")).collect();
    let index = if index.is_empty() { String::new() } else { format!("  n {}", index.join(" ")) };
    let (size, psnr, speed) = (r.resolution, r.train_psnr, r.krays_per_s);
    format!("{phase}  {size}³  {psnr:.2} dB{index}  {speed:.0} krays/s")
}

fn save(trainer: &mut Trainer, out: &Path, source: &Source) -> Result<(), Failure> {
    trainer.settle_clock();
    let (options, plan, state) = (trainer.options().clone(), trainer.plan().clone(), trainer.state().clone());
    Ok(save_run(out, &options, &plan, &state, source, trainer.backend())?)
}

fn train_failure(error: TrainError) -> Failure {
    match error {
        TrainError::Diverged { .. } => Failure::new(Exit::Numerical, error),
        TrainError::NoPixels | TrainError::Recipe(_) => Failure::new(Exit::BadInput, error),
        TrainError::Checkpoint(e) => e.into(),
        TrainError::Metrics(e) => e.into(),
    }
}

/// The training log: RUN/log.jsonl, one record a line, and its picture RUN/curves.png.
struct Log {
    path: PathBuf,
    lines: String,
}

impl Log {
    /// Keeps the records up to `step`: those after it belong to steps that were lost and are done again.
    fn open(out: &Path, step: u64) -> Result<Self, Failure> {
        let path = out.join("log.jsonl");
        let text = if step > 0 { std::fs::read_to_string(&path).unwrap_or_default() } else { String::new() };
        let done = |line: &&str| serde_json::from_str(line).is_ok_and(|r: Record| r.step <= step);
        let lines = text.lines().filter(done).map(|line| format!("{line}\n")).collect();
        let log = Self { path, lines };
        log.store()?;
        Ok(log)
    }

    fn write(&mut self, record: &Record) -> Result<(), Failure> {
        use std::io::Write;
        let line = serde_json::to_string(record).or_exit(Exit::Io)? + "\n";
        self.lines.push_str(&line);
        std::fs::OpenOptions::new()
            .append(true)
            .open(&self.path)
            .and_then(|mut f| f.write_all(line.as_bytes()))
            .with_context(|| format!("cannot write to {}", self.path.display()))
            .or_exit(Exit::Io)
    }

    fn store(&self) -> Result<(), Failure> {
        Ok(write_atomic(&self.path, |f| f.write_all(self.lines.as_bytes()))?)
    }

    /// Draw the curves of all records.
    fn draw(&self, out: &Path) -> Result<(), Failure> {
        let records: Vec<Record> = self.lines.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let series = |name: &str, y: &dyn Fn(&Record) -> Option<f64>| Series {
            name: name.to_owned(),
            points: records
                .iter()
                .filter_map(|r| Some((r.seconds / 60.0, y(r)?)))
                .filter(|(_, v)| v.is_finite())
                .collect(),
        };
        let plot = Plot {
            title: "Training".to_owned(),
            x_label: "minutes".to_owned(),
            y_label: "PSNR [dB]".to_owned(),
            series: vec![
                series("training rays", &|r| Some(r.train_psnr)),
                series("validation view", &|r| r.val_psnr),
            ],
        };
        let path = out.join("curves.png");
        Ok(plot.draw(960, 540).save_png(&path)?)
    }
}

//! `refraxel train`: from a dataset to an evaluated run.

use super::{
    create_folder, data_failure, interrupted, load_photos, open_options, set_threads, source_of,
    watch_for_interrupts,
};
use crate::cli::{Refraction, TrainArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::plot::{Plot, Series};
use crate::progress::{Progress, Show};
use anyhow::{Context, anyhow};
use refraxel_data::{Dataset, Photo, View};
use refraxel_train::checkpoint::{remove_leftovers, write_atomic};
use refraxel_train::run::{CHECKPOINT, Source, load_run, save_run};
use refraxel_train::trainer::Record;
use refraxel_train::{Config, TrainError, Trainer};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two checkpoints.
const SAVE_EVERY: Duration = Duration::from_secs(60);

/// The verb.
pub fn run(args: &TrainArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let console = Console::new(args.work.json);
    let show = Show::suited(args.work.quiet || args.work.json);
    if args.refraction == Refraction::On {
        return Err(Failure::new(
            Exit::Usage,
            anyhow!("--refraction on: bent rays are not part of this version yet; use --refraction off"),
        ));
    }
    let options = open_options(&args.reading);
    let data = Dataset::open(&args.data, &options).map_err(data_failure)?;
    create_folder(&args.out)?;
    let source = source_of(&args.data, &options, &data);
    let photos = load_photos(&data, &data.split.train, show)?;
    let mut log = Log::open(&args.out, args.resume)?;
    let trainer = start(args, &data, photos, &source)?;
    let (trainer, finished) = learn(trainer, &args.out, &source, &mut log, show)?;
    if !finished {
        let note =
            format!("stopped at step {}; the same command with --resume goes on", trainer.state().step);
        return Err(Failure::new(Exit::Interrupted, anyhow!(note)));
    }
    drop(trainer);
    super::eval::evaluate(&args.out, crate::cli::SplitName::Test, console, show)
}

/// The options: defaults, then the file, then `--set`, then the flags of their own.
fn configuration(args: &TrainArgs) -> Result<Config, Failure> {
    let mut config = Config::default();
    if let Some(path) = &args.config {
        let text = std::fs::read_to_string(path)
            .with_context(|| format!("cannot read the configuration {}", path.display()))
            .or_exit(Exit::BadInput)?;
        let table: toml::Table = text
            .parse()
            .with_context(|| format!("{} is not a TOML file of `key = value` lines", path.display()))
            .or_exit(Exit::BadInput)?;
        let pairs: Vec<(String, String)> =
            table.into_iter().map(|(k, v)| (k, v.to_string().trim_matches('"').to_owned())).collect();
        let within = || format!("in {}", path.display());
        config = config
            .with(pairs.iter().map(|(k, v)| (k.as_str(), v.as_str())))
            .with_context(within)
            .or_exit(Exit::BadInput)?;
    }
    let settings = args.settings.iter().map(|s| (s.key.as_str(), s.value.as_str()));
    config = config.with(settings).or_exit(Exit::Usage)?;
    config.seed = args.seed;
    config.minutes = args.minutes.unwrap_or(config.minutes);
    config.checked().or_exit(Exit::Usage)
}

fn start(args: &TrainArgs, data: &Dataset, photos: Vec<Photo>, source: &Source) -> Result<Trainer, Failure> {
    let validation = validation_view(data)?;
    if !args.resume {
        return Ok(Trainer::new(configuration(args)?, data, photos, validation));
    }
    let run = load_run(&args.out)?;
    if run.source.train != source.train {
        return Err(Failure::new(
            Exit::BadInput,
            anyhow!(
                "{} was trained on other images ({} of them) than {} offers now ({}); resume with the same dataset and \
                 split, or start a new run",
                args.out.display(),
                run.source.train.len(),
                args.data.display(),
                source.train.len()
            ),
        ));
    }
    let mut config = run.config;
    config.minutes = args.minutes.unwrap_or(config.minutes);
    Ok(Trainer::resumed(config, run.plan, run.backend, run.state, (data, photos, validation)))
}

/// The first validation view, or the first test view of a dataset without any.
fn validation_view(data: &Dataset) -> Result<Option<(View, Photo)>, Failure> {
    let Some(&first) = data.split.val.first() else { return Ok(None) };
    let photo = refraxel_data::load_photo(&data.views[first]).map_err(data_failure)?;
    Ok(Some((data.views[first].clone(), photo)))
}

/// Train to the end; false when interrupted, after saving.
fn learn(
    mut trainer: Trainer,
    out: &Path,
    source: &Source,
    log: &mut Log,
    show: Show,
) -> Result<(Trainer, bool), Failure> {
    // Leftovers of killed saves; failing to remove them harms nobody.
    let _ = remove_leftovers(&out.join(CHECKPOINT));
    const PARTS: u64 = 1000;
    let mut progress = Progress::new(show, "training", PARTS);
    let mut saved = Instant::now();
    let mut last: Option<Record> = None;
    while !trainer.finished() && !interrupted() {
        if let Some(record) = trainer.step().map_err(train_failure)? {
            log.write(&record)?;
            last = Some(record);
        }
        let note = last.as_ref().map(note).unwrap_or_default();
        progress.set((trainer.progress().0 * PARTS as f64) as u64, &note);
        if saved.elapsed() > SAVE_EVERY {
            save(&mut trainer, out, source)?;
            saved = Instant::now();
        }
    }
    save(&mut trainer, out, source)?;
    log.draw(out)?;
    let finished = trainer.finished();
    progress.finish(&last.as_ref().map(note).unwrap_or_default());
    Ok((trainer, finished))
}

fn note(r: &Record) -> String {
    format!("{}³  {:.2} dB  {:.0} krays/s", r.resolution, r.train_psnr, r.krays_per_s)
}

fn save(trainer: &mut Trainer, out: &Path, source: &Source) -> Result<(), Failure> {
    trainer.settle_clock();
    let (config, plan, state) = (trainer.config().clone(), trainer.plan().clone(), trainer.state().clone());
    Ok(save_run(out, &config, &plan, &state, source, trainer.backend())?)
}

fn train_failure(error: TrainError) -> Failure {
    match error {
        TrainError::Diverged { .. } => Failure::new(Exit::Numerical, error),
        TrainError::NoPixels => Failure::new(Exit::BadInput, error),
        TrainError::Checkpoint(e) => e.into(),
        TrainError::Metrics(e) => e.into(),
    }
}

/// The training log: RUN/log.jsonl, one record a line, and its picture RUN/curves.png.
struct Log {
    path: std::path::PathBuf,
    lines: String,
}

impl Log {
    fn open(out: &Path, keep: bool) -> Result<Self, Failure> {
        let path = out.join("log.jsonl");
        let lines = if keep { std::fs::read_to_string(&path).unwrap_or_default() } else { String::new() };
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
        plot.draw(960, 540)
            .save_png(&path)
            .with_context(|| format!("cannot write {}", path.display()))
            .or_exit(Exit::Io)
    }
}

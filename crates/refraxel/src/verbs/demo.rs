//! `refraxel demo`: a glass scene from its making to its score, in about a minute.

use super::eval::evaluate;
use super::files::{absolute, create_folder};
use super::interrupts::watch_for_interrupts;
use super::threads::set_threads;
use super::{compare, sheet, synth, train};
use crate::cli::{Cli, DemoArgs, TrainArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::shell::quoted_path;
use crate::table::score;
use refraxel_data::Part;
use refraxel_data::synth::{SynthOptions, ViewCounts};
use refraxel_train::device::DeviceChoice;
use refraxel_train::evaluation::IndexError;
use refraxel_train::metrics::Scores;
use refraxel_train::run::{CHECKPOINT, Run};
use serde::Serialize;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::time::Instant;

const SCENE: &str = "glass_ball";
/// Edge of the pictures [pixel].
const SIZE: u32 = 160;
const VIEWS: ViewCounts = ViewCounts { train: 80, val: 2, test: 8 };
/// Samples per pixel: edges stay smooth and the dataset is ready in seconds.
const SAMPLES: u32 = 9;
/// Options of both runs; a fixed number of steps, so that the same seed gives the same figures on every machine.
const SETTINGS: [&str; 4] = ["--set", "run.steps=540", "--set", "grid.resolution=96"];

#[derive(Serialize)]
struct Report {
    data: PathBuf,
    /// The run with bent rays.
    run: PathBuf,
    picture: PathBuf,
    seconds: f64,
    straight: Scores,
    bent: Scores,
    ior: Option<IndexError>,
}

/// The verb.
pub fn run(args: &DemoArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let start = Instant::now();
    let console = Console::new(args.work.json);
    let show = Show::suited(args.work.quiet || args.work.json);
    let [data, straight, bent] = ["data", "straight", "bent"].map(|name| args.out.join(name));
    for run in [&straight, &bent] {
        refuse_run_on_other_data(run, &data)?;
    }
    create_folder(&args.out)?;
    let (views, held_out) = (VIEWS.train, VIEWS.test);
    say(console, &format!("1. Exact pictures of a glass ball: {views} to learn from, {held_out} to score."))?;
    synth::make(&scene(&data, args.seed), show)?;
    say(console, "2. Training a voxel scene with straight rays, as others do.")?;
    drop(train::train(&training(args, "off", &data, &straight)?, show)?);
    say(
        console,
        "3. Training it with rays that bend: this finds the glass, its index, and the surroundings.",
    )?;
    drop(train::train(&training(args, "auto", &data, &bent)?, show)?);
    say(console, "4. Rendering the views that training has not seen.")?;
    let runs = [straight, bent];
    let evaluations = [
        evaluate(&runs[0], Part::Test, DeviceChoice::Cpu, show)?,
        evaluate(&runs[1], Part::Test, DeviceChoice::Cpu, show)?,
    ];
    let picture = args.out.join("comparison.png");
    let rows = compare::rows(&runs, &evaluations, true)?;
    let titles = ["straight rays".to_owned(), "bent rays".to_owned()];
    sheet::draw(&rows, &titles, "A glass ball, views not trained on", &picture)?;
    let seconds = start.elapsed().as_secs_f64();
    let ([straight, bent], [_, run]) = (evaluations, runs);
    let report =
        Report { data, run, picture, seconds, straight: straight.scores, bent: bent.scores, ior: bent.ior };
    console.result(&report.text(), &report).or_exit(Exit::Io)
}

/// A demo may be repeated; a run on other data is somebody's work.
fn refuse_run_on_other_data(folder: &Path, data: &Path) -> Result<(), Failure> {
    let data = absolute(data);
    let is_foreign = |run: Run| run.source.path.is_none_or(|path| path != data);
    let foreign = folder.join(CHECKPOINT).exists() && Run::load(folder).map_or(true, is_foreign);
    if !foreign {
        return Ok(());
    }
    let run = folder.display();
    Err(Exit::BadInput.because(format!(
        "{run} holds a run that is not the demo's; choose another --out, or move that run away"
    )))
}

fn say(console: Console, text: &str) -> Result<(), Failure> {
    console.say(text).or_exit(Exit::Io)
}

fn scene(out: &Path, seed: u64) -> SynthOptions {
    let usual = SynthOptions::new(SCENE, out);
    SynthOptions {
        size: SIZE,
        views: VIEWS,
        seed,
        spp: SAMPLES,
        detail_spp: 0,
        index_resolution: 64,
        ..usual
    }
}

fn training(args: &DemoArgs, refraction: &str, data: &Path, out: &Path) -> Result<TrainArgs, Failure> {
    let seed = args.seed.to_string();
    let mut words: Vec<&OsStr> = vec![data.as_ref(), "--out".as_ref(), out.as_ref(), "--overwrite".as_ref()];
    let flags = ["--refraction", refraction, "--device", "cpu", "--seed", &seed];
    words.extend(flags.iter().chain(&SETTINGS).map(OsStr::new));
    Ok(TrainArgs { work: args.work.clone(), ..Cli::training(words).or_exit(Exit::Usage)? })
}

impl Report {
    fn text(&self) -> String {
        let (s, b) = (&self.straight, &self.bent);
        let row = |name: &str, s: Option<f64>, b: Option<f64>| {
            format!("  {name:16}  {:>6}         {:>6}", score(s, 2), score(b, 2))
        };
        let index =
            self.ior.and_then(|i| Some(format!("{:.3}, truth {:.3}", i.mean_inside?, i.true_mean_inside?)));
        format!(
            "\nPSNR [dB] on {} views not trained on ({:.0} s in all)\n\
             \x20                   straight rays   bent rays\n{}\n{}\n{}\n\
             index of refraction of the glass: {}\n\n\
             picture: {}\n\
             dataset: {}\n\
             Look around in it:         refraxel view {}\n\
             Now try your photographs:  refraxel train my_photos --out run",
            s.images,
            self.seconds,
            row("whole picture", s.psnr, b.psnr),
            row("inside the glass", s.psnr_inside, b.psnr_inside),
            row("outside", s.psnr_outside, b.psnr_outside),
            index.unwrap_or_else(|| "not found".to_owned()),
            self.picture.display(),
            self.data.display(),
            quoted_path(&self.run),
        )
    }
}

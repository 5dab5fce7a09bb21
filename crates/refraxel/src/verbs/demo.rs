//! `refraxel demo`: a glass scene from its making to its score, in about a minute.

use super::eval::evaluate;
use super::{compare, create_folder, set_threads, sheet, synth, train, watch_for_interrupts};
use crate::cli::{DemoArgs, ReadingArgs, Refraction, Setting, SplitName, TrainArgs};
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use crate::table::score;
use refraxel_data::synth::{SynthOptions, ViewCounts};
use refraxel_train::metrics::Scores;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

const SCENE: &str = "glass_ball";
/// Edge of the pictures [pixel].
const SIZE: u32 = 160;
const VIEWS: ViewCounts = ViewCounts { train: 80, val: 2, test: 8 };
/// Samples per pixel: edges stay smooth and the dataset is ready in seconds.
const SAMPLES: u32 = 9;
/// Options of the run; a fixed number of steps, so that the same seed gives the same figures on every machine.
const SETTINGS: [(&str, &str); 2] = [("steps", "1800"), ("resolution", "112")];

#[derive(Serialize)]
struct Report {
    data: PathBuf,
    picture: PathBuf,
    seconds: f64,
    straight: Scores,
}

/// The verb.
pub fn run(args: &DemoArgs) -> Result<(), Failure> {
    set_threads(&args.work)?;
    watch_for_interrupts()?;
    let start = Instant::now();
    let console = Console::new(args.work.json);
    let show = Show::suited(args.work.quiet || args.work.json);
    let (data, straight) = (args.out.join("data"), args.out.join("straight"));
    create_folder(&args.out)?;
    let views = VIEWS.train;
    say(
        console,
        &format!("1. Exact pictures of a glass ball: {views} to learn from, {} to judge by.", VIEWS.test),
    )?;
    synth::make(&scene(&data, args.seed), show)?;
    say(console, "2. Training a voxel scene with straight rays.")?;
    train::train(&training(args, &data, &straight), show)?;
    say(console, "3. Rendering the views that training has not seen.")?;
    let evaluation = evaluate(&straight, SplitName::Test, show)?;
    let picture = args.out.join("comparison.png");
    let rows = compare::rows(&[straight], std::slice::from_ref(&evaluation), true)?;
    sheet::draw(&rows, &["straight rays".to_owned()], "A glass ball, views not trained on", &picture)?;
    let seconds = start.elapsed().as_secs_f64();
    let report = Report { data, picture, seconds, straight: evaluation.scores };
    console.result(&report.text(), &report).or_exit(Exit::Io)
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

fn training(args: &DemoArgs, data: &Path, out: &Path) -> TrainArgs {
    let setting = |(key, value): (&str, &str)| Setting { key: key.to_owned(), value: value.to_owned() };
    TrainArgs {
        data: data.to_owned(),
        out: out.to_owned(),
        refraction: Refraction::Off,
        refraction_box: None,
        index_from: None,
        settings: SETTINGS.map(setting).to_vec(),
        config: None,
        resume: false,
        minutes: None,
        seed: Some(args.seed),
        work: args.work.clone(),
        reading: ReadingArgs { holdout: None, mask_meaning: None, allow_outside: false },
    }
}

impl Report {
    fn text(&self) -> String {
        let s = &self.straight;
        format!(
            "\nPSNR on {} views not trained on, straight rays ({:.0} s in all)\n\
             \x20 whole picture     {} dB\n\
             \x20 inside the glass  {} dB\n\
             \x20 outside           {} dB\n\
             Straight rays cannot explain what the glass shows: every view sees other things through it. They average it\n\
             into a haze. Bent rays, which come next, are made for that.\n\n\
             picture: {}\n\
             dataset: {}\n\
             Now try your photographs:  refraxel train my_photos --out run",
            s.images,
            self.seconds,
            score(s.psnr, 2),
            score(s.psnr_inside, 2),
            score(s.psnr_outside, 2),
            self.picture.display(),
            self.data.display(),
        )
    }
}

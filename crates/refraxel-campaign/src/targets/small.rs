//! The smallest datasets and trainings that use everything.

use super::Answer;
use refraxel_data::synth::{SynthOptions, ViewCounts, synthesize};
use refraxel_data::{Dataset, IndexSource, OpenOptions, report};
use refraxel_train::options::Switch;
use refraxel_train::run::Run;
use refraxel_train::session::{Session, Setup, Stop, Until};
use refraxel_train::{CpuBackend, Options};
use std::ops::ControlFlow;
use std::path::Path;

/// Options that make a training a matter of milliseconds.
pub const TINY: [&str; 11] = [
    "run.steps=4",
    "run.batch=64",
    "grid.resolution=12",
    "grid.stages=1",
    "field.sh_degree=1",
    "straight_steps=1",
    "index_resolution=16",
    "search.enabled=off",
    "judge.enabled=off",
    "environment_rows=4",
    "seek.enabled=off",
];

/// A glass ball with masks, truth and index volume.
pub fn ball(out: &Path) -> anyhow::Result<()> {
    let views = ViewCounts { train: 6, val: 1, test: 1 };
    let usual = SynthOptions::new("glass_ball", out);
    let options = SynthOptions { size: 16, views, spp: 1, detail_spp: 0, index_resolution: 6, ..usual };
    synthesize(&options, &|_| ControlFlow::Continue(()))?;
    Ok(())
}

/// The tiny options; rays bend or not.
pub fn options(bend: Switch) -> anyhow::Result<Options> {
    let mut options = Options::default();
    for setting in TINY {
        let (key, value) = setting.split_once('=').unwrap_or((setting, ""));
        options.set(key, value)?;
    }
    options.refraction.bend = bend;
    Ok(options)
}

/// Opens a dataset and trains on it.
pub fn open_and_train(path: &Path) -> Answer {
    match Dataset::open(path, &OpenOptions::default()) {
        Err(error) => Answer::Refused(error.to_string()),
        Ok(data) => {
            report(&data);
            train(data, None)
        }
    }
}

/// What is accepted before training is trained to the end, saved, read back and rendered.
pub fn train(data: Dataset, index: Option<IndexSource>) -> Answer {
    let bend = if index.is_some() { Switch::On } else { Switch::Off };
    let options = match options(bend) {
        Ok(options) => options,
        Err(error) => return Answer::Broken(format!("the campaign's options: {error}")),
    };
    let setup = Setup { index, ..Setup::new(data, options) };
    let mut session = match Session::start(setup, CpuBackend::new, &mut |_| {}) {
        Ok(session) => session,
        Err(error) => return Answer::Refused(error.to_string()),
    };
    match finish(&mut session) {
        Ok(()) => Answer::Used,
        Err(error) => Answer::Broken(format!("accepted, then: {error}")),
    }
}

fn finish(session: &mut Session) -> anyhow::Result<()> {
    let stop = session.run(Until::finished(), &mut |_| {})?;
    anyhow::ensure!(stop == Stop::Finished, "it ended by {stop:?}");
    let mut bytes = Vec::new();
    session.write(&mut bytes)?;
    let run = Run::read(&bytes[..])?;
    anyhow::ensure!(run.state == *session.state(), "its checkpoint holds another state");
    if let Some(&first) = session.data().split.test.first() {
        let camera = session.data().views[first].camera;
        if camera.width * camera.height <= 4096 {
            session.render(&camera)?;
        }
    }
    Ok(())
}

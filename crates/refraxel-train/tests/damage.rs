//! Damaged datasets and indices are refused before the first step, or trained, saved, read back and rendered.

#[path = "../../refraxel-data/tests/fixture/mod.rs"]
mod fixture;

use fixture::damage::{damage, for_each_case};
use fixture::valid::{DESCRIPTIONS, INDICES, PICTURES, Valid};
use refraxel_core::Aabb;
use refraxel_data::{Dataset, IndexSource, OpenOptions};
use refraxel_train::options::Switch;
use refraxel_train::run::Run;
use refraxel_train::session::{Session, Setup, Stop, Until};
use refraxel_train::{CpuBackend, Options};
use std::path::Path;

/// A training is a matter of milliseconds.
fn options(bend: Switch) -> Options {
    let mut options = Options::default();
    let tiny = [
        ("run.steps", "4"),
        ("run.batch", "64"),
        ("grid.resolution", "12"),
        ("grid.stages", "1"),
        ("field.sh_degree", "1"),
        ("straight_steps", "1"),
        ("shape.resolution", "16"),
        ("search.enabled", "off"),
        ("judge.enabled", "off"),
        ("detection.enabled", "off"),
    ];
    tiny.iter().for_each(|(key, value)| options.set(key, value).unwrap());
    options.refraction.bend = bend;
    options
}

/// All that training does with a dataset; an error where that is refused.
fn train(folder: &Path) -> Result<(), String> {
    finish(Setup::new(open(folder)?, options(Switch::Off)))
}

/// All that training does with a known index; an error where that, or the dataset in which it may lie, is refused.
fn bend(data: &Path, file: &Path) -> Result<(), String> {
    let data = open(data)?;
    let is_npy = file.extension().is_some_and(|e| e == "npy");
    let unit = Aabb::cube(0.5);
    let index = IndexSource::read(file, is_npy.then_some(unit)).map_err(|e| e.to_string())?;
    finish(Setup { index: Some(index), ..Setup::new(data, options(Switch::On)) })
}

fn open(folder: &Path) -> Result<Dataset, String> {
    Dataset::open(folder, &OpenOptions::default()).map_err(|e| e.to_string())
}

/// What is accepted must come to its end.
fn finish(setup: Setup) -> Result<(), String> {
    let mut session = Session::start(setup, CpuBackend::new, &mut |_| {}).map_err(|e| e.to_string())?;
    assert_eq!(session.run(Until::finished(), &mut |_| {}).unwrap(), Stop::Finished);
    let mut bytes = Vec::new();
    session.write(&mut bytes).unwrap();
    assert_eq!(Run::read(&bytes[..]).unwrap().state, *session.state());
    let first = session.data().split.test.first().map(|&first| session.data().views[first].camera);
    if let Some(camera) = first.filter(|camera| camera.width * camera.height <= 4096) {
        session.render(&camera).unwrap();
    }
    Ok(())
}

/// Trains with so many damages of a file.
fn survives(valid: &Valid, cases: u32, train: impl Fn(&Path) -> Result<(), String> + Sync) {
    let folder = tempfile::tempdir().unwrap();
    (valid.write)(folder.path());
    let path = folder.path().join(valid.file);
    let whole = std::fs::read(&path).unwrap();
    assert_eq!(train(folder.path()), Ok(()), "{}", valid.name);
    for_each_case(valid.name, cases, damage(valid.kind), |damage| {
        std::fs::write(&path, damage.of(&whole)).unwrap();
        let _ = train(folder.path());
    });
}

#[test]
fn damaged_datasets_are_refused_or_trained_to_the_end() {
    DESCRIPTIONS.iter().chain(&PICTURES).for_each(|valid| survives(valid, 8, train));
}

#[test]
fn damaged_indices_are_refused_or_bend_rays_to_the_end() {
    INDICES.iter().for_each(|valid| survives(valid, 8, |at| bend(&at.join("data"), &at.join(valid.file))));
}

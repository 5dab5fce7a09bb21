//! Small scenes with masks, and runs on them.

use refraxel_data::synth::{SynthOptions, ViewCounts, synthesize};
use refraxel_data::{Dataset, OpenOptions};
use refraxel_train::events::Event;
use refraxel_train::session::{Session, Setup, Until};
use refraxel_train::{CpuBackend, Options};
use std::ops::ControlFlow;
use tempfile::TempDir;

/// A scene that is written to disk and read again: pictures of `size`² pixels, of one sample each, in so many views that train,
/// validate and test, without a field of the index, unless `change` says otherwise. The data lie in the folder.
pub fn written(
    name: &str,
    size: u32,
    [train, val, test]: [usize; 3],
    change: impl FnOnce(&mut SynthOptions),
) -> (TempDir, Dataset) {
    let folder = tempfile::tempdir().unwrap();
    let mut options = SynthOptions {
        size,
        views: ViewCounts { train, val, test },
        spp: 1,
        detail_spp: 0,
        index_resolution: 0,
        ..SynthOptions::new(name, folder.path())
    };
    change(&mut options);
    synthesize(&options, &|_| ControlFlow::Continue(())).unwrap();
    let data = Dataset::open(folder.path(), &OpenOptions::default()).unwrap();
    (folder, data)
}

/// The usual options with these settings.
pub fn options_with(settings: &[(&str, &str)]) -> Options {
    let mut options = Options::default();
    settings.iter().for_each(|(key, value)| options.set(key, value).unwrap());
    options
}

/// A session that has not learned yet.
pub fn begun(setup: Setup) -> Session {
    Session::start(setup, CpuBackend::new, &mut |_| {}).unwrap()
}

/// What happens in a session until then.
pub fn events(session: &mut Session, until: Until) -> Vec<Event> {
    let mut events = Vec::new();
    session.run(until, &mut |event| events.push(event)).unwrap();
    events
}

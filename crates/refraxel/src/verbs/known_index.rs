//! The file of a known index of refraction that a run starts from.

use crate::exit::{Exit, Failure, OrExit};
use anyhow::Context;
use refraxel_data::{Dataset, IndexSource, scene_region};
use refraxel_train::Options;
use refraxel_train::options::{StartShape, Switch};
use refraxel_train::run::{Run, Source};
use std::path::Path;

/// The options that such a file suggests to a run that begins.
pub fn suit(options: &mut Options, file: &Path) {
    if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        // A scene.json is exact; images of 200 pixels know less of a surface.
        (options.surface.rate, options.index.rate) = (0.0, 0.0);
    }
}

/// Refuses options by which the file would not be used.
pub fn refuse_unused(options: &Options) -> Result<(), Failure> {
    let refused = |why: &str| Err(Exit::Usage.because(format!("the known index would not be used: {why}")));
    if !options.refraction.bend.is_on() {
        return refused("rays do not bend with option `refraction.bend` off; leave out one of them");
    }
    if options.shape.start != StartShape::File {
        return refused("option `shape.start` asks for another shape; leave it out, or set it to `file`");
    }
    Ok(())
}

/// The options of a run that starts from the file.
pub fn held(options: &mut Options) {
    (options.shape.start, options.search.enabled) = (StartShape::File, Switch::Off);
}

/// The index that the file of a source gives in the user's world, unless the run has decided already how its rays go.
pub fn read(
    source: &Source,
    data: &Dataset,
    saved: Option<&Run>,
    options: &Options,
) -> Result<Option<IndexSource>, Failure> {
    let decided = |run: &Run| run.state.bends_since.is_some() || run.state.stays_straight;
    let is_needed = options.refraction.bend.is_on() && !saved.is_some_and(decided);
    let Some(path) = source.index_from.as_ref().filter(|_| is_needed) else { return Ok(None) };
    let bounds = options.refraction.stated_box();
    let index = IndexSource::read(path, bounds).or_exit(Exit::BadInput)?;
    let refused = || format!("cannot start from {}", path.display());
    let scene = data.origin.to_world(scene_region(data).bounds);
    index.check_scale(&scene).with_context(refused).or_exit(Exit::BadInput)?;
    Ok(Some(index))
}

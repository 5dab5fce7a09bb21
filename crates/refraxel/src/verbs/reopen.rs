//! The dataset of a run, opened again as the training has opened it.

use super::dataset::{data_failure, reduce};
use super::loaded::Loaded;
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::Show;
use anyhow::Context;
use refraxel_data::{Dataset, LocalOrigin, OpenOptions};
use refraxel_train::run::Source;
use refraxel_train::session::SessionError;
use std::path::Path;

/// Opens the dataset of a run again, with the options of the training.
///
/// Where poses have learned, refuses data with other training views: which pose is whose would be unknown, and what was learned
/// is the way from where the cameras were.
pub fn reopen(run: &Loaded) -> Result<Dataset, Failure> {
    let data = reopen_source(&run.source, run.plan.origin)?;
    let names = data.split.train.iter().map(|&i| &data.views[i].name);
    if run.alignment.poses.is_some() && !names.eq(&run.source.train) {
        let was = run.source.train.len();
        return Err(Exit::BadInput.because(format!(
            "{} has {} training photographs now, and the run has learned the poses of {was} of other names; bring them back",
            run.source.path.as_deref().unwrap_or(Path::new("the dataset")).display(),
            data.split.train.len(),
        )));
    }
    if run.alignment.poses.is_some() && run.source.has_other_views_than(&data) {
        return Err(Failure::new(Exit::BadInput, SessionError::OtherPhotographs));
    }
    Ok(data)
}

/// Opens the dataset that a run was trained on, with the options of the training and the origin of its coordinates.
pub fn reopen_source(source: &Source, origin: LocalOrigin) -> Result<Dataset, Failure> {
    let options = OpenOptions { origin: Some(origin), ..source.open_options() };
    let nowhere = "the run was trained on data in memory, which no file holds; evaluate it in the program that trained it";
    let path = source.path.as_ref().context(nowhere).or_exit(Exit::BadInput)?;
    let mut data = Dataset::open(path, &options).map_err(data_failure)?;
    reduce(&mut data, source.downscale, path, Show::Nothing)?;
    Ok(data)
}

//! What is decided before a training begins: its options, the index that it starts from, and its device.

use crate::cli::{Refraction, TrainArgs};
use crate::device::{self, Decided, Needs, ProcessGroup};
use crate::exit::Failure;
use crate::progress::Show;
use crate::verbs::interrupts::cancel;
use crate::verbs::{known_index, options};
use refraxel_data::{Dataset, scene_region};
use refraxel_train::memory::most_voxels;
use refraxel_train::options::Switch;
use refraxel_train::plan::Plan;
use refraxel_train::run::{Run, Source};
use refraxel_train::session::Setup;
use refraxel_train::{Options, refraction_search};

/// Decides on everything that a session needs, and on its device.
pub(super) fn decide(
    args: &TrainArgs,
    group: Option<&ProcessGroup>,
    saved: Option<&Run>,
    (data, source): (Dataset, Source),
    show: Show,
) -> Result<(Setup, Decided), Failure> {
    let options = match saved {
        Some(run) => options::resumed(args, run.options.clone())?,
        None => options_of_new_run(args, &data)?,
    };
    let index = known_index::read(&source, &data, saved, &options)?;
    let setup = Setup { data, options, index, source, cancel: cancel() };
    let views = &setup.data.views;
    let has_depth = setup.data.split.train.iter().any(|&k| views[k].depth.is_some());
    let voxels = expected_voxels(&setup, saved);
    let needs = Needs { options: &setup.options, saved, has_depth, voxels };
    let decided = device::decide(args.device, group, needs, show)?;
    Ok((setup, decided))
}

/// Voxels that the largest grid of the run is expected to store.
fn expected_voxels(setup: &Setup, saved: Option<&Run>) -> u64 {
    let planned = || Plan::of_region(&setup.options, &setup.data, &scene_region(&setup.data));
    match saved {
        Some(run) => most_voxels(&run.options, &run.plan.finest),
        None => most_voxels(&setup.options, &planned().finest),
    }
}

/// The options of a run that begins. Rays bend as asked for, else where something says, or the detector finds, what is refractive.
fn options_of_new_run(args: &TrainArgs, data: &Dataset) -> Result<Options, Failure> {
    let is_told =
        args.refraction_box.is_some() || refraction_search::is_told(args.index_from.is_some(), data);
    let may_bend = is_told && args.refraction != Refraction::Off;
    let mut usual = Options::suited_to(scene_region(data).extent(), may_bend);
    usual.refraction.bend = match args.refraction {
        Refraction::On => Switch::On,
        Refraction::Auto if is_told => Switch::On,
        Refraction::Auto | Refraction::Off => Switch::Off,
    };
    if args.refraction == Refraction::On {
        usual.judge.straight = Switch::Off;
        // Who knows that something refracts says where.
        usual.detection.enabled = Switch::Off;
    }
    let mut options = options::read(args, usual)?;
    if args.refraction == Refraction::Auto && !is_told && options.detection.enabled.is_on() {
        options.refraction.bend = Switch::On;
    }
    Ok(options)
}

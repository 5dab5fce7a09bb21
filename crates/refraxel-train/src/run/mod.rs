//! What a run stores: one self-contained checkpoint with everything needed to render it or to go on training.

mod boxes;
mod clearcoat;
mod detected;
mod field;
mod header;
mod reflection;
mod refraction;
mod tensors;
#[cfg(test)]
mod tests;
mod views;

pub use tensors::nearest_half;

use crate::alignment::Alignment;
use crate::checkpoint::{self, CheckpointError, TensorFile};
use crate::device::Device;
use crate::model::{Gate, Model, Optimiser};
use crate::options::Options;
use crate::plan::Plan;
use crate::schedule::{PausedSchedule, Phase, Progress};
use crate::verdict::{Baseline, Verdict};
use field::Shapes;
use header::Header;
use refraxel_data::{Crop, Dataset, PhotoSource, Pixels};
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use tensors::Tensors;

/// Name of the checkpoint in the folder of a run.
pub const CHECKPOINT: &str = "checkpoint.safetensors";

/// Where a run stands. The random numbers are a function of the seed and the step, so this is all their state.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Steps done.
    pub step: u64,
    /// Stage of the schedule.
    pub stage: u32,
    /// What the run is busy with.
    #[serde(default)]
    pub phase: Phase,
    /// Where the schedule was held for the last time, and until when.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub paused: Option<PausedSchedule>,
    /// Share of the schedule after which rays bent, once they do: it is held while that is decided.
    #[serde(default)]
    pub bends_since: Option<f64>,
    /// Refractive things were sought that no mask shows.
    #[serde(default)]
    pub detection_done: bool,
    /// By how much the borders of refractive masks were moved outwards when rays were to bend [pixel].
    #[serde(default, skip_serializing_if = "is_zero")]
    pub mask_shift: f32,
    /// Rays were to bend, but nothing refractive was found: they stay straight.
    #[serde(default)]
    pub stays_straight: bool,
    /// What the judge decided about refractive regions, where hypotheses raced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// What straight rays had learned when rays began to bend, until bent ones have been held against it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baseline: Option<Baseline>,
    /// Seconds spent training.
    pub seconds: f64,
    /// The device that it was trained on last, where that was noted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<Device>,
    /// Validation scores recorded.
    pub validations: u32,
    /// Factor on the learning rates after overflows.
    pub rate_scale: f32,
    /// Overflows since the last good state.
    pub rollbacks: u32,
}

fn is_zero(shift: &f32) -> bool {
    *shift == 0.0
}

impl Default for State {
    fn default() -> Self {
        Self {
            step: 0,
            stage: 0,
            phase: Phase::Straight,
            paused: None,
            bends_since: None,
            detection_done: false,
            mask_shift: 0.0,
            stays_straight: false,
            verdict: None,
            baseline: None,
            seconds: 0.0,
            device: None,
            validations: 0,
            rate_scale: 1.0,
            rollbacks: 0,
        }
    }
}

/// Which data a run was trained on, and how they were read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Folder or file of the dataset, absolute; absent where the data were in memory.
    pub path: Option<PathBuf>,
    /// `--holdout`.
    pub holdout: Option<usize>,
    /// `--mask-meaning`: "refractive", "keep" or "ignore".
    pub mask_meaning: Option<String>,
    /// `--allow-outside`.
    pub allow_outside: bool,
    /// `--downscale`: a [`Reduction`](refraxel_data::Reduction) as a number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub downscale: Option<u32>,
    /// `--crop`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub crop: Option<Crop>,
    /// `--up`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<[f64; 3]>,
    /// `--index-from`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index_from: Option<PathBuf>,
    /// Names of the views trained on.
    pub train: Vec<String>,
    /// Names of the views held out.
    pub test: Vec<String>,
    /// Checksum of the cameras trained on, of what their masks mean, and of photographs and masks that are in memory.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub train_crc32: Option<String>,
}

/// A path that checkpoints cannot name.
#[derive(Debug, thiserror::Error)]
#[error("{}: the path is no text in UTF-8, so that no checkpoint can name it; rename it, or name a link to it", path.display())]
pub struct PathNotText {
    path: PathBuf,
}

/// Refuses a path that checkpoints and scores cannot name.
pub fn check_path(path: &Path) -> Result<(), PathNotText> {
    if path.to_str().is_some() { Ok(()) } else { Err(PathNotText { path: path.to_owned() }) }
}

impl Source {
    /// Refuses paths that a checkpoint cannot name.
    pub fn check(&self) -> Result<(), PathNotText> {
        self.path.iter().chain(&self.index_from).try_for_each(|path| check_path(path))
    }

    /// What the data say of themselves.
    pub fn of(data: &Dataset) -> Self {
        let names = |views: &[usize]| views.iter().map(|&i| data.views[i].name.clone()).collect();
        let (train, test) = (names(&data.split.train), names(&data.split.test));
        Self { train, test, train_crc32: Some(checksum(data)), ..Self::default() }
    }

    /// Whether the data show, under the same names, other training views than those of the run.
    pub fn has_other_views_than(&self, data: &Dataset) -> bool {
        self.train_crc32.as_ref().is_some_and(|was| *was != checksum(data))
    }

    /// How the data are called in messages.
    pub fn name(&self) -> String {
        self.path.as_ref().map_or_else(|| "data in memory".to_owned(), |p| p.display().to_string())
    }
}

/// Of what training sees of data, as far as it is in memory.
fn checksum(data: &Dataset) -> String {
    let mut sum = crc32fast::Hasher::new();
    for view in data.split.train.iter().map(|&k| &data.views[k]) {
        // Nine decimals: machines whose sines differ in the last bit agree.
        sum.update(format!("{:.9?} {:?}", view.camera, view.mask_meaning).as_bytes());
        if let PhotoSource::Memory(photo) = &view.source {
            match &photo.image.pixels {
                Pixels::U8(pixels) => sum.update(pixels),
                Pixels::F32(pixels) => pixels.iter().for_each(|v| sum.update(&v.to_le_bytes())),
            }
            photo.mask.iter().for_each(|mask| sum.update(&mask.coverage));
        }
    }
    format!("{:08x}", sum.finalize())
}

/// A run: everything needed to render it or to go on training.
#[derive(Clone, Debug)]
pub struct Run {
    /// Its options.
    pub options: Options,
    /// Its plan.
    pub plan: Plan,
    /// Where it stands.
    pub state: State,
    /// What it was trained on.
    pub source: Source,
    /// Its parameters.
    pub model: Model,
    /// The state of its optimiser.
    pub optimiser: Optimiser,
    /// What was found without masks.
    pub detected: Option<Gate>,
    /// What its photographs themselves have learned.
    pub alignment: Alignment,
}

/// A run that somebody else holds: saving copies nothing.
#[derive(Clone, Copy, Debug)]
pub struct RunRef<'a> {
    /// See [`Run`].
    pub options: &'a Options,
    /// See [`Run`].
    pub plan: &'a Plan,
    /// See [`Run`].
    pub state: &'a State,
    /// See [`Run`].
    pub source: &'a Source,
    /// See [`Run`].
    pub model: &'a Model,
    /// See [`Run`].
    pub optimiser: &'a Optimiser,
    /// See [`Run`].
    pub detected: Option<&'a Gate>,
    /// See [`Run`].
    pub alignment: &'a Alignment,
}

impl RunRef<'_> {
    /// Whether the run has reached its end.
    pub(crate) fn is_finished(&self) -> bool {
        Progress::of(self.options, self.state.step, self.state.seconds).0 >= 1.0
    }

    /// A copy.
    pub fn to_owned(&self) -> Run {
        Run {
            options: self.options.clone(),
            plan: self.plan.clone(),
            state: self.state.clone(),
            source: self.source.clone(),
            model: self.model.clone(),
            optimiser: self.optimiser.clone(),
            detected: self.detected.cloned(),
            alignment: self.alignment.clone(),
        }
    }

    /// Save the run in a folder, atomically: an earlier checkpoint there is whole until the new one is.
    pub fn save(&self, folder: &Path) -> Result<(), CheckpointError> {
        let path = folder.join(CHECKPOINT);
        self.with_tensors(&path, |header, tensors| checkpoint::save(&path, header, tensors))
    }

    /// Write the same bytes anywhere.
    pub fn write(&self, to: &mut dyn Write) -> Result<(), CheckpointError> {
        let path = PathBuf::from("(a stream)");
        self.with_tensors(&path, |header, tensors| checkpoint::write(to, header, tensors))
    }

    fn with_tensors(
        &self,
        path: &Path,
        write: impl FnOnce(&serde_json::Value, &[(&str, checkpoint::TensorView)]) -> Result<(), CheckpointError>,
    ) -> Result<(), CheckpointError> {
        let header = serde_json::to_value(Header::of(self));
        let header =
            header.map_err(|e| CheckpointError::Foreign { path: path.to_owned(), found: e.to_string() })?;
        let (model, optimiser) = (self.model, self.optimiser);
        let small = [
            refraction::tensors(model, optimiser),
            reflection::tensors(model, optimiser),
            clearcoat::tensors(model, optimiser),
        ]
        .concat();
        let (detected, views) = (detected::tensor(self.detected), views::tensors(self.alignment));
        let shapes = Shapes::of(self);
        let mut tensors = shapes.tensors(self);
        let named = small.iter().chain(&detected).chain(&views);
        tensors.extend(named.map(|(name, tensor)| (name.as_str(), tensor.view())));
        write(&header, &tensors)
    }
}

impl Run {
    /// Read a run back from its folder.
    pub fn load(folder: &Path) -> Result<Self, CheckpointError> {
        let path = folder.join(CHECKPOINT);
        Self::restore(Tensors::new(TensorFile::load(&path)?, path))
    }

    /// Read a run back from anywhere; the stream is read to its end.
    pub fn read(from: impl Read) -> Result<Self, CheckpointError> {
        let path = PathBuf::from("(a stream)");
        Self::restore(Tensors::new(TensorFile::read(from, &path)?, path))
    }

    /// The run without its ownership.
    pub fn view(&self) -> RunRef<'_> {
        let Self { options, plan, state, source, model, optimiser, detected, alignment } = self;
        let detected = detected.as_ref();
        RunRef { options, plan, state, source, model, optimiser, detected, alignment }
    }

    fn restore(mut file: Tensors) -> Result<Self, CheckpointError> {
        let header: Header = serde_json::from_value(file.header())
            .map_err(|e| file.wrong(&format!("its header does not fit: {e}")))?;
        let options = header.options.clone().checked();
        options.map_err(|e| file.wrong(&format!("its options make no sense: {e}")))?;
        // NaN is not within either.
        let most_shift = 2.0 * crate::refraction_search::MASK_MARGIN as f32;
        let is_within = header.state.mask_shift.abs() <= most_shift;
        if !is_within {
            return Err(file.wrong(&format!(
                "it moves masks by {} pixels, at most {most_shift} make sense",
                header.state.mask_shift
            )));
        }
        let plan = header.plan();
        field::check_resolution(&header, &file)?;
        plan.check().map_err(|e| file.wrong(&e.to_string()))?;
        let field = field::restore(&header, &mut file)?;
        let (background, texel_moments) = field::restore_background(&header, &mut file)?;
        let (refraction, index) = refraction::restore(&header.regions, &header.options, &mut file)?;
        let (reflection, mirrors) = reflection::restore(&header.reflection, &refraction, &mut file)?;
        let (clearcoat, clearcoat_moments) =
            clearcoat::restore(header.clearcoat.as_ref(), field.domain.bounds, &mut file)?;
        let voxels = field.map.voxels();
        let optimiser = Optimiser {
            density: file.mean_squares("density_moment", voxels)?,
            colour: file.mean_squares("colour_moment", voxels)?,
            background: texel_moments,
            index,
            reflection: mirrors,
            clearcoat: clearcoat_moments,
            occupied: file.u64s("occupied")?,
        };
        let model = Model { field, background, refraction, reflection, clearcoat };
        if !optimiser.fits(&model) {
            return Err(file.wrong("its occupied cells or moments are not those of its parameters"));
        }
        let detected = detected::restore(header.detected.as_ref(), &mut file)?;
        let alignment = views::restore(&header.views, header.source.train.len(), &mut file)?;
        let Header { options, state, source, .. } = header;
        Ok(Self { options, plan, state, source, model, optimiser, detected, alignment })
    }
}

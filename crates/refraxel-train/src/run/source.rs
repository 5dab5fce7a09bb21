//! The data of a run, and how to know them again.

use refraxel_core::Vec3;
use refraxel_data::{
    AlphaMeaning, Backdrop, Crop, Dataset, MaskMeaning, OpenOptions, Orientation, PhotoSource, Pixels,
};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Which data a run was trained on, and how they were read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Source {
    /// Folder or file of the dataset, absolute; absent where the data were in memory.
    pub path: Option<PathBuf>,
    /// `--holdout`.
    pub holdout: Option<usize>,
    /// `--backdrop`: "surroundings", "transparent" or "#rrggbb".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub backdrop: Option<String>,
    /// `--alpha`: "backdrop", "mask" or "ignore".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alpha: Option<String>,
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
    /// `--orientation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation: Option<Orientation>,
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
    /// What reading the data decided and found; absent from runs of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub read: Option<Read>,
}

/// What reading a dataset decided and found, as `refraxel inspect` says it of the dataset.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Read {
    /// The format of its files.
    pub format: String,
    /// The rule that made the split.
    pub split: String,
    /// What lies behind the scene.
    pub backdrop: String,
    /// What white means in the masks, where there are any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub masks: Option<String>,
    /// Severity and sentence of each note and warning, in the order found.
    pub findings: Vec<[String; 2]>,
}

impl Read {
    fn of(data: &Dataset) -> Self {
        let findings = data.problems.iter().map(|p| [p.severity.name().to_owned(), p.message.clone()]);
        let masked = data.views.iter().find(|view| view.has_mask());
        Self {
            format: data.format.name().to_owned(),
            split: data.split.rule.clone(),
            backdrop: data.backdrop.to_string(),
            masks: masked.map(|view| view.mask_meaning.name().to_owned()),
            findings: findings.collect(),
        }
    }
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
        Self { train, test, train_crc32: Some(checksum(data)), read: Some(Read::of(data)), ..Self::default() }
    }

    /// The data of a folder or file, and how they were read. `path` is absolute.
    pub fn of_files(path: PathBuf, options: &OpenOptions, data: &Dataset) -> Self {
        Self {
            path: Some(path),
            holdout: options.holdout,
            backdrop: options.backdrop.map(|b| b.to_string()),
            alpha: options.alpha.map(|a| a.to_string()),
            mask_meaning: options.mask_meaning.map(|m| m.name().to_owned()),
            allow_outside: options.allow_outside,
            orientation: options.orientation,
            crop: Some(options.crop).filter(|crop| !crop.is_none()),
            up: options.up.map(Vec3::to_array),
            ..Self::of(data)
        }
    }

    /// The options by which the data are read again in the same way, but for the origin.
    pub fn open_options(&self) -> OpenOptions {
        OpenOptions {
            holdout: self.holdout,
            allow_outside: self.allow_outside,
            backdrop: self.backdrop(),
            alpha: self.alpha(),
            mask_meaning: self.mask_meaning.as_deref().and_then(MaskMeaning::named),
            orientation: self.orientation,
            crop: self.crop.unwrap_or_default(),
            up: self.up.map(Vec3::from),
            origin: None,
        }
    }

    /// Whether the data show, under the same names, other training views than those of the run.
    pub fn has_other_views_than(&self, data: &Dataset) -> bool {
        self.train_crc32.as_ref().is_some_and(|was| *was != checksum(data))
    }

    /// `--backdrop`.
    pub fn backdrop(&self) -> Option<Backdrop> {
        self.backdrop.as_deref()?.parse().ok()
    }

    /// `--alpha`.
    pub fn alpha(&self) -> Option<AlphaMeaning> {
        self.alpha.as_deref()?.parse().ok()
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

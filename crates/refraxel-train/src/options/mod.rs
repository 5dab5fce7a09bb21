//! Options of a run, in sections. Every option has its meaning, default and range in the file of its section; `--set`,
//! TOML files, the checks and the list of `refraxel train --options` all come from there.

mod clearcoat;
mod detection;
mod error;
mod exposure;
mod field;
mod gone;
mod grid;
mod index;
mod judge;
mod list;
mod march;
mod names;
mod pose;
mod reflection;
mod refraction;
mod run;
mod search;
mod section;
mod shape;
mod stored;
mod surface;
#[cfg(test)]
mod tests;
mod value;

pub use clearcoat::ClearcoatOptions;
pub use detection::DetectionOptions;
pub use error::OptionError;
pub use exposure::ExposureOptions;
pub use field::FieldOptions;
pub use grid::GridOptions;
pub use index::{IndexIntegrator, IndexInterpolation, IndexOptions, IndexPenalty};
pub use judge::JudgeOptions;
pub use list::{OptionInfo, list, list_as_markdown, list_as_text};
pub use march::MarchOptions;
pub use pose::PoseOptions;
pub use reflection::ReflectionOptions;
pub use refraction::RefractionOptions;
pub use run::RunOptions;
pub use search::{SearchOptions, SurfaceProfile};
pub use section::{Definition, Section};
pub use shape::{ShapeOptions, StartShape};
pub use surface::SurfaceOptions;
pub use value::{Allowed, OptionValue, Switch, Word};

use crate::model::Optics;
use serde::{Deserialize, Serialize};

/// What training should do.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "serde_json::Value")]
pub struct Options {
    /// How long the run takes, and what it may use.
    pub run: RunOptions,
    /// The grid of the radiance field.
    pub grid: GridOptions,
    /// How rays sample it.
    pub march: MarchOptions,
    /// Density, colour and background.
    pub field: FieldOptions,
    /// Whether, where and when rays bend.
    pub refraction: RefractionOptions,
    /// The refractive shape to start from.
    pub shape: ShapeOptions,
    /// The search for the first index.
    pub search: SearchOptions,
    /// How refractive things are sought without masks.
    pub detection: DetectionOptions,
    /// The race between hypotheses.
    pub judge: JudgeOptions,
    /// How poses learn.
    pub pose: PoseOptions,
    /// Whether exposures learn.
    pub exposure: ExposureOptions,
    /// How the index learns.
    pub index: IndexOptions,
    /// How sharp surfaces learn.
    pub surface: SurfaceOptions,
    /// Reflection at refractive surfaces.
    pub reflection: ReflectionOptions,
    /// The clearcoat of opaque things.
    pub clearcoat: ClearcoatOptions,
}

/// An option that differs between two runs, and the text of its value in both.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its full name.
    pub name: &'static str,
    /// Its value here.
    pub here: String,
    /// Its value there.
    pub there: String,
}

impl Options {
    /// Defaults for a kind of scene. Photographs of open surroundings are fewer and cover everything more thinly than
    /// pictures of an object before a plain background: they need slower density and more smoothness. Rays are long there, and most of
    /// their samples lie in haze, so they end sooner.
    pub fn suited_to(unbounded: bool) -> Self {
        let mut options = Self::default();
        if unbounded {
            options.field.rate_density = 0.3;
            options.field.tv_density = 1e-4;
            options.field.tv_colour = 1e-4;
            options.march.min_transmittance = 0.01;
        }
        options
    }

    /// All sections, in the order in which they are listed.
    pub fn sections(&self) -> [&dyn Section; 15] {
        let Self {
            run,
            grid,
            march,
            field,
            refraction,
            shape,
            search,
            detection,
            judge,
            pose,
            exposure,
            index,
            surface,
            reflection,
            clearcoat,
        } = self;
        [
            run, grid, march, field, refraction, shape, search, detection, judge, pose, exposure, index,
            surface, reflection, clearcoat,
        ]
    }

    fn sections_mut(&mut self) -> [&mut dyn Section; 15] {
        let Self {
            run,
            grid,
            march,
            field,
            refraction,
            shape,
            search,
            detection,
            judge,
            pose,
            exposure,
            index,
            surface,
            reflection,
            clearcoat,
        } = self;
        [
            run, grid, march, field, refraction, shape, search, detection, judge, pose, exposure, index,
            surface, reflection, clearcoat,
        ]
    }

    /// What there is to know of each option, but its value.
    pub fn definitions() -> Vec<Definition> {
        Self::default().sections().iter().flat_map(|section| section.definitions()).collect()
    }

    /// The texts of all values, in the order of [`Options::definitions`].
    pub fn values(&self) -> Vec<String> {
        self.sections().iter().flat_map(|section| section.values()).collect()
    }

    /// Changes one option, as `--set KEY=TEXT` does. The key is a full name, or a key that only one section has.
    pub fn set(&mut self, key: &str, text: &str) -> Result<(), OptionError> {
        let option = names::find(key)?;
        let name = option.name.split('.').next();
        for section in self.sections_mut() {
            if Some(section.name()) == name {
                section.set(&option, text)?;
            }
        }
        Ok(())
    }

    /// The same options, if every value is allowed and they fit together.
    pub fn checked(self) -> Result<Self, OptionError> {
        self.sections().iter().try_for_each(|section| section.check())?;
        Ok(self)
    }

    /// The options whose values differ from those of others.
    pub fn differences(&self, others: &Self) -> Vec<Difference> {
        let values = self.values().into_iter().zip(others.values());
        let named = Self::definitions().into_iter().zip(values);
        let different = named.filter(|(_, (here, there))| here != there);
        different.map(|(option, (here, there))| Difference { name: option.name, here, there }).collect()
    }

    /// How rays are traced through the index.
    pub fn optics(&self) -> Optics {
        let IndexOptions { integrator, step, .. } = self.index;
        Optics { integrator: integrator.into(), step }
    }
}

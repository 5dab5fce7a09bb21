//! All options of a run, section by section.

use super::clearcoat::ClearcoatOptions;
use super::detection::DetectionOptions;
use super::error::OptionError;
use super::exposure::ExposureOptions;
use super::field::FieldOptions;
use super::grid::GridOptions;
use super::index::IndexOptions;
use super::judge::JudgeOptions;
use super::march::MarchOptions;
use super::pose::PoseOptions;
use super::reflection::ReflectionOptions;
use super::refraction::RefractionOptions;
use super::run::RunOptions;
use super::search::SearchOptions;
use super::section::{Definition, Section};
use super::shape::ShapeOptions;
use super::surface::SurfaceOptions;
use crate::model::Optics;
use refraxel_core::Extent;
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

/// References to all sections of borrowed options.
macro_rules! in_order {
    ($options:ident) => {{
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
        } = $options;
        [
            run, grid, march, field, refraction, shape, search, detection, judge, pose, exposure, index,
            surface, reflection, clearcoat,
        ]
    }};
}

/// Largest resolution where masks or a file say that something refracts [node].
const TOLD: u32 = 256;

impl Options {
    /// Defaults for a kind of scene. Photographs of surroundings are fewer and cover everything more thinly than
    /// pictures of an object before a plain background: they need smoother and slower density, which could rise in front
    /// of a camera. Rays are long there, and most of their samples lie in haze, so they end sooner, and a coarser grid
    /// clears it first. Cameras that all look one way see most voxels, so that more can be pruned, and colour can be as
    /// sharp as the pictures.
    ///
    /// `is_told`: masks or a file say that something refracts. Few pixels see what is behind it: a finer grid learns that later,
    /// and its density needs more smoothness.
    pub fn suited_to(extent: Extent, is_told: bool) -> Self {
        let mut options = Self::default();
        match extent {
            Extent::Bounded if is_told => {}
            Extent::Bounded => options.field.tv_density = 2e-6,
            Extent::Contracted => {
                options.field.rate_density = 0.3;
                options.field.tv_density = 1e-4;
            }
            Extent::Projective(_) => {
                options.field.tv_colour = 1e-6;
                if !is_told {
                    options.grid.prune_weight = 0.05;
                }
            }
        }
        if is_told {
            options.grid.max_resolution = TOLD;
        }
        if extent.is_unbounded() {
            options.grid.stages = 4;
            options.march.min_transmittance = 0.01;
        }
        options
    }

    /// All sections, in the order in which they are listed.
    pub fn sections(&self) -> [&dyn Section; 15] {
        in_order!(self)
    }

    pub(super) fn sections_mut(&mut self) -> [&mut dyn Section; 15] {
        in_order!(self)
    }

    /// What there is to know of each option, but its value.
    pub fn definitions() -> Vec<Definition> {
        Self::default().sections().iter().flat_map(|section| section.definitions()).collect()
    }

    /// The texts of all values, in the order of [`Options::definitions`].
    pub fn values(&self) -> Vec<String> {
        self.sections().iter().flat_map(|section| section.values()).collect()
    }

    /// The same options, if every value is allowed and they fit together.
    pub fn checked(self) -> Result<Self, OptionError> {
        self.sections().iter().try_for_each(|section| section.check())?;
        Ok(self)
    }

    /// How rays are traced through the index.
    pub fn optics(&self) -> Optics {
        let IndexOptions { integrator, step, .. } = self.index;
        Optics { integrator: integrator.into(), step }
    }
}

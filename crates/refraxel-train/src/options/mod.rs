//! Options of a run, in sections. Every option has its meaning, default and range in the file of its section; `--set`,
//! TOML files, the checks and the list of `refraxel train --options` all come from there.

mod clearcoat;
mod detection;
mod difference;
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
mod sections;
mod shape;
mod stored;
mod surface;
#[cfg(test)]
mod tests;
mod value;

pub use clearcoat::ClearcoatOptions;
pub use detection::DetectionOptions;
pub use difference::Difference;
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
pub use sections::Options;
pub use shape::{ShapeOptions, StartShape};
pub use surface::SurfaceOptions;
pub use value::{Allowed, OptionValue, Switch, Word};

//! The command line: every verb and flag, with examples. What a verb does lives in a file of its own.

mod data;
mod import;
mod mask;
mod renderer;
mod run;
mod scene;
mod sweep;
mod values;
mod verbs;
mod view;
mod work;

pub use data::{ForecastArgs, InspectArgs, ReadingArgs, Refraction, TrainArgs};
pub use import::{ImportArgs, Matching};
pub use mask::MaskArgs;
pub use renderer::RendererArgs;
pub use run::{CompareArgs, EvalArgs, ExportArgs, ExportFormat, Layer, RenderArgs};
pub use scene::{BenchArgs, DemoArgs, SynthArgs};
pub use sweep::SweepArgs;
pub use values::Setting;
pub use verbs::{Cli, Verb};
pub use view::ViewArgs;
pub use work::WorkArgs;

#[cfg(test)]
mod tests;

//! Posed photographs: importers, images, masks, splits and what is wrong with them.

pub mod dataset;
pub mod image;
pub mod synth;

pub use dataset::{Backdrop, Dataset, Format, MaskMeaning, Photo, Problem, Severity, Split, View};
pub use image::{Image, Mask, Pixels};

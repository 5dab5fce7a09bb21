//! A page to share: one file with the quantised scene, the renderer of `viewer/share`, and a picture for browsers without WebGPU.

mod field;
mod pack;
mod page;
mod regions;
mod still;
mod template;

pub use page::{Page, write};

//! Tiny datasets, and the built program run on them.
#![allow(dead_code, unused_imports)] // each test file uses its part

mod datasets;
mod files;
mod program;
pub mod running;

pub use datasets::{ball, glass, photographs, refractive};
pub use files::{is_without_files, path, write_image};
pub use program::{Ran, TINY, command, refraxel, train};

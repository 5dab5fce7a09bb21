//! Tiny datasets, and the built program run on them.
#![allow(dead_code, unused_imports)] // each test file uses its part

mod datasets;
mod files;
mod program;
pub mod running;

pub use datasets::{ball, ball_and, glass, photographs, refractive};
pub use files::{is_without_files, json_of, path, write_image};
pub use program::{Ran, TINY, command, refraxel, train, train_with_index};

//! Paths, images and folders.

use serde_json::Value;
use std::path::Path;

pub fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}

pub fn write_image(path: &Path, width: u32, height: u32) {
    let pixel = |x: u32, y: u32| image::Rgb([(x * 15) as u8, (y * 15) as u8, 90]);
    image::RgbImage::from_fn(width, height, pixel).save(path).unwrap();
}

/// What a file of JSON says.
pub fn json_of(file: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(file).unwrap()).unwrap()
}

/// No file lies in the folder or below it.
pub fn is_without_files(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return true };
    entries.map(|e| e.unwrap().path()).all(|p| p.is_dir() && is_without_files(&p))
}

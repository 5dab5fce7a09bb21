//! No file, however damaged, makes an importer panic, hang or ask for absurd memory; what is refused is named.

mod fixture;

use fixture::damage::{damage, for_each_case};
use fixture::valid::{DESCRIPTIONS, INDICES, PICTURES, Valid};
use fixture::*;
use refraxel_core::{Aabb, Vec3};
use refraxel_data::{Dataset, IndexSource, OpenOptions, report};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with a valid file, and its path and content.
fn written(valid: &Valid) -> (TempDir, PathBuf, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    (valid.write)(folder.path());
    let path = folder.path().join(valid.file);
    let content = std::fs::read(&path).unwrap();
    (folder, path, content)
}

/// Reads all of a dataset. A refusal must name a file.
fn read(folder: &Path) -> Result<(), String> {
    let read = || {
        let data = Dataset::open(folder, &OpenOptions::default())?;
        report(&data);
        data.load_photos(&(0..data.views.len()).collect::<Vec<_>>(), |_| {}).map(drop)
    };
    read().map_err(|error| named(folder, &error.to_string()))
}

/// Reads the index of a file, of which an `.npy` does not say where it is. A refusal must name it.
fn read_index(file: &Path) -> Result<(), String> {
    let is_npy = file.extension().is_some_and(|e| e == "npy");
    let unit = Aabb::new(Vec3::splat(-0.5), Vec3::splat(0.5));
    IndexSource::read(file, is_npy.then_some(unit)).map(drop).map_err(|error| named(file, &error.to_string()))
}

fn named(path: &Path, message: &str) -> String {
    assert!(message.contains(path.to_str().unwrap()), "this names no file: {message}");
    message.to_owned()
}

#[test]
fn files_cut_at_any_byte_never_panic() {
    for valid in &DESCRIPTIONS {
        let (folder, path, whole) = written(valid);
        for cut in 0..whole.len() {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let _ = read(folder.path());
        }
    }
}

#[test]
fn damaged_datasets_are_read_or_refused_by_name() {
    for valid in DESCRIPTIONS.iter().chain(&PICTURES) {
        let (folder, path, whole) = written(valid);
        assert_eq!(read(folder.path()), Ok(()), "{}", valid.name);
        for_each_case(valid.name, 64, damage(valid.kind), |damage| {
            std::fs::write(&path, damage.of(&whole)).unwrap();
            let _ = read(folder.path());
        });
    }
}

#[test]
fn damaged_indices_are_read_or_refused_by_name() {
    for valid in &INDICES {
        let (_folder, path, whole) = written(valid);
        assert_eq!(read_index(&path), Ok(()), "{}", valid.name);
        for_each_case(valid.name, 128, damage(valid.kind), |damage| {
            std::fs::write(&path, damage.of(&whole)).unwrap();
            let _ = read_index(&path);
        });
    }
}

#[test]
fn a_count_beyond_the_file_is_an_error_not_an_allocation() {
    let valid = DESCRIPTIONS.iter().find(|valid| valid.name == "colmap-cameras-bin").unwrap();
    let folder = written(valid).0;
    for (file, at) in [("cameras", 0), ("images", 0), ("points3D", 0), ("images", 82)] {
        let path = folder.path().join(format!("sparse/0/{file}.bin"));
        let whole = std::fs::read(&path).unwrap();
        let mut damaged = whole.clone();
        damaged[at..at + 8].copy_from_slice(&(u64::MAX / 3).to_le_bytes());
        std::fs::write(&path, damaged).unwrap();
        // Points only help.
        let warning = |data: Dataset| {
            data.problems.iter().map(|p| p.message.clone()).find(|m| m.contains(file)).unwrap()
        };
        let message = if file == "points3D" { warning(open(&folder).unwrap()) } else { refusal(&folder) };
        assert!(message.contains(file) && message.contains("byte"), "{message}");
        std::fs::write(&path, whole).unwrap();
    }
}

//! NSVF: `pose/NAME.txt` (camera to world, OpenCV axes), `rgb/NAME.png`, `intrinsics.txt`, `bbox.txt`. ScanNet has the same poses, and
//! `color/NAME.jpg` and `intrinsic/intrinsic_color.txt`.

use super::beside::frame;
use crate::folder::{file_in, folder_in, names};
use crate::parsed::{Focal, Frame, Intrinsics, Loss, Origin, ParsedDataset};
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, limits, pose};
use refraxel_core::{Aabb, Lens, vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The pose folder of an NSVF dataset.
pub(crate) fn pose_folder(folder: &Path) -> Option<PathBuf> {
    let found = ["pose", "poses"].into_iter().find_map(|name| folder_in(folder, name));
    found.filter(|_| intrinsics_file(folder).is_some())
}

fn intrinsics_file(folder: &Path) -> Option<PathBuf> {
    let of_scannet = || file_in(&folder_in(folder, "intrinsic")?, "intrinsic_color.txt");
    file_in(folder, "intrinsics.txt").or_else(of_scannet)
}

/// Reads the folder whose poses are in `poses`.
pub(crate) fn read(folder: &Path, poses: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::below(folder, Format::Nsvf, options)?;
    let intrinsics = intrinsics(&intrinsics_file(folder).unwrap_or_default())?;
    let mut names = names(poses)?;
    names.retain(|name| name.to_ascii_lowercase().ends_with(".txt"));
    limits::frames(poses, names.len())?;
    let stems: Vec<&str> = names.iter().map(|name| &name[..name.len() - ".txt".len()]).collect();
    let images = image_folder(&parsed.root, &stems);
    let mut transposed = 0;
    for (name, stem) in names.iter().zip(stems) {
        let path = poses.join(name);
        let (file, rows) = (format!("{images}/{stem}"), numbers(&path)?);
        let origin = Origin { path: Arc::new(path), key: "matrix".into() };
        if rows.iter().take(12).all(|v| !v.is_finite()) {
            parsed.frames.push(Frame::lost(origin, file, Loss::NoPose));
            continue;
        }
        let path = &origin.path;
        refuse_infinite(path, &rows)?;
        let rows = matrix(&rows).ok_or_else(|| wrong(path, "a 4x4 matrix (camera to world)", rows.len()))?;
        let (rows, is_transposed) = pose::rows_or_columns(rows);
        transposed += usize::from(is_transposed);
        let image = parsed.root.find_below(&images, stem, Statement { path, key: "name" })?;
        parsed.frames.push(frame(origin, file, image, intrinsics, pose::from_opencv(rows)));
    }
    parsed.problems.extend(pose::transposed(poses, transposed));
    parsed.stated_box = stated_box(folder)?;
    Ok(parsed)
}

/// The folder that holds most of the images.
fn image_folder(root: &Root, stems: &[&str]) -> String {
    let held = |name: &String| stems.iter().filter(|stem| root.has_below(name, stem)).count();
    let usual =
        ["rgb", "images", "image", "color"].into_iter().filter_map(|name| folder_in(root.folder(), name));
    let usual = usual.filter_map(|folder| Some(folder.file_name()?.to_str()?.to_owned()));
    // Of equal ones, the first.
    let usual: Vec<String> = usual.collect();
    usual.into_iter().rev().max_by_key(held).unwrap_or_else(|| "rgb".to_owned())
}

/// A 3×3 or 4×4 matrix, or a first line `f cx cy …`.
fn intrinsics(path: &Path) -> Result<Intrinsics, DataError> {
    let values = numbers(path)?;
    refuse_infinite(path, &values)?;
    let (focal, center) = match values[..] {
        [fx, _, cx, _, fy, cy, _, _, _] => ([fx, fy], [cx, cy]),
        [fx, _, cx, _, _, fy, cy, _, ..] if values.len() == 16 => ([fx, fy], [cx, cy]),
        [f, cx, cy, ..] => ([f, f], [cx, cy]),
        _ => return Err(wrong(path, "a 3x3 or 4x4 matrix, or f cx cy", values.len())),
    };
    Ok(Intrinsics { size: None, focal: Focal::Pixels(focal), center: Some(center), lens: Lens::Pinhole })
}

/// `xmin ymin zmin xmax ymax zmax voxel`.
fn stated_box(folder: &Path) -> Result<Option<Aabb<f64>>, DataError> {
    let Some(path) = &file_in(folder, "bbox.txt") else { return Ok(None) };
    let values = numbers(path)?;
    refuse_infinite(path, &values)?;
    let bounds = match values[..] {
        [a, b, c, d, e, f, ..] => Aabb::new(vec3(a, b, c), vec3(d, e, f)),
        _ => return Err(wrong(path, "xmin ymin zmin xmax ymax zmax", values.len())),
    };
    let solid = bounds.extent().min_element() > 0.0;
    solid
        .then_some(Some(bounds))
        .ok_or_else(|| wrong(path, "a box whose max is beyond its min", values.len()))
}

/// The rows of a 3×4 or 4×4 matrix.
fn matrix(values: &[f64]) -> Option<[[f64; 4]; 4]> {
    let (rows, []) = values.as_chunks() else { return None };
    match *rows {
        [a, b, c] => Some([a, b, c, [0.0, 0.0, 0.0, 1.0]]),
        [a, b, c, d] => Some([a, b, c, d]),
        _ => None,
    }
}

/// All numbers of a text file, among them NaN and infinity.
fn numbers(path: &Path) -> Result<Vec<f64>, DataError> {
    let text = limits::read_text(path)?;
    text.split_whitespace().map(|word| word.parse().map_err(|_| not_a_number(path, word))).collect()
}

fn refuse_infinite(path: &Path, values: &[f64]) -> Result<(), DataError> {
    let infinite = values.iter().find(|v| !v.is_finite());
    infinite.map_or(Ok(()), |v| Err(not_a_number(path, &v.to_string())))
}

fn not_a_number(path: &Path, word: &str) -> DataError {
    let (path, key) = (path.to_owned(), "a word".into());
    let found = format!("{:?}", word.chars().take(40).collect::<String>());
    DataError::Value { path, key, found, expected: "a finite number" }
}

fn wrong(path: &Path, expected: &'static str, found: usize) -> DataError {
    let found = format!("{found} numbers");
    DataError::Value { path: path.to_owned(), key: "content".into(), found, expected }
}

//! NSVF: `pose/NAME.txt` (camera to world, OpenCV axes), `rgb/NAME.png`, `intrinsics.txt`, `bbox.txt`.

use super::folder::names;
use crate::parsed::{Focal, Frame, Intrinsics, Origin, ParsedDataset, Part};
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, limits, pose};
use refraxel_core::{Aabb, Lens, vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which views are held out of a dataset whose names have no prefix (svox2).
const HOLDOUT: usize = 16;

/// The pose folder of an NSVF dataset.
pub(crate) fn pose_folder(folder: &Path) -> Option<PathBuf> {
    let found = ["pose", "poses"].map(|name| folder.join(name)).into_iter().find(|p| p.is_dir());
    found.filter(|_| folder.join("intrinsics.txt").is_file())
}

/// Reads the folder whose poses are in `poses`.
pub(crate) fn read(folder: &Path, poses: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::new(Root::new(folder, options.allow_outside)?, Format::Nsvf);
    let intrinsics = intrinsics(&folder.join("intrinsics.txt"))?;
    let images =
        ["rgb", "images", "image"].into_iter().find(|name| folder.join(name).is_dir()).unwrap_or("rgb");
    let mut names = names(poses)?;
    names.retain(|name| name.ends_with(".txt"));
    limits::frames(poses, names.len())?;
    for name in &names {
        let path = poses.join(name);
        let stem = name.trim_end_matches(".txt");
        let rows = numbers(&path)?;
        let rows = matrix(&rows).ok_or_else(|| wrong(&path, "a 4x4 matrix (camera to world)", rows.len()))?;
        let origin = Origin { path: Arc::new(path), key: "matrix".into() };
        let image = parsed.root.find_below(images, stem, Statement { path: &origin.path, key: "name" })?;
        let (file, pose) = (format!("{images}/{stem}"), pose::from_opencv(rows));
        parsed.frames.push(Frame { origin, file, image, mask: None, part: None, intrinsics, pose });
    }
    parsed.split_rule = Some(split(&mut parsed.frames));
    parsed.stated_box = stated_box(&folder.join("bbox.txt"))?;
    Ok(parsed)
}

/// Prefixes 0_, 1_, 2_ mean train, val, test; without 2_ the validation views are the test; without any, every 16th.
fn split(frames: &mut [Frame]) -> String {
    let stem = |f: &Frame| f.file.rsplit('/').next().unwrap_or_default().to_owned();
    let of = |prefix: &str, frames: &[Frame]| frames.iter().any(|f| stem(f).starts_with(prefix));
    let (prefixed, has_test) = (of("0_", frames), of("2_", frames));
    for (i, frame) in frames.iter_mut().enumerate() {
        let prefix = stem(frame).chars().next();
        frame.part = Some(match prefix {
            _ if !prefixed && i % HOLDOUT == 0 => Part::Test,
            Some('2') if prefixed => Part::Test,
            Some('1') if prefixed && has_test => Part::Val,
            Some('1') if prefixed => Part::Test,
            _ => Part::Train,
        });
    }
    match (prefixed, has_test) {
        (false, _) => format!("one view in {HOLDOUT}, sorted by name from the first, is held out"),
        (true, true) => "name prefixes 0_ train, 1_ val, 2_ test".to_owned(),
        (true, false) => "name prefixes 0_ train, 1_ test".to_owned(),
    }
}

/// A 3×3 or 4×4 matrix, or a first line `f cx cy …`.
fn intrinsics(path: &Path) -> Result<Intrinsics, DataError> {
    let values = numbers(path)?;
    let (focal, center) = match values[..] {
        [fx, _, cx, _, fy, cy, _, _, _] => ([fx, fy], [cx, cy]),
        [fx, _, cx, _, _, fy, cy, _, ..] if values.len() == 16 => ([fx, fy], [cx, cy]),
        [f, cx, cy, ..] => ([f, f], [cx, cy]),
        _ => return Err(wrong(path, "a 3x3 or 4x4 matrix, or f cx cy", values.len())),
    };
    Ok(Intrinsics { size: None, focal: Focal::Pixels(focal), center: Some(center), lens: Lens::Pinhole })
}

/// `xmin ymin zmin xmax ymax zmax voxel`.
fn stated_box(path: &Path) -> Result<Option<Aabb<f64>>, DataError> {
    if !path.is_file() {
        return Ok(None);
    }
    let values = numbers(path)?;
    let bounds = match values[..] {
        [a, b, c, d, e, f, ..] => Aabb::new(vec3(a, b, c), vec3(d, e, f)),
        _ => return Err(wrong(path, "xmin ymin zmin xmax ymax zmax", values.len())),
    };
    let solid = bounds.extent().min_element() > 0.0;
    solid
        .then_some(Some(bounds))
        .ok_or_else(|| wrong(path, "a box whose max is beyond its min", values.len()))
}

/// The first three rows of a 3×4 or 4×4 matrix.
fn matrix(values: &[f64]) -> Option<[[f64; 4]; 3]> {
    let row = |r: usize| values[4 * r..4 * r + 4].try_into().ok();
    matches!(values.len(), 12 | 16).then(|| Some([row(0)?, row(1)?, row(2)?]))?
}

/// All numbers of a text file.
fn numbers(path: &Path) -> Result<Vec<f64>, DataError> {
    let text = limits::read_text(path)?;
    let parse = |word: &str| {
        word.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| DataError::Value {
            path: path.to_owned(),
            key: "a word".into(),
            found: format!("{:?}", word.chars().take(40).collect::<String>()),
            expected: "a finite number",
        })
    };
    text.split_whitespace().map(parse).collect()
}

fn wrong(path: &Path, expected: &'static str, found: usize) -> DataError {
    let found = format!("{found} numbers");
    DataError::Value { path: path.to_owned(), key: "content".into(), found, expected }
}

//! LLFF `poses_bounds.npy`: one row per image of `images/`, sorted by name.

use super::folder::{is_image, names};
use super::npy::{self, Matrix};
use crate::parsed::{Focal, Frame, Intrinsics, Origin, ParsedDataset};
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, limits};
use refraxel_core::{Lens, Mat3, Pose, Vec3};
use std::path::Path;
use std::sync::Arc;

/// Reads `poses_bounds.npy` and, where it exists (NeX), `hwf_cxcy.npy`.
///
/// Each row is [R | t | (H, W, f)ᵀ] row-major with camera axes (down, right, backwards), then near and far. H, W and f
/// belong to the original images; the images may be smaller.
pub(crate) fn read(folder: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::new(Root::new(folder, options.allow_outside)?, Format::Llff);
    let path = folder.join("poses_bounds.npy");
    let poses = npy::read(&path)?;
    limits::frames(&path, poses.rows)?;
    let shared = folder.join("hwf_cxcy.npy");
    let shared = shared.is_file().then(|| npy::read(&shared)).transpose()?;
    let shape = |expected| DataError::Value {
        path: path.clone(),
        key: "shape".into(),
        found: format!("({}, {})", poses.rows, poses.columns),
        expected,
    };
    match (poses.columns, &shared) {
        (17, None) | (14, Some(_)) => {}
        (_, None) => return Err(shape("(N, 17): pose, size, focal length and depth bounds of N images")),
        (_, Some(_)) => return Err(shape("(N, 14) beside hwf_cxcy.npy")),
    }
    let (image_folder, names) = image_names(folder)?;
    if names.len() != poses.rows {
        return Err(DataError::Value {
            path,
            key: "number of rows".into(),
            found: format!("{}, but {image_folder} holds {} images", poses.rows, names.len()),
            expected: "one row per image; remove the images that were not posed",
        });
    }
    let path = Arc::new(path);
    for (i, (name, row)) in names.iter().zip(poses.values.chunks_exact(poses.columns)).enumerate() {
        let origin = Origin { path: path.clone(), key: format!("row {i}") };
        let image =
            parsed.root.find_below(&image_folder, name, Statement { path: &path, key: &origin.key })?;
        let (pose, intrinsics) = camera(row, shared.as_ref(), &origin)?;
        let file = format!("{image_folder}/{name}");
        parsed.frames.push(Frame { origin, file, image, mask: None, part: None, intrinsics, pose });
    }
    parsed.depth_range = depth_range(&poses);
    Ok(parsed)
}

/// Pose and intrinsics of one row.
fn camera(row: &[f64], shared: Option<&Matrix>, origin: &Origin) -> Result<(Pose, Intrinsics), DataError> {
    let stride = if shared.is_some() { 4 } else { 5 };
    let column = |c: usize| Vec3::new(row[c], row[stride + c], row[2 * stride + c]);
    let [down, right, back] = [column(0), column(1), column(2)];
    let pose = Pose { rotation: Mat3 { columns: [right, down, -back] }, translation: column(3) };
    let (size, focal, center) = match shared.map(|s| s.values.as_slice()) {
        None => ([row[9], row[4]], [row[14]; 2], None),
        Some(&[h, w, f, cx, cy]) => ([w, h], [f; 2], Some([cx, cy])),
        Some(&[h, w, fx, fy, cx, cy]) => ([w, h], [fx, fy], Some([cx, cy])),
        Some(other) => {
            let (path, found) =
                (origin.path.with_file_name("hwf_cxcy.npy"), format!("{} numbers", other.len()));
            return Err(DataError::Value {
                path,
                key: "content".into(),
                found,
                expected: "H W f cx cy, or H W fx fy cx cy",
            });
        }
    };
    if !size.iter().all(|s| (1.0..=1e6).contains(s)) {
        let (path, key) = (origin.path.to_path_buf(), format!("{} (H, W)", origin.key));
        let found = format!("{}, {}", size[1], size[0]);
        return Err(DataError::Value { path, key, found, expected: "an image size in pixels" });
    }
    Ok((pose, Intrinsics { size: Some(size), focal: Focal::Pixels(focal), center, lens: Lens::Pinhole }))
}

fn depth_range(poses: &Matrix) -> Option<[f64; 2]> {
    let rows = poses.values.chunks_exact(poses.columns);
    let range = rows.fold([f64::INFINITY, 0.0], |[near, far], row| {
        let [n, f] = [row[poses.columns - 2], row[poses.columns - 1]];
        [n.min(near), f.max(far)]
    });
    (range[0] > 0.0 && range[0] < range[1] && range[1].is_finite()).then_some(range)
}

/// Image files of `images` or else the first `images_*`, sorted by name as LLFF does.
fn image_names(folder: &Path) -> Result<(String, Vec<String>), DataError> {
    let mut folders = names(folder)?;
    folders.retain(|name| (name == "images" || name.starts_with("images_")) && folder.join(name).is_dir());
    let chosen = folders.first().cloned().unwrap_or_else(|| "images".to_owned());
    let mut names = names(&folder.join(&chosen))?;
    names.retain(|name| is_image(name));
    Ok((chosen, names))
}

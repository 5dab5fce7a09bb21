//! LLFF `poses_bounds.npy`: one row per image of `images/` or a reduced copy of it, sorted by name.

use super::beside::frame;
use super::beside::photographs;
use super::npy::{self, Matrix};
use crate::folder::{file_in, names};
use crate::naming::key;
use crate::parsed::{Focal, Frame, Intrinsics, Loss, Origin, ParsedDataset};
use crate::root::Statement;
use crate::{DataError, Format, OpenOptions, Problem, limits};
use refraxel_core::{Lens, Mat3, Pose, Vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The file of poses of an LLFF dataset.
pub(crate) fn pose_file(folder: &Path) -> Option<PathBuf> {
    file_in(folder, "poses_bounds.npy")
}

/// Reads the folder with this file of poses and, where it exists (NeX), `hwf_cxcy.npy`.
///
/// Each row is [R | t | (H, W, f)ᵀ] row-major with camera axes (down, right, backwards), then near and far. H, W and f
/// belong to the original images; the images may be smaller.
pub(crate) fn read(folder: &Path, path: PathBuf, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::below(folder, Format::Llff, options)?;
    let poses = npy::read(&path)?;
    limits::frames(&path, poses.rows)?;
    let shared = file_in(folder, "hwf_cxcy.npy").map(|shared| npy::read(&shared)).transpose()?;
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
    let photographs = as_many_as(poses.rows, folder, &path)?;
    parsed.problems.extend(photographs.note(poses.rows));
    let path = Arc::new(path);
    for (i, (name, row)) in photographs.names.iter().zip(poses.values.chunks_exact(poses.columns)).enumerate()
    {
        let origin = Origin { path: path.clone(), key: format!("row {i}") };
        let file = format!("{}/{name}", photographs.folder);
        if row[..12].iter().all(|v| v.is_nan()) {
            parsed.frames.push(Frame::lost(origin, file, Loss::NoPose));
            continue;
        }
        let by = Statement { path: &path, key: &origin.key };
        let image = parsed.root.find_below(&photographs.folder, name, by)?;
        let (pose, intrinsics) = camera(row, shared.as_ref(), &origin)?;
        parsed.frames.push(frame(origin, file, image, intrinsics, pose));
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

/// The photographs of a folder, sorted by name as LLFF does.
struct Photographs {
    folder: String,
    names: Vec<String>,
    /// The folders that were looked at before, and how many each holds.
    passed: Vec<(String, usize)>,
}

impl Photographs {
    /// Why the usual folder was not taken.
    fn note(&self, rows: usize) -> Option<Problem> {
        let (usual, count) = self.passed.first()?;
        Some(Problem::warning(format!(
            "{usual} holds {count} images for {rows} poses; those of {}, as many as poses, are used, in the order of \
             their names",
            self.folder
        )))
    }
}

/// Those of `images`, or else of the first `images_*` that holds as many as there are poses.
fn as_many_as(rows: usize, folder: &Path, path: &Path) -> Result<Photographs, DataError> {
    let mut folders = names(folder)?;
    let is_of_images = |name: &str| key(name) == "images" || key(name).starts_with("images_");
    folders.retain(|name| is_of_images(name) && folder.join(name).is_dir());
    let mut passed = Vec::new();
    for name in folders {
        let names = photographs(names(&folder.join(&name))?);
        if names.len() == rows {
            return Ok(Photographs { folder: name, names, passed });
        }
        passed.push((name, names.len()));
    }
    let held: Vec<String> =
        passed.iter().map(|(name, count)| format!("{name} holds {count} images")).collect();
    let held = if held.is_empty() { "there is no folder images".to_owned() } else { held.join(", ") };
    Err(DataError::Value {
        path: path.to_owned(),
        key: "number of rows".into(),
        found: format!("{rows}, but {held}"),
        expected: "one row per image; remove the images that were not posed",
    })
}

//! One frame: its image, mask, intrinsics and pose.

use super::camera;
use crate::json::{self, Object};
use crate::parsed::{Frame, Loss, Origin, StatedMask};
use crate::root::{Root, Statement};
use crate::{DataError, DepthFile, pose, split};
use refraxel_core::Pose;
use serde_json::Value;
use std::path::PathBuf;

/// Where the files lie that frames name, below the dataset's folder.
pub(super) struct Layout {
    pub images: &'static str,
    /// `None` where masks are not used.
    pub masks: Option<&'static str>,
}

impl Layout {
    /// Names are paths.
    pub const USUAL: Self = Self { images: "", masks: Some("") };
}

/// One frame, read.
pub(super) struct Read {
    pub frame: Frame,
    /// A sentence when its focal length is stated twice with different values.
    pub disagreement: Option<String>,
    /// Its matrix is stated transposed.
    pub is_transposed: bool,
}

/// Reads a frame. One without an image or without a pose, as programs write views that they could not pose, is lost.
pub(super) fn read_frame(
    root: &Root,
    frame: Object,
    layout: &Layout,
    origin: Origin,
) -> Result<Read, DataError> {
    let part = split::part_of_view(frame.map()).map(|(part, _)| part);
    let lost = |origin, file, loss| {
        let frame = Frame { part, ..Frame::lost(origin, file, loss) };
        Ok(Read { frame, disagreement: None, is_transposed: false })
    };
    let Some(file) = frame.alone().text("file_path")?.map(str::to_owned) else {
        let name = origin.key.clone();
        return lost(origin, name, Loss::NoName);
    };
    refuse_moving_camera(&frame)?;
    if is_without_pose(&frame) {
        return lost(origin, file, Loss::NoPose);
    }
    let by = Statement { path: frame.path(), key: &frame.key("file_path") };
    let image = match layout.images {
        "" => root.find_photograph(&file, by)?,
        folder => root.find_below(folder, &file, by)?,
    };
    let (intrinsics, disagreement) = camera::intrinsics(&frame)?;
    let (pose, is_transposed) = pose_of(&frame)?;
    let mask = match layout.masks.filter(|_| image.is_some()) {
        Some(folder) => mask(root, folder, &frame)?,
        None => None,
    };
    let depth = if image.is_some() { depth(root, &frame)? } else { None };
    let frame = Frame { origin, file, image, mask, depth, part, intrinsics, pose, lost: None };
    Ok(Read { frame, disagreement, is_transposed })
}

/// Whether the matrix is missing, or nothing in it is a number.
fn is_without_pose(frame: &Object) -> bool {
    let Some(matrix) = frame.get("transform_matrix") else { return true };
    let rows = matrix.as_array().map_or(&[][..], Vec::as_slice);
    let entries = rows.iter().take(3).flat_map(|row| row.as_array().map_or(&[][..], Vec::as_slice));
    !rows.is_empty() && entries.clone().count() > 0 && entries.clone().all(Value::is_null)
}

/// The pose, and whether its matrix is transposed.
fn pose_of(frame: &Object) -> Result<(Pose, bool), DataError> {
    const EXPECTED: &str = "a matrix of 3 or 4 rows with 4 finite numbers each (camera to world)";
    let rows = frame.matrix::<3, 4>("transform_matrix", EXPECTED)?;
    let [a, b, c] = rows.ok_or_else(|| frame.wrong("transform_matrix", EXPECTED))?;
    let last = frame.get("transform_matrix").and_then(|rows| json::row(rows.get(3)?));
    let (rows, is_transposed) = pose::rows_or_columns([a, b, c, last.unwrap_or([0.0, 0.0, 0.0, 1.0])]);
    Ok((pose::from_opengl(rows), is_transposed))
}

/// A camera that moves while it exposes would silently give wrong rays.
fn refuse_moving_camera(frame: &Object) -> Result<(), DataError> {
    let refuse = |key: &str, advice| {
        Err(DataError::UnsupportedFeature { path: frame.path().to_owned(), key: frame.key(key), advice })
    };
    let moving = |v: &Value| v.as_array().is_none_or(|rows| rows.iter().any(|x| x.as_f64() != Some(0.0)));
    if frame.get("rolling_shutter").is_some_and(moving) {
        return refuse(
            "rolling_shutter",
            "export the frames with a global shutter, or set it to zeros to ignore it",
        );
    }
    if frame.get("transform_matrix_start") != frame.get("transform_matrix_end") {
        return refuse(
            "transform_matrix_start",
            "motion blur between two poses is not modelled; give transform_matrix",
        );
    }
    Ok(())
}

/// The mask a frame names: nerfstudio's `mask_path` (black = ignore, but segmenters mark objects by white) or RefRef's
/// `mask_file_path`.
fn mask(root: &Root, folder: &str, frame: &Object) -> Result<Option<(PathBuf, StatedMask)>, DataError> {
    let keys = [("mask_path", StatedMask::Shown), ("mask_file_path", StatedMask::Open)];
    for (key, meaning) in keys {
        if let Some(stated) = frame.text(key)? {
            let place = frame.key(key);
            let by = Statement { path: frame.path(), key: &place };
            let found = match folder {
                "" => root.find(stated, by)?,
                folder => root.find_below(folder, stated, by)?,
            };
            let path = found.ok_or_else(|| frame.wrong(key, "an existing mask image"))?;
            return Ok(Some((path, meaning)));
        }
    }
    Ok(None)
}

/// Scene units per step of a depth map, where no key says it: millimetres, as nerfstudio takes them.
const MILLIMETRE: f64 = 1e-3;

/// Whether the file says, as instant-ngp obeys it, that maps of `depth_path` are not used.
pub(super) fn leaves_depth_out(object: &Object) -> bool {
    object.get("enable_depth_loading").and_then(Value::as_bool) == Some(false)
}

/// The depth map that a frame names: nerfstudio's `depth_file_path` with `depth_unit_scale_factor`, or instant-ngp's `depth_path` with
/// `integer_depth_scale`.
fn depth(root: &Root, frame: &Object) -> Result<Option<DepthFile>, DataError> {
    for (key, unit) in [("depth_file_path", "depth_unit_scale_factor"), ("depth_path", "integer_depth_scale")]
    {
        let Some(stated) = frame.text(key)? else { continue };
        if key == "depth_path" && leaves_depth_out(frame) {
            continue;
        }
        let unit = match frame.number(unit)? {
            Some(stated) if stated <= 0.0 => {
                return Err(frame.wrong(unit, "scene units per step of a depth map, above 0"));
            }
            stated => stated.unwrap_or(MILLIMETRE),
        };
        let found = root.find(stated, Statement { path: frame.path(), key: &frame.key(key) })?;
        let path = found.ok_or_else(|| frame.wrong(key, "an existing depth map"))?;
        return Ok(Some(DepthFile { path, unit, size: None }));
    }
    Ok(None)
}

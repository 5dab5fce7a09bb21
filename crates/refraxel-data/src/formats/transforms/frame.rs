//! One frame: its image, mask, intrinsics and pose.

use super::camera;
use crate::json::Object;
use crate::parsed::{Frame, Origin, StatedMask};
use crate::root::{Root, Statement};
use crate::{DataError, pose};
use refraxel_core::Pose;
use serde_json::Value;
use std::path::PathBuf;

/// One frame, and a sentence when its focal length is stated twice with different values.
pub(super) fn read_frame(
    root: &Root,
    frame: Object,
    origin: Origin,
) -> Result<(Frame, Option<String>), DataError> {
    refuse_moving_camera(&frame)?;
    let file =
        frame.text("file_path")?.ok_or_else(|| frame.wrong("file_path", "the image's file name"))?.to_owned();
    let image = root.find(&file, Statement { path: frame.path(), key: &frame.key("file_path") })?;
    let (intrinsics, disagreement) = camera::intrinsics(&frame)?;
    let pose = pose_of(&frame)?;
    let mask = if image.is_some() { mask(root, &frame)? } else { None };
    Ok((Frame { origin, file, image, mask, part: None, intrinsics, pose }, disagreement))
}

fn pose_of(frame: &Object) -> Result<Pose, DataError> {
    const EXPECTED: &str = "a matrix of 3 or 4 rows with 4 finite numbers each (camera to world)";
    let rows = frame.matrix::<3, 4>("transform_matrix", EXPECTED)?;
    rows.map(pose::from_opengl).ok_or_else(|| frame.wrong("transform_matrix", EXPECTED))
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
fn mask(root: &Root, frame: &Object) -> Result<Option<(PathBuf, StatedMask)>, DataError> {
    let keys = [("mask_path", StatedMask::Shown), ("mask_file_path", StatedMask::Open)];
    for (key, meaning) in keys {
        if let Some(stated) = frame.text(key)? {
            let found = root.find(stated, Statement { path: frame.path(), key: &frame.key(key) })?;
            let path = found.ok_or_else(|| frame.wrong(key, "an existing mask image"))?;
            return Ok(Some((path, meaning)));
        }
    }
    Ok(None)
}

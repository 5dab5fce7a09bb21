//! Record3D: `metadata` (JSON) beside `rgb/` or `rgbd/`, as the app exports or as an unpacked `.r3d` holds.
//!
//! Depth is in metres: EXR in `depth/`, or `N.depth` beside `N.jpg`, which is a map of `dw` columns and `dh` rows of `f32` (rows from the top),
//! compressed by LZFSE. Both are oriented like the photographs. `poses` are quaternions (x, y, z, w) and positions of the camera in the world, with camera axes right, up and backwards and the y
//! axis of the world upwards (ARKit). `K` is a 3x3 matrix column by column; `perFrameIntrinsicCoeffs` (fx, fy, cx, cy) is of each photograph.

use super::beside::{Maps, add_depth, frame};
use super::gravity::state_up;
use crate::extensions::is_picture;
use crate::folder::names;
use crate::json::{self, Object};
use crate::parsed::{Focal, Intrinsics, Origin, ParsedDataset};
use crate::pose::{self, PoseFault};
use crate::root::{Root, Statement};
use crate::{DataError, Format, OpenOptions, Problem, limits};
use refraxel_core::{Lens, Pose, Vec3, vec3};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The description of a folder that Record3D has exported.
pub(crate) fn find(folder: &Path) -> Option<PathBuf> {
    let files = ["metadata", "metadata.json", "EXR_RGBD/metadata", "EXR_RGBD/metadata.json"];
    let mut all = files.map(|name| folder.join(name)).into_iter();
    all.find(|file| limits::read_text(file).is_ok_and(|text| is_metadata(&text)))
}

/// Whether a text has the keys of such a description.
pub(crate) fn is_metadata(text: &str) -> bool {
    text.trim_start().starts_with('{') && ["\"poses\"", "\"K\""].iter().all(|key| text.contains(key))
}

/// Reads the cameras of a file.
pub(crate) fn read(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::beside(file, Format::Record3d, options)?;
    let value = json::read(file)?;
    let top = Object::new(file, "", &value)?;
    let poses = top.get("poses").and_then(Value::as_array);
    let poses = poses.ok_or_else(|| top.wrong("poses", "a list [[qx, qy, qz, qw, x, y, z], …]"))?;
    limits::frames(file, poses.len())?;
    let (images, names) = photographs(&parsed.root);
    let first = first_number(&names, poses.len(), &mut parsed.problems);
    let size = size(&top)?;
    let shared = shared(&top)?;
    let path = Arc::new(file.to_owned());
    for (i, pose) in poses.iter().enumerate() {
        let origin = Origin { path: path.clone(), key: format!("poses[{i}]") };
        let name = names.get(&(first + i as u64)).cloned().unwrap_or_else(|| format!("{i}"));
        let by = Statement { path: file, key: &origin.key };
        let image = parsed.root.find_below(images, &name, by)?;
        let [fx, fy, cx, cy] = own(&top, i)?.unwrap_or(shared);
        let (focal, center) = (Focal::Pixels([fx, fy]), Some([cx, cy]));
        let intrinsics = Intrinsics { size, focal, center, lens: Lens::Pinhole };
        let (file, pose) = (format!("{images}/{name}"), pose_of(pose, &origin)?);
        parsed.frames.push(frame(origin, file, image, intrinsics, pose));
    }
    add_maps(&mut parsed, &top, images)?;
    state_up(&mut parsed, vec3(0.0, 1.0, 0.0));
    Ok(parsed)
}

/// Poses of ARKit and depth are in metres.
const METRE: f64 = 1.0;
/// Most columns or rows of a depth map [pixel]: together as many as [`limits::IMAGE_PIXELS`] are.
const MAP_EDGE: f64 = 16384.0;

/// Gives photographs their maps of depth: EXR, or else compressed ones, which need their size.
fn add_maps(parsed: &mut ParsedDataset, top: &Object, images: &str) -> Result<(), DataError> {
    let ParsedDataset { root, frames, problems, .. } = parsed;
    let exr = Maps { folder: "depth", extension: "exr", unit: METRE, size: None };
    add_depth(root, frames, &exr);
    let folders = [images, "depth"];
    let compressed: usize =
        folders.iter().map(|folder| names_of(&root.folder().join(folder), ".depth")).sum();
    if compressed == 0 || frames.iter().all(|frame| frame.depth.is_some()) {
        return Ok(());
    }
    let Some(size) = map_size(top)? else {
        problems.push(Problem::warning(format!(
            "{compressed} depth maps of Record3D (.depth) are not used: the metadata do not state their size as `dw` and `dh`; export EXR + \
             RGB from the app for depth"
        )));
        return Ok(());
    };
    for folder in folders {
        add_depth(root, frames, &Maps { folder, extension: "depth", size: Some(size), ..exr });
    }
    Ok(())
}

/// Columns and rows of compressed maps, where the file states them.
fn map_size(top: &Object) -> Result<Option<[u32; 2]>, DataError> {
    let edge = |key: &str| -> Result<Option<u32>, DataError> {
        let Some(stated) = top.number(key)? else { return Ok(None) };
        let is_edge = stated.fract() == 0.0 && (1.0..=MAP_EDGE).contains(&stated);
        is_edge
            .then_some(Some(stated as u32))
            .ok_or_else(|| top.wrong(key, "a whole number of pixels from 1 to 16384"))
    };
    Ok(edge("dw")?.zip(edge("dh")?).map(|(width, height)| [width, height]))
}

/// How many names in a folder end so.
fn names_of(folder: &Path, end: &str) -> usize {
    names(folder).unwrap_or_default().iter().filter(|name| name.ends_with(end)).count()
}

/// The folder of photographs and their names by number.
fn photographs(root: &Root) -> (&'static str, BTreeMap<u64, String>) {
    let numbered = |folder: &str| -> BTreeMap<u64, String> {
        let all = names(&root.folder().join(folder))
            .unwrap_or_default()
            .into_iter()
            .filter(|name| is_picture(name));
        all.filter_map(|name| Some((name.rsplit_once('.')?.0.parse().ok()?, name))).collect()
    };
    let folders = ["rgb", "rgbd", "images", "."].map(|folder| (folder, numbered(folder)));
    folders.into_iter().find(|(_, names)| !names.is_empty()).unwrap_or(("rgb", BTreeMap::new()))
}

/// The number of the first pose's photograph: 0, unless the photographs are counted from 1.
fn first_number(names: &BTreeMap<u64, String>, poses: usize, problems: &mut Vec<Problem>) -> u64 {
    let from_one = !names.contains_key(&0) && names.contains_key(&1) && names.contains_key(&(poses as u64));
    if from_one {
        problems.push(Problem::warning(
            "the photographs are numbered from 1, Record3D counts from 0: the first pose is taken for photograph 1",
        ));
    }
    u64::from(from_one)
}

fn size(top: &Object) -> Result<Option<[f64; 2]>, DataError> {
    let edge = |key: &str| {
        let edge = top.number(key)?.filter(|v| (1.0..=1e6).contains(v));
        edge.ok_or_else(|| top.wrong(key, "a size from 1 to 1000000 pixels"))
    };
    Ok(Some([edge("w")?, edge("h")?]))
}

/// (fx, fy, cx, cy) of `K`.
fn shared(top: &Object) -> Result<[f64; 4], DataError> {
    const EXPECTED: &str = "nine finite numbers: a 3x3 matrix, column by column";
    match top.numbers::<9>("K", EXPECTED)? {
        Some([fx, _, _, _, fy, _, cx, cy, _]) => Ok([fx, fy, cx, cy]),
        None => Err(top.wrong("K", EXPECTED)),
    }
}

/// (fx, fy, cx, cy) of one photograph, where the file states them.
fn own(top: &Object, i: usize) -> Result<Option<[f64; 4]>, DataError> {
    let Some(list) = top.get("perFrameIntrinsicCoeffs").and_then(Value::as_array) else { return Ok(None) };
    let Some(value) = list.get(i) else { return Ok(None) };
    let key = format!("perFrameIntrinsicCoeffs[{i}]");
    json::row(value)
        .map(Some)
        .ok_or_else(|| json::wrong(top.path(), key, value, "four finite numbers: fx, fy, cx, cy [pixel]"))
}

fn pose_of(value: &Value, origin: &Origin) -> Result<Pose, DataError> {
    let wrong = || {
        json::wrong(&origin.path, origin.key.clone(), value, "seven finite numbers: qx, qy, qz, qw, x, y, z")
    };
    let [x, y, z, w, a, b, c] = json::row(value).ok_or_else(wrong)?;
    let fault = |fault: PoseFault| DataError::Pose {
        path: origin.path.to_path_buf(),
        key: origin.key.clone(),
        fault,
    };
    let rotation = pose::rotation_of_quaternion([w, x, y, z]).map_err(fault)?;
    Ok(pose::with_opengl_axes(Pose { rotation, translation: Vec3::new(a, b, c) }))
}

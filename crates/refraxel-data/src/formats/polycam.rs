//! Polycam's raw data: `keyframes/corrected_cameras/*.json` with `corrected_images`, or `cameras` with `images`.
//!
//! `t_00..t_23` is a matrix of three rows from camera to world, with camera axes right, up and backwards and the y axis of the world
//! upwards (ARKit).

use super::beside::frame;
use super::gravity::state_up;
use crate::extensions::is_picture;
use crate::folder::names;
use crate::json::{self, Object};
use crate::parsed::{Focal, Intrinsics, Origin, ParsedDataset};
use crate::root::Statement;
use crate::{DataError, Format, OpenOptions, Problem, limits, pose};
use refraxel_core::{Lens, Pose, vec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A photograph with a lower `blur_score` is blurred (nerfstudio leaves it out).
const SHARP: f64 = 25.0;

/// Where cameras and photographs are.
pub(crate) struct Keyframes {
    /// `keyframes`.
    folder: PathBuf,
    cameras: &'static str,
    images: &'static str,
}

/// The keyframes of a folder: those that Polycam has corrected, else those of the phone, of which there are photographs.
pub(crate) fn find(folder: &Path) -> Option<Keyframes> {
    let pairs = [("corrected_cameras", "corrected_images"), ("cameras", "images")];
    let bases = [folder.join("keyframes"), folder.to_owned()];
    let all = bases.iter().flat_map(|base| pairs.map(|(cameras, images)| (base, cameras, images)));
    let mut all: Vec<Keyframes> = all
        .map(|(base, cameras, images)| Keyframes { folder: base.clone(), cameras, images })
        .filter(Keyframes::have_poses)
        .collect();
    let shown = all.iter().position(Keyframes::have_photographs).unwrap_or(0);
    (!all.is_empty()).then(|| all.swap_remove(shown))
}

impl Keyframes {
    fn have_poses(&self) -> bool {
        let first = || descriptions(&self.folder.join(self.cameras)).ok()?.into_iter().next();
        let has_pose = |name: String| {
            let file = self.folder.join(self.cameras).join(name);
            limits::read_text(&file).is_ok_and(|text| text.contains("\"t_00\""))
        };
        first().is_some_and(has_pose)
    }

    fn have_photographs(&self) -> bool {
        names(&self.folder.join(self.images)).is_ok_and(|names| names.iter().any(|name| is_picture(name)))
    }
}

fn descriptions(folder: &Path) -> Result<Vec<String>, DataError> {
    let mut names = names(folder)?;
    names.retain(|name| name.ends_with(".json") && !name.starts_with('.'));
    Ok(names)
}

/// Reads the cameras.
pub(crate) fn read(keyframes: &Keyframes, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let Keyframes { folder, cameras, images } = keyframes;
    let mut parsed = ParsedDataset::below(folder, Format::Polycam, options)?;
    let described = folder.join(cameras);
    let names = descriptions(&described)?;
    limits::frames(&described, names.len())?;
    let mut blurred = 0;
    for name in &names {
        let path = described.join(name);
        let value = json::read(&path)?;
        let camera = Object::new(&path, "", &value)?;
        let stem = name.trim_end_matches(".json");
        let image =
            parsed.root.find_below(images, stem, Statement { path: &path, key: "the file's name" })?;
        let (intrinsics, pose) = (intrinsics(&camera)?, pose_of(&camera)?);
        blurred += usize::from(camera.number("blur_score")?.is_some_and(|score| score < SHARP));
        let origin = Origin { path: Arc::new(path.clone()), key: "camera".into() };
        let file = format!("{images}/{stem}");
        parsed.frames.push(frame(origin, file, image, intrinsics, pose));
    }
    parsed.problems.extend(notes(keyframes, blurred, names.len()));
    state_up(&mut parsed, vec3(0.0, 1.0, 0.0));
    Ok(parsed)
}

fn notes(keyframes: &Keyframes, blurred: usize, count: usize) -> Vec<Problem> {
    let mut notes = Vec::new();
    let Keyframes { folder, images, .. } = keyframes;
    if images.starts_with("corrected") {
        notes.push(Problem::note(
            "Polycam's corrected photographs have black borders of some 15 pixels; --crop 15,15,15,15 cuts them off",
        ));
        let all = descriptions(&folder.join("cameras")).map_or(0, |names| names.len());
        if all > count {
            notes.push(Problem::note(format!(
                "Polycam has corrected {count} of {all} cameras; the others are not used"
            )));
        }
    }
    if folder.join("depth").is_dir() {
        notes.push(Problem::note("the depth maps of Polycam are not used"));
    }
    if blurred > 0 {
        notes.push(Problem::note(format!(
            "{blurred} of {count} photographs have a blur_score below {SHARP}: they may be blurred"
        )));
    }
    notes
}

fn intrinsics(camera: &Object) -> Result<Intrinsics, DataError> {
    let number = |key: &str| camera.number(key)?.ok_or_else(|| camera.wrong(key, "a finite number [pixel]"));
    // Later versions of Polycam leave the size of corrected photographs out: it is that of the files.
    let size = camera.number("width")?.zip(camera.number("height")?).map(|(w, h)| [w, h]);
    if size.is_some_and(|size| !size.iter().all(|edge| *edge >= 1.0)) {
        return Err(camera.wrong("width", "a size of at least 1 pixel"));
    }
    let focal = Focal::Pixels([number("fx")?, number("fy")?]);
    let center = Some([number("cx")?, number("cy")?]);
    Ok(Intrinsics { size, focal, center, lens: Lens::Pinhole })
}

fn pose_of(camera: &Object) -> Result<Pose, DataError> {
    let mut rows = [[0.0; 4]; 3];
    for (row, column) in (0..12).map(|i| (i / 4, i % 4)) {
        let key = format!("t_{row}{column}");
        let value = camera.number(&key)?;
        rows[row][column] = value.ok_or_else(|| camera.wrong(&key, "a finite number (camera to world)"))?;
    }
    Ok(pose::from_opengl(rows))
}

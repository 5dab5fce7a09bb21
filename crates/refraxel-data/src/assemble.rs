//! From a parsed dataset to a dataset: image headers are read, poses and sizes checked, and masks, split and backdrop
//! decided.

use crate::camera::{Coincidence, MIN_VIEWS, coincidence, one_place, repairs};
use crate::masks::MaskFile;
use crate::parsed::{Frame, Origin, ParsedDataset};
use crate::photo::{self, Header};
use crate::size::Size;
use crate::synth::IndexTruth;
use crate::{
    Backdrop, DataError, Dataset, Format, MaskMeaning, NamedCamera, OpenOptions, PhotoSource, Problem, View,
    json, masks, pose, split,
};
use rayon::prelude::*;
use refraxel_core::Camera;
use serde_json::Value;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Checks a parsed dataset and completes it.
pub(crate) fn assemble(
    path: &Path,
    mut parsed: ParsedDataset,
    options: &OpenOptions,
) -> Result<Dataset, DataError> {
    leave_out_missing(path, &mut parsed)?;
    if parsed.frames.len() < MIN_VIEWS {
        return Err(DataError::TooFewViews { path: path.to_owned(), found: parsed.frames.len() });
    }
    refuse_duplicates(&parsed.frames)?;
    let split = split::decide(path, &mut parsed, options)?;
    let truth = truth(&mut parsed);
    let headers: Vec<Header> = parsed.frames.par_iter().map(header).collect::<Result<_, _>>()?;
    let cameras = cameras(&mut parsed, &headers)?;
    check_distinct_poses(path, &cameras, &mut parsed.problems)?;
    let (masks, concluded) = masks::find_all(&parsed, &cameras, truth.as_ref(), options)?;
    parsed.problems.extend(concluded);
    let mut views = views(&parsed.frames, cameras, masks);
    if !options.crop.is_none() {
        views = views.into_iter().map(|v| v.cropped(options.crop)).collect::<Result<_, _>>()?;
    }
    parsed.problems.extend(masks::summary(&views));
    let backdrop = backdrop(&parsed, &headers, truth.as_ref(), options)?;
    let ParsedDataset { root, format, stated_box, points, depth_range, problems, .. } = parsed;
    let root = Some(root.folder().to_owned());
    let up = options.up.map(|up| up.normalized()).filter(|up| (up.length() - 1.0).abs() < 1e-6);
    Ok(Dataset { root, format, views, split, backdrop, stated_box, up, points, depth_range, truth, problems })
}

/// Drops frames without an image: one warning with their number and first names.
fn leave_out_missing(path: &Path, parsed: &mut ParsedDataset) -> Result<(), DataError> {
    let count = parsed.frames.len();
    let missing: Vec<String> =
        parsed.frames.iter().filter(|f| f.image.is_none()).map(|f| f.file.clone()).collect();
    let Some(first) = missing.first() else { return Ok(()) };
    if missing.len() == count {
        return Err(DataError::AllImagesMissing { path: path.to_owned(), count, first: first.clone() });
    }
    let names = missing.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
    let more = if missing.len() > 3 { ", …" } else { "" };
    parsed.problems.push(Problem::warning(format!(
        "{} of {count} views are left out because their image does not exist: {names}{more}",
        missing.len()
    )));
    parsed.frames.retain(|frame| frame.image.is_some());
    Ok(())
}

fn refuse_duplicates(frames: &[Frame]) -> Result<(), DataError> {
    let mut seen = HashSet::new();
    for frame in frames {
        if let Some(image) = frame.image.as_ref().filter(|image| !seen.insert((*image, frame.part))) {
            let Origin { path, key } = &frame.origin;
            return Err(DataError::DuplicateFrame {
                path: path.to_path_buf(),
                key: key.clone(),
                image: image.clone(),
            });
        }
    }
    Ok(())
}

fn header(frame: &Frame) -> Result<Header, DataError> {
    photo::header(frame.image.as_deref().unwrap_or(Path::new("")))
}

/// Cameras with checked poses and with intrinsics at the real image size.
fn cameras(parsed: &mut ParsedDataset, headers: &[Header]) -> Result<Vec<Camera>, DataError> {
    let mut cameras = Vec::with_capacity(headers.len());
    let (mut repaired, mut resized) = (Vec::new(), Vec::new());
    for (frame, header) in parsed.frames.iter().zip(headers) {
        let Origin { path, key } = &frame.origin;
        let checked = pose::check(&frame.pose).map_err(|fault| DataError::Pose {
            path: path.to_path_buf(),
            key: key.clone(),
            fault,
        })?;
        let real = real_size(header, frame.intrinsics.size);
        repaired.extend(checked.repaired);
        let stated = frame.intrinsics.size.filter(|stated| differs(*stated, real));
        resized.extend(stated.map(|stated| Resized { stated, real }));
        cameras.push(frame.intrinsics.camera(real, checked.pose, &frame.origin)?);
    }
    parsed.problems.extend(repairs(&repaired));
    parsed.problems.extend(resizes(&resized));
    if headers.iter().any(|h| h.turned) {
        parsed.problems.push(Problem::note("images with an EXIF orientation are turned upright"));
    }
    Ok(cameras)
}

/// One view per frame.
fn views(frames: &[Frame], cameras: Vec<Camera>, masks: Vec<Option<MaskFile>>) -> Vec<View> {
    let view = |frame: &Frame, name: String, camera: Camera, mask: Option<MaskFile>| {
        let mask_meaning = mask.as_ref().map_or(MaskMeaning::Keep, |m| m.meaning);
        let image = frame.image.clone().unwrap_or_default();
        let source = PhotoSource::Files { image, mask: mask.map(|m| m.path), stored: None };
        View { name, source, mask_meaning, camera }
    };
    let parts = frames.iter().zip(names(frames)).zip(cameras.into_iter().zip(masks));
    parts.map(|((frame, name), (camera, mask))| view(frame, name, camera, mask)).collect()
}

/// The checked cameras of a parsed dataset, whether their images exist or not.
pub(crate) fn named_cameras(path: &Path, parsed: ParsedDataset) -> Result<Vec<NamedCamera>, DataError> {
    if parsed.frames.is_empty() {
        return Err(DataError::NoCameras { path: path.to_owned() });
    }
    let stem = |f: &Frame| {
        let file = f.file.replace('\\', "/");
        Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned()
    };
    let stems: Vec<String> = parsed.frames.iter().map(stem).collect();
    let unique = stems.iter().collect::<HashSet<_>>().len() == stems.len();
    let named = parsed.frames.iter().zip(&stems).map(|(frame, stem)| {
        let file = frame.file.replace('\\', "/");
        let folders = Path::new(file.trim_start_matches("./")).with_file_name(stem);
        let long = folders.to_string_lossy().replace('/', "_");
        let camera = camera_without_image(frame)?;
        Ok(NamedCamera { name: if unique { stem.clone() } else { long }, camera })
    });
    named.collect()
}

fn camera_without_image(frame: &Frame) -> Result<Camera, DataError> {
    let Origin { path, key } = &frame.origin;
    let fault = |fault| DataError::Pose { path: path.to_path_buf(), key: key.clone(), fault };
    let pose = pose::check(&frame.pose).map_err(fault)?.pose;
    let stated =
        frame.intrinsics.size.map(|[w, h]| Size { width: w.round() as u32, height: h.round() as u32 });
    let size = match (&frame.image, stated) {
        (Some(_), _) => real_size(&header(frame)?, frame.intrinsics.size),
        (None, Some(size)) => size,
        (None, None) => {
            let (path, key) = (path.to_path_buf(), format!("{key}.w"));
            let expected = "w and h [pixel], because the image itself does not exist";
            return Err(DataError::Value { path, key, found: "missing".into(), expected });
        }
    };
    frame.intrinsics.camera(size, pose, &frame.origin)
}

/// The size that the camera was calibrated for: upright, unless only the stored size has the stated shape.
fn real_size(header: &Header, stated: Option<[f64; 2]>) -> Size {
    let portrait = |w: f64, h: f64| w < h;
    let is = |size: Size, [w, h]: [f64; 2]| {
        portrait(f64::from(size.width), f64::from(size.height)) == portrait(w, h)
    };
    match stated {
        Some(stated) if !is(header.upright, stated) && is(header.stored, stated) => header.stored,
        _ => header.upright,
    }
}

fn differs(stated: [f64; 2], real: Size) -> bool {
    (stated[0] - f64::from(real.width)).abs() > 0.5 || (stated[1] - f64::from(real.height)).abs() > 0.5
}

/// An image that has another size than its camera states.
struct Resized {
    stated: [f64; 2],
    real: Size,
}

/// A note or warning about all such images.
fn resizes(resized: &[Resized]) -> Option<Problem> {
    let Resized { stated: [w, h], real } = resized.first()?;
    let count = resized.len();
    let message = format!(
        "{count} images have another size than their camera states ({w}x{h} stated, {real} found first); focal length and \
         principal point were scaled to the image"
    );
    let stretch = (f64::from(real.width) / w) / (f64::from(real.height) / h);
    let same_shape = (stretch - 1.0).abs() < 0.01;
    Some(if same_shape {
        Problem::note(message)
    } else {
        Problem::warning(format!("{message}; the shape differs too"))
    })
}

fn check_distinct_poses(
    path: &Path,
    cameras: &[Camera],
    problems: &mut Vec<Problem>,
) -> Result<(), DataError> {
    match coincidence(cameras.iter()) {
        Some(Coincidence::Pose) => {
            return Err(DataError::SamePose { path: path.to_owned(), count: cameras.len() });
        }
        Some(Coincidence::Place) => problems.push(one_place()),
        None => {}
    }
    Ok(())
}

/// Names each view by its image file; where folders hold files of one name, the folders join the name.
fn names(frames: &[Frame]) -> Vec<String> {
    let file = |frame: &Frame| {
        let name = frame.image.as_deref().and_then(Path::file_name);
        name.map(|n| n.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let keys: Vec<_> = frames.iter().map(|f| (f.part, file(f))).collect();
    let mut count: HashMap<_, usize> = HashMap::new();
    for key in &keys {
        *count.entry(key).or_default() += 1;
    }
    let with_folders = |f: &Frame| f.file.replace('\\', "/").trim_start_matches("./").replace('/', "_");
    let named = frames.iter().zip(&keys);
    named.map(|(f, key)| if count[key] == 1 { key.1.clone() } else { with_folders(f) }).collect()
}

/// `scene.json` beside the data; what is wrong with it is only a warning.
fn truth(parsed: &mut ParsedDataset) -> Option<Value> {
    let file = parsed.root.folder().join("scene.json");
    if !file.is_file() || !parsed.root.contains(&file) {
        return None;
    }
    let read = json::read(&file);
    let warning = |what: &str, error| Problem::warning(format!("{what}: {error}"));
    let truth = read.map_err(|error| parsed.problems.push(warning("the truth is not used", error))).ok()?;
    let is_refractive = truth.get("refractive").and_then(Value::as_array).is_some_and(|l| !l.is_empty());
    if let Some(error) = IndexTruth::parse(&file, &truth).err().filter(|_| is_refractive) {
        parsed.problems.push(warning("errors of the index will not be measured", error));
    }
    Some(truth)
}

/// The backdrop, from the first of these that states one: the user, alpha in the images, the description, the truth, the
/// kind of images.
fn backdrop(
    parsed: &ParsedDataset,
    headers: &[Header],
    truth: Option<&Value>,
    options: &OpenOptions,
) -> Result<Backdrop, DataError> {
    if let Some(chosen) = options.backdrop {
        return Ok(chosen);
    }
    let with_alpha: Vec<&Frame> =
        parsed.frames.iter().zip(headers).filter(|(_, h)| h.alpha).map(|(f, _)| f).collect();
    // An image wholly inside the object may be opaque; three of them hardly are.
    for i in [0, with_alpha.len() / 2, with_alpha.len().saturating_sub(1)] {
        if let Some(image) = with_alpha.get(i).and_then(|frame| frame.image.as_deref())
            && photo::is_see_through(image)?
        {
            return Ok(Backdrop::Transparent);
        }
    }
    let white = parsed.format == Format::Nsvf || parsed.synthetic;
    let otherwise = if white { Backdrop::Color([1.0; 3]) } else { Backdrop::Surroundings };
    Ok(parsed.backdrop.or_else(|| truth_background(truth?)).unwrap_or(otherwise))
}

/// `background_srgb8` of `scene.json`.
fn truth_background(truth: &Value) -> Option<Backdrop> {
    let rgb = truth.get("background_srgb8")?.as_array()?;
    let color: Vec<f32> = rgb.iter().filter_map(Value::as_f64).map(|c| (c / 255.0) as f32).collect();
    Some(Backdrop::Color(color.try_into().ok()?))
}

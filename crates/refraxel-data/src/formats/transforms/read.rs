//! From files to a parsed dataset, with the keys of whole files.

use super::frame::{Layout, Read, leaves_depth_out, read_frame};
use super::region;
use super::unused::Unused;
use crate::folder::{file_in, names, only_file, only_one};
use crate::formats::ply;
use crate::parsed::{Coloured, Frame, Origin, ParsedDataset, Part};
use crate::root::Statement;
use crate::{Backdrop, DataError, Format, OpenOptions, Problem, json, json::Object, limits, pose, split};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads one file that holds all views.
pub(crate) fn read_single(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::beside(file, Format::Transforms, options)?;
    add_file(&mut parsed, file, &Layout::USUAL, None)?;
    Ok(parsed)
}

/// Reads one file that holds all views of a folder, and `transforms_{val,test}.json` beside it: they add views, or say of views
/// of the first file that they are held out.
pub(crate) fn read_with_held_out(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = read_single(file, options)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut names = vec!["transforms.json".to_owned()];
    for (part, name) in [(Part::Val, "transforms_val.json"), (Part::Test, "transforms_test.json")] {
        let Some(other) = file_in(folder, name) else { continue };
        let known = parsed.frames.len();
        add_file(&mut parsed, &other, &Layout::USUAL, Some(part))?;
        let added = parsed.frames.split_off(known);
        let places: HashMap<String, usize> =
            parsed.frames.iter().enumerate().map(|(i, frame)| (frame.file.clone(), i)).collect();
        for frame in added {
            match places.get(&frame.file) {
                Some(&i) => parsed.frames[i].part = Some(part),
                None => parsed.frames.push(frame),
            }
        }
        names.push(name.to_owned());
    }
    if names.len() > 1 {
        parsed.split_rule = Some(names.join(", "));
        parsed.frames.iter_mut().for_each(|frame| frame.part = frame.part.or(Some(Part::Train)));
    }
    Ok(parsed)
}

/// Reads `transforms_{train,val,test}.json` of a folder, as far as they exist.
pub(crate) fn read_blender(folder: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::below(folder, Format::Blender, options)?;
    parsed.synthetic = true;
    let mut names = Vec::new();
    for (part, name) in [(Part::Train, "train"), (Part::Val, "val"), (Part::Test, "test")] {
        if let Some(file) = file_in(folder, &format!("transforms_{name}.json")) {
            let calibrated = add_file(&mut parsed, &file, &Layout::USUAL, Some(part))?;
            parsed.synthetic &= !calibrated;
            names.push(name);
        }
    }
    if names.len() > 1 {
        parsed.split_rule = Some(format!("transforms_{{{}}}.json", names.join(",")));
    }
    Ok(parsed)
}

/// Lists of frames in a file: all of them, or those to learn from and those that are held out (ScanNet++).
const LISTS: [(&str, Option<Part>); 4] = [
    ("frames", None),
    ("val_frames", Some(Part::Val)),
    ("test_frames", Some(Part::Test)),
    ("eval_frames", Some(Part::Test)),
];

/// Reads another file of the same kind that a folder has, whose name is not the usual one.
pub(crate) fn find_other(folder: &Path) -> Result<Option<PathBuf>, DataError> {
    let mut names = names(folder).unwrap_or_default();
    names.retain(|name| name.starts_with("transforms") && name.ends_with(".json"));
    if names.iter().any(|name| name == "transforms_all.json") {
        names.retain(|name| name == "transforms_all.json");
    }
    let found = only_one(folder, names.into_iter().map(|name| folder.join(name)).collect())?;
    found.map_or_else(|| only_file(folder, ".json", is_like_transforms), |found| Ok(Some(found)))
}

/// Whether a file has the keys of views, as RealityScan writes them under any name.
fn is_like_transforms(file: &Path) -> bool {
    let keys = ["\"frames\"", "\"file_path\"", "\"transform_matrix\""];
    limits::read_text(file).is_ok_and(|text| keys.iter().all(|key| text.contains(key)))
}

/// Adds the frames of one file. True when the file carries a calibration, as photographs have and renderings lack.
pub(super) fn add_file(
    parsed: &mut ParsedDataset,
    file: &Path,
    layout: &Layout,
    part: Option<Part>,
) -> Result<bool, DataError> {
    let value = json::read(file)?;
    let top = Object::new(file, "", &value)?;
    let lists = LISTS.map(|(key, part)| (key, part, top.get(key).and_then(Value::as_array)));
    if lists[0].2.is_none() {
        return Err(top.wrong("frames", "a list of frames [{\"file_path\": …}]"));
    }
    read_file_keys(parsed, &top)?;
    let held_out = lists[1..].iter().any(|(.., frames)| frames.is_some_and(|f| !f.is_empty()));
    if held_out && part.is_none() {
        parsed.split_rule = Some("frames and test_frames or val_frames of the file".to_owned());
    }
    for (list, of_list, frames) in lists {
        let of_list = of_list.or(held_out.then_some(Part::Train));
        let frames = frames.map_or(&[][..], Vec::as_slice);
        add_frames(parsed, &top, list, frames, layout, part.or(of_list))?;
    }
    Ok(["fl_x", "cx", "k1", "aabb_scale", "camera_model"].iter().any(|key| top.get(key).is_some()))
}

/// Adds the frames of one list, which are of this part of the split if the list says so.
fn add_frames(
    parsed: &mut ParsedDataset,
    top: &Object,
    list: &str,
    frames: &[Value],
    layout: &Layout,
    part: Option<Part>,
) -> Result<(), DataError> {
    let file = top.path();
    limits::frames(file, parsed.frames.len() + frames.len())?;
    let path = Arc::new(file.to_owned());
    let mut unused = Unused::default();
    let (mut disagreements, mut of_parts, mut other_parts) = (Vec::new(), None, Vec::new());
    let mut transposed = 0;
    for (i, frame) in frames.iter().enumerate() {
        let key = format!("{list}[{i}]");
        let object = Object::new(file, &key, frame)?.within(top);
        if !unused.look(&object)? {
            continue;
        }
        let stated = || frame.as_object().and_then(split::part_of_view);
        of_parts = of_parts.or_else(|| stated().map(|(_, key)| key));
        let origin = Origin { path: path.clone(), key: key.clone() };
        let Read { frame, disagreement, is_transposed } = read_frame(&parsed.root, object, layout, origin)?;
        transposed += usize::from(is_transposed);
        disagreements.extend(disagreement);
        other_parts.extend(object.alone().get("split").filter(|_| frame.part.is_none()).map(|_| key.clone()));
        parsed.frames.push(Frame { part: part.or(frame.part), ..frame });
    }
    if let Some(key) = of_parts.filter(|_| part.is_none()) {
        parsed.split_rule = Some(format!("the key \"{key}\" of the frames"));
    }
    parsed.problems.extend(unused.problems(&path));
    parsed.problems.extend(pose::transposed(&path, transposed));
    parsed.problems.extend(of_no_part(file, &other_parts));
    let file = file.display();
    parsed.problems.extend(
        disagreements
            .first()
            .map(|first| Problem::warning(format!("{file} ({} frames): {first}", disagreements.len()))),
    );
    Ok(())
}

/// A warning about frames whose `split` is not understood.
fn of_no_part(file: &Path, keys: &[String]) -> Option<Problem> {
    let (first, others) = keys.split_first()?;
    let (file, others) = (file.display(), others.len());
    Some(Problem::warning(format!(
        "{file}: {first}.split names no part of a split (train, val, test), nor do {others} others; they are not obeyed"
    )))
}

/// Keys of the whole file: backdrop, region, split lists, points and the transform that made its coordinates.
fn read_file_keys(parsed: &mut ParsedDataset, top: &Object) -> Result<(), DataError> {
    if parsed.backdrop.is_none() {
        parsed.backdrop = backdrop(top)?.or(background_color(top, &mut parsed.problems));
    }
    if parsed.stated_box.is_none() {
        parsed.stated_box = region::stated_box(top)?;
    }
    for (part, key) in
        [(Part::Train, "train_filenames"), (Part::Val, "val_filenames"), (Part::Test, "test_filenames")]
    {
        if let Some(names) = top.texts(key)? {
            parsed.split_lists.push((part, names.into_iter().map(str::to_owned).collect()));
        }
    }
    // The same under other names, such as train_ids, as far as they are lists of names or numbers.
    let is_new = |key: &str| !key.ends_with("_filenames");
    parsed.split_lists.extend(split::lists_of(top.map().iter().filter(|(key, _)| is_new(key))));
    let objects = top
        .map()
        .iter()
        .filter(|(key, _)| split::is_of_lists(key))
        .filter_map(|(_, value)| value.as_object());
    parsed.split_lists.extend(objects.flat_map(split::parts_of));
    read_points(parsed, top)?;
    parsed.problems.extend(rule_of_split(top).filter(|_| parsed.split_lists.is_empty()));
    if leaves_depth_out(top) {
        let file = top.path().display();
        parsed.problems.push(Problem::note(format!(
            "{file}: enable_depth_loading is false: maps of depth_path are not used"
        )));
    }
    if top.get("applied_transform").is_some() || top.get("applied_scale").is_some() {
        let message = "the file records applied_transform: its coordinates are not those of the tool that posed the \
                       cameras; they are kept as they stand";
        parsed.problems.push(Problem::note(format!("{}: {message}", top.path().display())));
    }
    Ok(())
}

/// A warning about a rule by which other programs split the views, where it is not what happens without one.
fn rule_of_split(top: &Object) -> Option<Problem> {
    let is_other = |key: &&str| {
        top.get(key).is_some_and(|v| *key != "llffhold" || v.as_u64() != Some(split::DEFAULT_HOLDOUT as u64))
    };
    let keys = ["llffhold", "train_split_fraction", "eval_mode", "eval_interval"];
    let (key, file) = (keys.into_iter().find(is_other)?, top.path().display());
    Some(Problem::warning(format!(
        "{file}: {key} is not obeyed: say --holdout N, or list the held-out images in test_ids"
    )))
}

/// The points of `ply_file_path`. They only help to place the region, so a broken file is a warning.
fn read_points(parsed: &mut ParsedDataset, top: &Object) -> Result<(), DataError> {
    let Some(stated) = top.text("ply_file_path")? else { return Ok(()) };
    let points = match parsed.root.find(stated, Statement { path: top.path(), key: "ply_file_path" }) {
        Ok(Some(path)) => {
            let points = limits::read(&path, limits::BINARY_BYTES);
            points.and_then(|content| ply::points(&path, &content)).map(|points| (path, points))
        }
        Ok(None) => {
            parsed.problems.push(Problem::warning(format!("ply_file_path: {stated} does not exist")));
            return Ok(());
        }
        Err(error) => Err(error),
    };
    match points {
        Ok((path, points)) => {
            parsed.points = points;
            parsed.coloured = Some(Coloured::Ply(path));
        }
        Err(error) => parsed.problems.push(Problem::warning(format!("the points are not used: {error}"))),
    }
    Ok(())
}

const COLOUR: &str = "\"transparent\", \"#ffffff\" or [red, green, blue] from 0 to 255";

/// `background: [r, g, b]` (0..255, or 0..1 where none is larger), `"#ffffff"` or `"transparent"`, and `white_transparent` and
/// `black_transparent` of instant-ngp.
fn backdrop(top: &Object) -> Result<Option<Backdrop>, DataError> {
    if let Some(value) = top.get("background") {
        return colour(value).map(Some).ok_or_else(|| top.wrong("background", COLOUR));
    }
    let white = top.flag("white_transparent")?.then_some(Backdrop::Color([1.0; 3]));
    let black = top.flag("black_transparent")?.then_some(Backdrop::Color([0.0; 3]));
    Ok(white.or(black))
}

/// The same under the name that trainers give to what they lay photographs over, which need not be a colour (`"random"`).
fn background_color(top: &Object, problems: &mut Vec<Problem>) -> Option<Backdrop> {
    let value = top.get("background_color")?;
    let stated = colour(value);
    problems.extend(stated.is_none().then(|| {
        let file = top.path().display();
        Problem::warning(format!(
            "{file}: background_color is {value}, and not {COLOUR}: it is not used; --backdrop says what is behind the scene"
        ))
    }));
    stated
}

/// A colour from 0 to 255, or to 1, or one in words.
fn colour(value: &Value) -> Option<Backdrop> {
    if let Value::String(text) = value {
        return text.parse().ok();
    }
    let rgb: Vec<f64> = value.as_array()?.iter().map(Value::as_f64).collect::<Option<_>>()?;
    let rgb: [f64; 3] = rgb.try_into().ok()?;
    let most = if rgb.iter().all(|c| *c <= 1.0) { 1.0 } else { 255.0 };
    let is_colour = rgb.iter().all(|c| (0.0..=most).contains(c));
    is_colour.then(|| Backdrop::Color(rgb.map(|c| (c / most) as f32)))
}

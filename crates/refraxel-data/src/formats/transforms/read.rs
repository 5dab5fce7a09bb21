//! From files to a parsed dataset, with the keys of whole files.

use super::frame::read_frame;
use super::region;
use crate::formats::ply;
use crate::parsed::{Frame, Origin, ParsedDataset, Part};
use crate::root::{Root, Statement};
use crate::{Backdrop, DataError, Format, OpenOptions, Problem, json, json::Object, limits};
use serde_json::Value;
use std::path::Path;
use std::sync::Arc;

/// Reads one file that holds all views.
pub(crate) fn read_single(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut parsed = ParsedDataset::new(Root::new(folder, options.allow_outside)?, Format::Transforms);
    add_file(&mut parsed, file, None)?;
    Ok(parsed)
}

/// Reads `transforms_{train,val,test}.json` of a folder, as far as they exist.
pub(crate) fn read_blender(folder: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::new(Root::new(folder, options.allow_outside)?, Format::Blender);
    parsed.synthetic = true;
    let mut names = Vec::new();
    for (part, name) in [(Part::Train, "train"), (Part::Val, "val"), (Part::Test, "test")] {
        let file = folder.join(format!("transforms_{name}.json"));
        if file.is_file() {
            let calibrated = add_file(&mut parsed, &file, Some(part))?;
            parsed.synthetic &= !calibrated;
            names.push(name);
        }
    }
    if names.len() > 1 {
        parsed.split_rule = Some(format!("transforms_{{{}}}.json", names.join(",")));
    }
    Ok(parsed)
}

/// Adds the frames of one file. True when the file carries a calibration, as photographs have and renderings lack.
fn add_file(parsed: &mut ParsedDataset, file: &Path, part: Option<Part>) -> Result<bool, DataError> {
    let value = json::read(file)?;
    let top = Object::new(file, "", &value)?;
    let frames = top.get("frames").and_then(Value::as_array);
    let frames = frames.ok_or_else(|| top.wrong("frames", "a list of frames [{\"file_path\": …}]"))?;
    limits::frames(file, parsed.frames.len() + frames.len())?;
    read_file_keys(parsed, &top)?;
    let path = Arc::new(file.to_owned());
    let mut disagreements = Vec::new();
    for (i, frame) in frames.iter().enumerate() {
        let key = format!("frames[{i}]");
        let object = Object::new(file, &key, frame)?.within(&top);
        let (frame, disagreement) =
            read_frame(&parsed.root, object, Origin { path: path.clone(), key: key.clone() })?;
        disagreements.extend(disagreement);
        parsed.frames.push(Frame { part, ..frame });
    }
    if let Some(first) = disagreements.first() {
        let count = disagreements.len();
        parsed.problems.push(Problem::warning(format!("{} ({count} frames): {first}", file.display())));
    }
    Ok(["fl_x", "cx", "k1", "aabb_scale", "camera_model"].iter().any(|key| top.get(key).is_some()))
}

/// Keys of the whole file: backdrop, region, split lists, points and the transform that made its coordinates.
fn read_file_keys(parsed: &mut ParsedDataset, top: &Object) -> Result<(), DataError> {
    if parsed.backdrop.is_none() {
        parsed.backdrop = backdrop(top)?;
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
    read_points(parsed, top)?;
    if top.get("applied_transform").is_some() || top.get("applied_scale").is_some() {
        let message = "the file records applied_transform: its coordinates are not those of the tool that posed the \
                       cameras; they are kept as they stand";
        parsed.problems.push(Problem::note(format!("{}: {message}", top.path().display())));
    }
    Ok(())
}

/// The points of `ply_file_path`. They only help to place the region, so a broken file is a warning.
fn read_points(parsed: &mut ParsedDataset, top: &Object) -> Result<(), DataError> {
    let Some(stated) = top.text("ply_file_path")? else { return Ok(()) };
    let found = parsed.root.find(stated, Statement { path: top.path(), key: "ply_file_path" })?;
    let Some(path) = found else {
        parsed.problems.push(Problem::warning(format!("ply_file_path: {stated} does not exist")));
        return Ok(());
    };
    match limits::read(&path, limits::BINARY_BYTES).and_then(|content| ply::points(&path, &content)) {
        Ok(points) => parsed.points = points,
        Err(error) => parsed.problems.push(Problem::warning(format!("the points are not used: {error}"))),
    }
    Ok(())
}

/// `background: [r, g, b]` (0..255) or `"transparent"`, and instant-ngp's `white_transparent`, `black_transparent`.
fn backdrop(top: &Object) -> Result<Option<Backdrop>, DataError> {
    const EXPECTED: &str = "\"transparent\" or [red, green, blue] from 0 to 255";
    match top.get("background") {
        Some(Value::String(text)) if text == "transparent" => return Ok(Some(Backdrop::Transparent)),
        Some(Value::Array(_)) => {
            let color = top.numbers::<3>("background", EXPECTED)?.map(|rgb| rgb.map(|c| (c / 255.0) as f32));
            let in_range = color.filter(|rgb| rgb.iter().all(|c| (0.0..=1.0).contains(c)));
            return in_range
                .map(|rgb| Some(Backdrop::Color(rgb)))
                .ok_or_else(|| top.wrong("background", EXPECTED));
        }
        Some(_) => return Err(top.wrong("background", EXPECTED)),
        None => {}
    }
    let white = top.flag("white_transparent")?.then_some(Backdrop::Color([1.0; 3]));
    let black = top.flag("black_transparent")?.then_some(Backdrop::Color([0.0; 3]));
    Ok(white.or(black))
}

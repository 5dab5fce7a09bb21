//! RealityCapture, RealityScan: "internal/external camera parameters" as CSV, one line per photograph.
//!
//! `x, y, alt` is where the camera stands. Camera axes are right, up and backwards; to the world they are turned by
//! R_z(−heading) R_x(pitch) R_y(roll): without rotation the camera looks down and the top of its picture points along y. `f` is the
//! focal length of a picture 36 mm long. `px, py` go from the middle of the picture to the principal point, in units of its longer
//! edge. `k1..k4` are OpenCV's radial coefficients, and `t1, t2` the tangential ones in the other order: the program's own export for
//! OpenCV has `t2` where that has p1. RealityScan writes `yaw`, `f_35mm`, `px_norm` and `py_norm`.

use super::beside::{frame, image_folder};
use super::lens::opencv;
use crate::folder::only_file;
use crate::parsed::{Focal, Intrinsics, Origin, ParsedDataset};
use crate::root::Statement;
use crate::size::Size;
use crate::{DataError, Format, OpenOptions, decoding, limits, pose};
use refraxel_core::{Mat3, Pose, vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Columns that say where a camera is and how it projects; the others may be missing.
const COLUMNS: [&str; 8] = ["name", "x", "y", "alt", "heading", "pitch", "roll", "f"];
/// What RealityScan calls them, and the principal point.
const RENAMED: [(&str, &str); 4] =
    [("yaw", "heading"), ("f_35mm", "f"), ("px_norm", "px"), ("py_norm", "py")];
/// The length of a picture to which focal lengths belong [mm].
const FILM: f64 = 36.0;

/// The file of cameras in a folder, by its first line.
pub(crate) fn find(folder: &Path) -> Result<Option<PathBuf>, DataError> {
    only_file(folder, ".csv", is_cameras)
}

/// Whether the first line of a file names the columns.
pub(crate) fn is_cameras(file: &Path) -> bool {
    limits::read_text(file)
        .is_ok_and(|text| lines(&text).next().is_some_and(|(_, line)| header(line).is_some()))
}

/// Reads the cameras of a file.
pub(crate) fn read(file: &Path, options: &OpenOptions) -> Result<ParsedDataset, DataError> {
    let mut parsed = ParsedDataset::beside(file, Format::RealityCapture, options)?;
    let text = limits::read_text(file)?;
    let mut lines = lines(&text);
    let columns = lines.next().and_then(|(_, line)| header(line));
    let columns = columns.ok_or_else(|| DataError::Value {
        path: file.to_owned(),
        key: "line 1".into(),
        found: format!("{:?}", text.lines().next().unwrap_or_default().chars().take(80).collect::<String>()),
        expected: "#name,x,y,alt,heading,pitch,roll,f and columns of the lens (Internal/External camera parameters)",
    })?;
    let rows: Vec<Row> = lines
        .filter(|(_, line)| !line.trim_start().starts_with('#'))
        .map(|(key, line)| Row { path: file, key, fields: fields(line).collect(), columns: &columns })
        .collect();
    limits::frames(file, rows.len())?;
    let images = image_folder(&parsed.root, rows.iter().map(|row| row.text("name")));
    let path = Arc::new(file.to_owned());
    for row in &rows {
        let name = row.text("name");
        let image = parsed.root.find_below(&images, name, Statement { path: file, key: &row.key })?;
        let (intrinsics, pose) = (row.intrinsics(image.as_deref())?, row.pose()?);
        let origin = Origin { path: path.clone(), key: row.key.clone() };
        let file = name.to_owned();
        parsed.frames.push(frame(origin, file, image, intrinsics, pose));
    }
    Ok(parsed)
}

/// Lines that are not empty, with their names for messages.
fn lines(text: &str) -> impl Iterator<Item = (String, &str)> {
    let all = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with("#cameras "));
    all.map(|(i, line)| (format!("line {}", i + 1), line))
}

/// The fields of a line, without quotes, between which a separator is part of a field. Spreadsheets of some countries separate by
/// semicolons.
fn fields(line: &str) -> impl Iterator<Item = &str> {
    let separator = if line.matches(';').count() >= COLUMNS.len() - 1 { ';' } else { ',' };
    let mut is_quoted = false;
    let ends = move |c| {
        is_quoted ^= c == '"';
        c == separator && !is_quoted
    };
    line.split(ends).map(|field| field.trim().trim_matches('"'))
}

/// The place of each column, if the line names all that are needed.
fn header(line: &str) -> Option<HashMap<String, usize>> {
    let name = |field: &str| {
        let name = field.trim_start_matches('#').to_ascii_lowercase();
        let usual = RENAMED.into_iter().find(|(renamed, _)| *renamed == name);
        usual.map_or(name, |(_, usual)| usual.to_owned())
    };
    let columns: HashMap<String, usize> =
        fields(line).enumerate().map(|(i, field)| (name(field), i)).collect();
    COLUMNS.iter().all(|column| columns.contains_key(*column)).then_some(columns)
}

/// One photograph.
struct Row<'a> {
    path: &'a Path,
    key: String,
    fields: Vec<&'a str>,
    columns: &'a HashMap<String, usize>,
}

impl Row<'_> {
    fn text(&self, column: &str) -> &str {
        self.columns.get(column).and_then(|&i| self.fields.get(i)).copied().unwrap_or_default()
    }

    /// A number, in which some countries write a comma; 0 where there is no such column.
    fn number(&self, column: &str) -> Result<f64, DataError> {
        if !self.columns.contains_key(column) {
            return Ok(0.0);
        }
        let text = self.text(column);
        text.replace(',', ".").parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| DataError::Value {
            path: self.path.to_owned(),
            key: format!("{} ({column})", self.key),
            found: format!("{:?}", text.chars().take(40).collect::<String>()),
            expected: "a finite number",
        })
    }

    fn pose(&self) -> Result<Pose, DataError> {
        let angle = |column: &str| self.number(column).map(f64::to_radians);
        let (sin_z, cos_z) = (-angle("heading")?).sin_cos();
        let (sin_x, cos_x) = angle("pitch")?.sin_cos();
        let (sin_y, cos_y) = angle("roll")?.sin_cos();
        let z = Mat3::from_rows([[cos_z, -sin_z, 0.0], [sin_z, cos_z, 0.0], [0.0, 0.0, 1.0]]);
        let x = Mat3::from_rows([[1.0, 0.0, 0.0], [0.0, cos_x, -sin_x], [0.0, sin_x, cos_x]]);
        let y = Mat3::from_rows([[cos_y, 0.0, sin_y], [0.0, 1.0, 0.0], [-sin_y, 0.0, cos_y]]);
        let translation = vec3(self.number("x")?, self.number("y")?, self.number("alt")?);
        Ok(pose::with_opengl_axes(Pose { rotation: z * x * y, translation }))
    }

    /// The file has no size; that of the photograph counts. Without one that can be read there is no view.
    fn intrinsics(&self, image: Option<&Path>) -> Result<Intrinsics, DataError> {
        let number = |column: &str| self.number(column);
        let lens = opencv(
            [number("k1")?, number("k2")?, number("k3")?, number("k4")?],
            [number("t2")?, number("t1")?],
        );
        let size = image.and_then(|image| decoding::header(image).ok()).map(|header| header.upright());
        let [w, h] = size.map_or([1.0; 2], |Size { width, height }| [f64::from(width), f64::from(height)]);
        let unit = w.max(h);
        let focal = Focal::Pixels([number("f")? * unit / FILM; 2]);
        let center = Some([0.5 * w + number("px")? * unit, 0.5 * h + number("py")? * unit]);
        Ok(Intrinsics { size: size.map(|_| [w, h]), focal, center, lens })
    }
}

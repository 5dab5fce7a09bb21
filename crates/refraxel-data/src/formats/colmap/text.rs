//! `cameras.txt`, `images.txt`, `points3D.txt`.

use super::models::Calibration;
use super::records::{Calibrations, Image, Point};
use crate::DataError;
use refraxel_core::Vec3;
use std::path::Path;
use std::str::FromStr;

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS…` per line.
pub(super) fn cameras(path: &Path, text: &str) -> Result<Calibrations, DataError> {
    const EXPECTED: &str = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...";
    let mut cameras = Calibrations::new();
    for (line, key) in lines(text) {
        let mut fields = Fields { path, key: &key, line, rest: line, expected: EXPECTED };
        let (id, model) = (fields.parse()?, fields.parse::<String>()?.to_ascii_uppercase());
        let size = [fields.parse()?, fields.parse()?];
        let parameters = fields.rest.split_whitespace().map(f64::from_str).collect::<Result<_, _>>();
        let parameters = parameters.map_err(|_| fields.fault())?;
        cameras.insert(id, Calibration { path: path.to_owned(), key, model, size, parameters });
    }
    Ok(cameras)
}

/// Two lines per image: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME` and its observations, which may be empty. The
/// name may contain spaces.
pub(super) fn images(path: &Path, text: &str) -> Result<Vec<Image>, DataError> {
    const EXPECTED: &str = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and then a line of observations";
    let mut images = Vec::new();
    let mut all = text.lines().enumerate();
    while let Some((number, line)) = all.next() {
        if is_blank(line) {
            continue;
        }
        let key = format!("line {}", number + 1);
        let mut fields = Fields { path, key: &key, line, rest: line, expected: EXPECTED };
        let _id: u32 = fields.parse()?;
        let quaternion = [fields.parse()?, fields.parse()?, fields.parse()?, fields.parse()?];
        let translation = [fields.parse()?, fields.parse()?, fields.parse()?];
        let camera = fields.parse()?;
        let name = fields.rest.trim().to_owned();
        if name.is_empty() {
            return Err(fields.fault());
        }
        images.push(Image { key, quaternion, translation, camera, name });
        all.next(); // observations
    }
    Ok(images)
}

/// `POINT3D_ID X Y Z R G B ERROR TRACK…` per line. Points that are not finite are dropped.
pub(super) fn points(path: &Path, text: &str) -> Result<Vec<Point>, DataError> {
    const EXPECTED: &str = "POINT3D_ID X Y Z R G B ERROR TRACK...";
    let mut points = Vec::new();
    for (line, key) in lines(text) {
        let mut fields = Fields { path, key: &key, line, rest: line, expected: EXPECTED };
        let _id: u64 = fields.parse()?;
        let position = Vec3::new(fields.parse()?, fields.parse()?, fields.parse()?);
        // Behind three values of colour; programs that only look for positions leave both out.
        let error = fields.rest.split_whitespace().nth(3).and_then(|e| e.parse().ok());
        points.extend(position.is_finite().then_some(Point { position, error }));
    }
    Ok(points)
}

fn is_blank(line: &str) -> bool {
    line.trim().is_empty() || line.trim_start().starts_with('#')
}

/// Lines that are neither empty nor comments, with their name for messages.
fn lines(text: &str) -> impl Iterator<Item = (&str, String)> {
    let numbered = text.lines().enumerate().filter(|(_, line)| !is_blank(line));
    numbered.map(|(i, line)| (line, format!("line {}", i + 1)))
}

/// The fields of one line, from the left.
struct Fields<'a> {
    path: &'a Path,
    key: &'a str,
    line: &'a str,
    rest: &'a str,
    expected: &'static str,
}

impl Fields<'_> {
    fn parse<T: FromStr>(&mut self) -> Result<T, DataError> {
        let rest = self.rest.trim_start();
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        let (field, rest) = rest.split_at(end);
        self.rest = rest;
        field.parse().map_err(|_| self.fault())
    }

    fn fault(&self) -> DataError {
        let found = format!("{:?}", self.line.chars().take(80).collect::<String>());
        let (path, key) = (self.path.to_owned(), self.key.to_owned());
        DataError::Value { path, key, found, expected: self.expected }
    }
}

//! `cameras.txt`, `images.txt`, `points3D.txt`.

use super::models::Calibration;
use super::records::{Calibrations, Image, Images, Point};
use crate::DataError;
use refraxel_core::Vec3;
use std::collections::HashSet;
use std::path::Path;
use std::str::FromStr;

/// `CAMERA_ID MODEL WIDTH HEIGHT PARAMS…` per line. Lines that make no sense are refused where images use a camera that no
/// other line states.
pub(super) fn cameras(path: &Path, text: &str, used: &HashSet<u32>) -> Result<Calibrations, DataError> {
    let mut cameras = Calibrations::new();
    let mut refused = None;
    for (line, key) in lines(text) {
        match camera(path, line, &key) {
            Ok((id, calibration)) => drop(cameras.insert(id, calibration)),
            Err(error) => drop(refused.get_or_insert(error)),
        }
    }
    match refused {
        Some(error) if !used.iter().all(|id| cameras.contains_key(id)) => Err(error),
        _ => Ok(cameras),
    }
}

fn camera(path: &Path, line: &str, key: &str) -> Result<(u32, Calibration), DataError> {
    const EXPECTED: &str = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS...";
    let mut fields = Fields { path, key, line, rest: line, expected: EXPECTED };
    let (id, model) = (fields.parse()?, fields.parse::<String>()?.to_ascii_uppercase());
    let size = [fields.parse()?, fields.parse()?];
    let parameters = fields.rest.split_whitespace().map(f64::from_str).collect::<Result<_, _>>();
    let parameters = parameters.map_err(|_| fields.fault())?;
    Ok((id, Calibration { path: path.to_owned(), key: key.to_owned(), model, size, parameters }))
}

/// Two lines per image: `IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME` and its observations, which may be empty. The
/// name may contain spaces.
///
/// Which is which is told by what they hold: files that were written by hand, or whose empty lines were dropped, lack lines
/// of observations.
pub(super) fn images(path: &Path, text: &str) -> Result<Images, DataError> {
    let mut images = Images::default();
    let mut is_behind_image = false;
    for (line, key) in lines(text) {
        if is_behind_image && are_observations(line) {
            is_behind_image = false;
        } else {
            images.all.push(image(path, line, &key)?);
            is_behind_image = true;
        }
    }
    let (stated, found) = (stated_count(text), images.all.len());
    if let Some(stated) = stated.filter(|stated| *stated != found) {
        images.doubts.push(format!(
            "{}: its head states {stated} images, but it lists {found}; export the model again if some are missing",
            path.display()
        ));
    }
    Ok(images)
}

fn image(path: &Path, line: &str, key: &str) -> Result<Image, DataError> {
    const EXPECTED: &str = "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and then a line of observations";
    let mut fields = Fields { path, key, line, rest: line, expected: EXPECTED };
    let id = fields.parse()?;
    let quaternion = [fields.parse()?, fields.parse()?, fields.parse()?, fields.parse()?];
    let translation = [fields.parse()?, fields.parse()?, fields.parse()?];
    let camera = fields.parse()?;
    let name = fields.rest.trim().to_owned();
    if name.is_empty() {
        return Err(fields.fault());
    }
    Ok(Image { id, key: key.to_owned(), quaternion, translation, camera, name })
}

/// Whether a line holds numbers only, but not as many as an image whose name is a number.
fn are_observations(line: &str) -> bool {
    const FIELDS_OF_IMAGE: usize = 10;
    let count = line.split_whitespace().count();
    count != FIELDS_OF_IMAGE && line.split_whitespace().all(|field| field.parse::<f64>().is_ok())
}

/// What the comment `# Number of images: 12, mean observations per image: 340` states.
fn stated_count(text: &str) -> Option<usize> {
    let comments = text.lines().map(str::trim_start).take_while(|line| is_blank(line));
    let stated =
        comments.filter_map(|line| line.strip_prefix('#')?.trim_start().strip_prefix("Number of images:"));
    let digits = |rest: &str| rest.trim_start().split(|c: char| !c.is_ascii_digit()).next()?.parse().ok();
    stated.filter_map(digits).next()
}

/// `POINT3D_ID X Y Z R G B ERROR TRACK…` per line. Points that are not finite are dropped. Of tracks, those of the `wanted`
/// images are kept.
pub(super) fn points(path: &Path, text: &str, wanted: &HashSet<u32>) -> Result<Vec<Point>, DataError> {
    const EXPECTED: &str = "POINT3D_ID X Y Z R G B ERROR TRACK...";
    let mut points = Vec::new();
    for (line, key) in lines(text) {
        let mut fields = Fields { path, key: &key, line, rest: line, expected: EXPECTED };
        let _id: u64 = fields.parse()?;
        let position = Vec3::new(fields.parse()?, fields.parse()?, fields.parse()?);
        // Programs that only look for positions leave colour and error out.
        let mut rest = fields.rest.split_whitespace();
        let mut channel = || rest.next().and_then(|c| c.parse().ok());
        let colour = [channel(), channel(), channel()];
        let colour = colour.into_iter().collect::<Option<Vec<u8>>>().and_then(|c| c.try_into().ok());
        let error = rest.next().and_then(|e| e.parse().ok());
        let track = rest.step_by(2).filter(|_| !wanted.is_empty()).filter_map(|id| id.parse().ok());
        let seen_by = track.filter(|id| wanted.contains(id)).collect();
        points.extend(position.is_finite().then_some(Point { position, error, colour, seen_by }));
    }
    Ok(points)
}

/// `RIG_ID NUM_SENSORS …` per line. The largest number of sensors.
pub(super) fn most_sensors(path: &Path, text: &str) -> Result<u32, DataError> {
    const EXPECTED: &str = "RIG_ID NUM_SENSORS REF_SENSOR_TYPE REF_SENSOR_ID SENSORS...";
    let mut most = 0;
    for (line, key) in lines(text) {
        let mut fields = Fields { path, key: &key, line, rest: line, expected: EXPECTED };
        let _id: u32 = fields.parse()?;
        most = most.max(fields.parse()?);
    }
    Ok(most)
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

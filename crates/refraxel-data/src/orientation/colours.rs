//! Whether points of the scene have the colours of the pixels where pictures show them: with pixels as they are stored, and
//! as an orientation tag turns them.

use super::picture::{Orientation, Picture};
use crate::formats::{colmap, ply};
use crate::parsed::{Coloured, ParsedDataset, Sighting};
use crate::size::Size;
use crate::{DataError, decoding, pose};
use ::image::{DynamicImage, RgbImage};
use refraxel_core::Camera;
use std::collections::HashMap;

/// How well points agree with pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Agreement {
    /// Points, each counted as often as it is seen.
    pub samples: usize,
    /// Correlation of colours in the orientation that is taken.
    pub taken: f64,
    /// Correlation of colours in the other one.
    pub other: f64,
}

/// Pictures that are looked at, at most.
const PICTURES: usize = 8;
/// The longer edge of what is looked at [pixel]: each pixel of it is the mean of an area.
const EDGE: u32 = 1024;
/// Points that are looked for in one picture, at most.
const POINTS: usize = 4000;
/// Fewer samples say nothing.
const FEWEST: usize = 20;
/// The weakest correlation that is one.
const WEAKEST: f64 = 0.3;
/// How many standard errors Fisher's transforms of two correlations are apart where one is better.
const ERRORS: f64 = 4.0;

/// The orientation in which coloured points agree with the pixels, if there are such points and it is clear.
pub(crate) fn agreement(
    parsed: &ParsedDataset,
    tagged: &[&Picture],
) -> Result<Option<(Orientation, Agreement)>, DataError> {
    let some: Vec<&Picture> =
        tagged.iter().copied().step_by(tagged.len().div_ceil(PICTURES).max(1)).collect();
    let names: Vec<&str> = some.iter().map(|(frame, _)| frame.file.as_str()).collect();
    let sightings = sightings(parsed, &names)?;
    let (mut stored, mut upright) = (Pairs::default(), Pairs::default());
    for picture in some {
        let seen = sightings.get(picture.0.file.as_str()).map_or(&[][..], Vec::as_slice);
        compare(picture, seen, &mut stored, &mut upright)?;
    }
    Ok(better(&stored, &upright))
}

/// Of each of these images the coloured points that it may show. Files of points that are damaged show none.
fn sightings(parsed: &ParsedDataset, names: &[&str]) -> Result<HashMap<String, Vec<Sighting>>, DataError> {
    match &parsed.coloured {
        None => Ok(HashMap::new()),
        Some(Coloured::Colmap(model)) => colmap::sightings(model, names),
        Some(Coloured::Ply(path)) => {
            let all = ply::coloured_points(path)?;
            Ok(names.iter().map(|name| ((*name).to_owned(), all.clone())).collect())
        }
    }
}

/// Colours of points, and of the pixels where they are seen.
#[derive(Default)]
struct Pairs(Vec<[[f64; 3]; 2]>);

fn compare(
    (frame, header): &Picture,
    seen: &[Sighting],
    stored: &mut Pairs,
    upright: &mut Pairs,
) -> Result<(), DataError> {
    let (Some(image), Ok(checked)) = (&frame.image, pose::check(&frame.pose)) else { return Ok(()) };
    if seen.is_empty() {
        return Ok(());
    }
    let unturned = small(decoding::decode(image)?.image);
    let mut turned = DynamicImage::from(unturned.clone());
    turned.apply_orientation(header.orientation);
    let turned = turned.into_rgb8();
    let camera = |picture: &RgbImage| {
        let size = Size { width: picture.width(), height: picture.height() };
        frame.intrinsics.camera(size, checked.pose, &frame.origin)
    };
    let cameras = [camera(&unturned)?, camera(&turned)?];
    for sighting in seen.iter().step_by(seen.len().div_ceil(POINTS)) {
        let pixel = |k: usize, picture| colour_at(&cameras[k], picture, sighting);
        if let (Some(as_stored), Some(as_turned)) = (pixel(0, &unturned), pixel(1, &turned)) {
            let colour = sighting.colour.map(f64::from);
            stored.0.push([colour, as_stored]);
            upright.0.push([colour, as_turned]);
        }
    }
    Ok(())
}

fn small(picture: DynamicImage) -> RgbImage {
    let fits = picture.width().max(picture.height()) <= EDGE;
    if fits { picture.into_rgb8() } else { picture.thumbnail(EDGE, EDGE).into_rgb8() }
}

fn colour_at(camera: &Camera, picture: &RgbImage, sighting: &Sighting) -> Option<[f64; 3]> {
    let [u, v] = camera.project(sighting.position)?;
    let is_inside = u >= 0.0 && v >= 0.0 && u < f64::from(picture.width()) && v < f64::from(picture.height());
    is_inside.then(|| picture.get_pixel(u as u32, v as u32).0.map(f64::from))
}

impl Pairs {
    /// Correlation of all channels together, each about its own mean; 0 where one side has no differences.
    fn correlation(&self) -> f64 {
        let n = self.0.len() as f64;
        let (mut covariance, mut variances) = (0.0, [0.0; 2]);
        for channel in 0..3 {
            let mean = |side: usize| self.0.iter().map(|pair| pair[side][channel]).sum::<f64>() / n;
            let means = [mean(0), mean(1)];
            for pair in &self.0 {
                let [a, b] = [0, 1].map(|side| pair[side][channel] - means[side]);
                covariance += a * b;
                variances[0] += a * a;
                variances[1] += b * b;
            }
        }
        let both = (variances[0] * variances[1]).sqrt();
        if both > 0.0 { covariance / both } else { 0.0 }
    }
}

fn better(stored: &Pairs, upright: &Pairs) -> Option<(Orientation, Agreement)> {
    let samples = stored.0.len();
    if samples < FEWEST {
        return None;
    }
    let [of_stored, of_upright] = [stored, upright].map(Pairs::correlation);
    let (orientation, taken, other) = match of_stored >= of_upright {
        true => (Orientation::Stored, of_stored, of_upright),
        false => (Orientation::Upright, of_upright, of_stored),
    };
    let transform = |r: f64| r.clamp(-0.999, 0.999).atanh();
    let error = (2.0 / (samples as f64 - 3.0)).sqrt();
    let is_clear = taken > WEAKEST && transform(taken) - transform(other) > ERRORS * error;
    is_clear.then_some((orientation, Agreement { samples, taken, other }))
}

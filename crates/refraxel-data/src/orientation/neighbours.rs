//! Whether neighbouring photographs show the same things where their poses say: with pixels as they are stored, and as an orientation
//! tag turns them.

use super::picture::{Orientation, Picture};
use crate::looks::chosen;
use crate::rigid::{self, Posed, Score};
use crate::size::Size;
use crate::{DataError, Image, Pixels, decoding, pose};
use ::image::DynamicImage;
use refraxel_core::{Camera, Vec3};
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::path::Path;

/// The longer edge of what is looked at [pixel].
const EDGE: u32 = 192;
/// By how many standard errors one orientation has to be better.
const ERRORS: f64 = 4.0;
/// So many photographs with a tag are enough to be compared with each other.
const MANY: usize = 6;
/// Photographs without a tag that one is compared with: 4 give some 200 patches, whose mean is known to 0.02.
const NEIGHBOURS: usize = 4;

/// How well photographs agree in the orientation that is taken, and in the other one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scores {
    pub taken: Score,
    pub other: Score,
}

/// The orientation in which photographs with a tag agree with their neighbours, if it is clear: with each other, or, where they are few,
/// with photographs that have none.
pub(crate) fn agreement(pictures: &[Picture]) -> Result<Option<(Orientation, Scores)>, DataError> {
    let posed = (0..pictures.len()).filter(|&k| pose::check(&pictures[k].0.pose).is_ok());
    let (tagged, others): (Vec<usize>, Vec<usize>) = posed.partition(|&k| pictures[k].1.turned());
    let place = |k: usize| pictures[k].0.pose.translation;
    let looked = |k: usize| looked_at(&pictures[k]);
    let chosen = chosen(place, &tagged, 0.0);
    let of_tagged = chosen.iter().map(|&k| looked(k)).collect::<Result<Vec<_>, _>>()?;
    if tagged.len() >= MANY || others.is_empty() {
        let score = |side: usize| {
            rigid::score(&of_tagged.iter().map(|sides| sides[side].posed()).collect::<Vec<_>>(), 0.0)
        };
        return Ok(better(score(0), score(1)));
    }
    let distance = rigid::distance_of(pictures.iter().map(|(frame, _)| frame.pose.translation));
    let mut gains = [Vec::new(), Vec::new()];
    let mut untagged = HashMap::new(); // several may have the same neighbours
    for (&k, sides) in chosen.iter().zip(&of_tagged) {
        for near in nearest(place, k, &others) {
            let [other, _] = match untagged.entry(near) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(looked(near)?),
            };
            for (side, gains) in sides.iter().zip(&mut gains) {
                gains.extend(rigid::gains_of_all(side.posed(), other.posed(), distance));
                gains.extend(rigid::gains_of_all(other.posed(), side.posed(), distance));
            }
        }
    }
    let [stored, upright] = gains.map(|gains| Score::of(&gains));
    Ok(better(stored, upright))
}

/// The nearest of some photographs.
fn nearest(place: impl Fn(usize) -> Vec3<f64>, of: usize, among: &[usize]) -> Vec<usize> {
    let mut among = among.to_vec();
    among.sort_by(|&a, &b| (place(a) - place(of)).length().total_cmp(&(place(b) - place(of)).length()));
    among.truncate(NEIGHBOURS);
    among
}

/// A small photograph in one orientation, and its camera.
struct Side {
    image: Image,
    camera: Camera,
}

impl Side {
    fn posed(&self) -> Posed<'_> {
        Posed { image: &self.image, camera: &self.camera }
    }
}

/// A photograph as it is stored, and as its tag turns it.
fn looked_at((frame, header): &Picture) -> Result<[Side; 2], DataError> {
    let image = frame.image.as_deref().unwrap_or(Path::new(""));
    let mut unturned = decoding::decode(image)?.image;
    if unturned.width().max(unturned.height()) > EDGE {
        unturned = unturned.thumbnail(EDGE, EDGE);
    }
    let mut turned = unturned.clone();
    turned.apply_orientation(header.orientation);
    let pose = pose::check(&frame.pose).map_or(frame.pose, |checked| checked.pose);
    let side = |picture: DynamicImage| -> Result<Side, DataError> {
        let size = Size { width: picture.width(), height: picture.height() };
        let camera = frame.intrinsics.camera(size, pose, &frame.origin)?;
        Ok(Side { image: pixels(picture), camera })
    };
    Ok([side(unturned)?, side(turned)?])
}

fn pixels(picture: DynamicImage) -> Image {
    let (width, height) = (picture.width(), picture.height());
    Image { width, height, channels: 3, pixels: Pixels::U8(picture.into_rgb8().into_raw()) }
}

fn better(stored: Option<Score>, upright: Option<Score>) -> Option<(Orientation, Scores)> {
    let (stored, upright) = stored.zip(upright)?;
    let (orientation, taken, other) = match stored.mean >= upright.mean {
        true => (Orientation::Stored, stored, upright),
        false => (Orientation::Upright, upright, stored),
    };
    (taken.is_rigid() && taken.is_above(other, ERRORS)).then_some((orientation, Scores { taken, other }))
}

//! Whether neighbouring photographs show the same things where their poses say: with pixels as they are stored, and as an orientation
//! tag turns them.

use super::picture::{Orientation, Picture};
use crate::looks::chosen;
use crate::rigid::{self, Posed, Score};
use crate::size::Size;
use crate::{DataError, Image, Pixels, decoding, pose};
use ::image::DynamicImage;
use refraxel_core::Camera;

/// The longer edge of what is looked at [pixel].
const EDGE: u32 = 192;
/// By how many standard errors one orientation has to be better.
const ERRORS: f64 = 4.0;

/// How well photographs agree in the orientation that is taken, and in the other one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scores {
    pub taken: Score,
    pub other: Score,
}

/// The orientation in which photographs agree with their neighbours, if it is clear.
pub(crate) fn agreement(tagged: &[&Picture]) -> Result<Option<(Orientation, Scores)>, DataError> {
    let posed: Vec<usize> = (0..tagged.len()).filter(|&k| pose::check(&tagged[k].0.pose).is_ok()).collect();
    let [mut stored, mut upright] = [Vec::new(), Vec::new()];
    for k in chosen(|k| tagged[k].0.pose.translation, &posed, 0.0) {
        let (frame, header) = tagged[k];
        let (Some(image), Ok(checked)) = (&frame.image, pose::check(&frame.pose)) else { continue };
        let unturned = decoding::decode(image)?.image;
        let unturned = if unturned.width().max(unturned.height()) > EDGE {
            unturned.thumbnail(EDGE, EDGE)
        } else {
            unturned
        };
        let mut turned = unturned.clone();
        turned.apply_orientation(header.orientation);
        for (picture, all) in [(unturned, &mut stored), (turned, &mut upright)] {
            let size = Size { width: picture.width(), height: picture.height() };
            let camera = frame.intrinsics.camera(size, checked.pose, &frame.origin)?;
            all.push((pixels(picture), camera));
        }
    }
    let [as_stored, as_upright] = [&stored, &upright].map(|all: &Vec<(Image, Camera)>| {
        rigid::score(&all.iter().map(|(image, camera)| Posed { image, camera }).collect::<Vec<_>>(), 0.0)
    });
    Ok(as_stored.zip(as_upright).and_then(|(stored, upright)| better(stored, upright)))
}

fn pixels(picture: DynamicImage) -> Image {
    let (width, height) = (picture.width(), picture.height());
    Image { width, height, channels: 3, pixels: Pixels::U8(picture.into_rgb8().into_raw()) }
}

fn better(stored: Score, upright: Score) -> Option<(Orientation, Scores)> {
    let (orientation, taken, other) = match stored.mean >= upright.mean {
        true => (Orientation::Stored, stored, upright),
        false => (Orientation::Upright, upright, stored),
    };
    (taken.is_rigid() && taken.is_above(other, ERRORS)).then_some((orientation, Scores { taken, other }))
}

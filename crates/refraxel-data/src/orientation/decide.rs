//! Which orientation is taken, and why.

use super::colours::{self, Agreement};
use super::neighbours::{self, Scores};
use super::picture::{Orientation, Picture};
use crate::parsed::ParsedDataset;
use crate::{DataError, Format, Problem};

/// Why an orientation was taken.
enum Ground {
    Asked,
    /// The cameras state the shape.
    Shape,
    /// Of some views the shape says this, of so many others the opposite.
    Shapes {
        against: usize,
    },
    /// Points of the scene have the colours of the pixels where they are seen.
    Colours(Agreement),
    /// Neighbouring photographs show the same things where their poses say.
    Neighbours(Scores),
    /// Nothing tells; programs that write the format do so.
    Format,
}

/// The orientation of each picture, in their order, and what was decided and why where some have a tag.
pub(crate) fn decide(
    parsed: &ParsedDataset,
    pictures: &[Picture<'_>],
    asked: Option<Orientation>,
) -> Result<(Vec<Orientation>, Option<Problem>), DataError> {
    let tagged: Vec<&Picture> = pictures.iter().filter(|(_, header)| header.turned()).collect();
    if tagged.is_empty() {
        return Ok((vec![Orientation::Upright; pictures.len()], None));
    }
    let (taken, ground) = ground(parsed, pictures, &tagged, asked)?;
    let by_itself = matches!(ground, Ground::Shapes { .. });
    let of = |picture: &Picture| if by_itself { by_shape(picture).unwrap_or(taken) } else { taken };
    let problem = problem(parsed.format, [tagged.len(), pictures.len()], taken, &ground);
    Ok((pictures.iter().map(of).collect(), Some(problem)))
}

fn ground(
    parsed: &ParsedDataset,
    pictures: &[Picture],
    tagged: &[&Picture],
    asked: Option<Orientation>,
) -> Result<(Orientation, Ground), DataError> {
    if let Some(asked) = asked {
        return Ok((asked, Ground::Asked));
    }
    let count = |of| tagged.iter().filter(|picture| by_shape(picture) == Some(of)).count();
    let (stored, upright) = (count(Orientation::Stored), count(Orientation::Upright));
    let most = if stored >= upright { Orientation::Stored } else { Orientation::Upright };
    match stored.min(upright) {
        0 if stored.max(upright) > 0 => Ok((most, Ground::Shape)),
        0 => {
            if let Some((taken, agreement)) = colours::agreement(parsed, tagged)? {
                return Ok((taken, Ground::Colours(agreement)));
            }
            let by_neighbours = neighbours::agreement(pictures)?;
            Ok(by_neighbours.map_or((Orientation::Stored, Ground::Format), |(taken, scores)| {
                (taken, Ground::Neighbours(scores))
            }))
        }
        against => Ok((most, Ground::Shapes { against })),
    }
}

/// A shape within this is square: the logarithm of width over height.
const SQUARE: f64 = 0.02;

/// What the shape that the camera states says: its size, or else twice its principal point. `None` where both readings have
/// the same shape, or nothing is stated.
fn by_shape((frame, header): &Picture) -> Option<Orientation> {
    let stated = frame.intrinsics.size.or(frame.intrinsics.center)?;
    let lean = |[w, h]: [f64; 2]| Some((w / h).ln()).filter(|l| l.abs() > SQUARE);
    let of = |size: crate::Size| lean([f64::from(size.width), f64::from(size.height)]);
    let (stated, stored, upright) = (lean(stated)?, of(header.stored)?, of(header.upright())?);
    match [stored, upright].map(|l| (l > 0.0) == (stated > 0.0)) {
        [true, false] => Some(Orientation::Stored),
        [false, true] => Some(Orientation::Upright),
        _ => None,
    }
}

fn problem(format: Format, [tagged, all]: [usize; 2], taken: Orientation, ground: &Ground) -> Problem {
    let done = match taken {
        Orientation::Stored => "taken as they are stored",
        Orientation::Upright => "turned upright",
    };
    let writes = match format {
        Format::Colmap => "COLMAP poses pixels as they are stored".to_owned(),
        _ => format!("most programs that write {} pose pixels as they are stored", format.name()),
    };
    let why = match ground {
        Ground::Asked => "as was asked for".to_owned(),
        Ground::Shape => "because their cameras state that shape".to_owned(),
        Ground::Shapes { against } => {
            format!(
                "because their cameras state that shape, except {against}, whose cameras state the other one"
            )
        }
        Ground::Colours(Agreement { samples, taken, other }) => format!(
            "because {samples} points of the scene then have the colours of their pixels (correlation {taken:.2}, otherwise \
             {other:.2})"
        ),
        Ground::Neighbours(Scores { taken, other }) => format!(
            "because neighbouring photographs then show the same things where their poses say (gain of correlation {:.2}, otherwise \
             {:.2})",
            taken.mean, other.mean
        ),
        Ground::Format => format!("because {writes}; nothing else decides it"),
    };
    let message = format!(
        "{tagged} of {all} images have an EXIF orientation; they are {done}, {why} (--orientation {} overrides this)",
        taken.other().name()
    );
    let is_sure = match ground {
        Ground::Asked | Ground::Shape | Ground::Colours(_) | Ground::Neighbours(_) => true,
        Ground::Shapes { .. } => false,
        Ground::Format => format == Format::Colmap,
    };
    if is_sure { Problem::note(message) } else { Problem::warning(message) }
}

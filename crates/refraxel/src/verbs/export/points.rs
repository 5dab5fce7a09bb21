//! Binary PLY of coloured points.

use super::surfaces::{place_type, write_place};
use super::surroundings::Point;
use crate::verbs::ply_header::{BINARY, Element, write_header};
use refraxel_data::{LocalOrigin, quantize};
use std::io::{self, Write};

/// Writes points with their colours, in world coordinates, of double precision where these are far from their `origin`.
pub fn write(points: &[Point], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    let vertex = Element::new("vertex", points.len())
        .with(place_type(origin), ["x", "y", "z"])
        .with("uchar", ["red", "green", "blue"]);
    let comment = "points by refraxel, world coordinates of the dataset".to_owned();
    write_header(BINARY, &[comment], &[vertex], out)?;
    for point in points {
        write_place(point.place, origin, out)?;
        out.write_all(&point.colour.map(quantize))?;
    }
    Ok(())
}

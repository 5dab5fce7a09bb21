//! Binary PLY of coloured points.

use super::surfaces::{bytes, place_type, write_place};
use super::surroundings::Point;
use refraxel_data::LocalOrigin;
use std::io::{self, Write};

/// Writes points with their colours, in world coordinates, of double precision where these are far from their `origin`.
pub fn write(points: &[Point], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "comment points by refraxel, world coordinates of the dataset")?;
    writeln!(out, "element vertex {}", points.len())?;
    for name in ["x", "y", "z"] {
        writeln!(out, "property {} {name}", place_type(origin))?;
    }
    for name in ["red", "green", "blue"] {
        writeln!(out, "property uchar {name}")?;
    }
    writeln!(out, "end_header")?;
    for point in points {
        write_place(point.place, origin, out)?;
        out.write_all(&bytes(point.colour))?;
    }
    Ok(())
}

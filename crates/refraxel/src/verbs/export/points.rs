//! Binary PLY of coloured points.

use super::surfaces::{bytes, narrow};
use super::surroundings::Point;
use refraxel_data::LocalOrigin;
use std::io::{self, Write};

/// Writes points with their colours, in world coordinates, of double precision where these are far from their `origin`.
pub fn write(points: &[Point], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "comment points by refraxel, world coordinates of the dataset")?;
    writeln!(out, "element vertex {}", points.len())?;
    let is_single = origin.is_of_world();
    for name in ["x", "y", "z"] {
        writeln!(out, "property {} {name}", if is_single { "float" } else { "double" })?;
    }
    for name in ["red", "green", "blue"] {
        writeln!(out, "property uchar {name}")?;
    }
    writeln!(out, "end_header")?;
    for point in points {
        match is_single {
            true => narrow(point.place).iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?,
            false => point.place.to_array().iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?,
        }
        out.write_all(&bytes(point.colour))?;
    }
    Ok(())
}

//! Binary PLY: vertices with normals, faces with the number of their region.

use super::surfaces::{Numbered, narrow};
use std::io::{self, Write};

/// Writes all surfaces into one file.
pub fn write(surfaces: &[Numbered], out: &mut dyn Write) -> io::Result<()> {
    let meshes = surfaces.iter().map(|s| &s.surface.mesh);
    let vertices: usize = meshes.clone().map(|m| m.vertices.len()).sum();
    let faces: usize = meshes.clone().map(|m| m.triangles.len()).sum();
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "comment refractive surfaces by refraxel, world coordinates of the dataset")?;
    for Numbered { region, surface } in surfaces {
        writeln!(out, "comment region {region}: index of refraction {}", surface.index)?;
    }
    writeln!(out, "element vertex {vertices}")?;
    for name in ["x", "y", "z", "nx", "ny", "nz"] {
        writeln!(out, "property float {name}")?;
    }
    writeln!(
        out,
        "element face {faces}\nproperty list uchar int vertex_indices\nproperty int region\nend_header"
    )?;
    for mesh in meshes {
        for (&x, &normal) in mesh.vertices.iter().zip(&mesh.normals) {
            for v in [narrow(x), narrow(normal)].as_flattened() {
                out.write_all(&v.to_le_bytes())?;
            }
        }
    }
    let mut first = 0;
    for Numbered { region, surface } in surfaces {
        for corners in &surface.mesh.triangles {
            out.write_all(&[3])?;
            for v in corners.map(|v| v + first).into_iter().chain([*region as u32]) {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        first += surface.mesh.vertices.len() as u32;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::surfaces::ball_and_shell;
    use super::*;
    use refraxel_core::vec3;
    use refraxel_data::read_mesh;
    use refraxel_data::synth::Shape;

    #[test]
    fn the_reader_of_meshes_finds_the_glass_and_the_air_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("glass.ply");
        let mut bytes = Vec::new();
        write(&ball_and_shell(), &mut bytes).unwrap();
        std::fs::write(&file, bytes).unwrap();
        let shape = Shape::Mesh(read_mesh(&file).unwrap());
        for (x, inside) in
            [(0.1, true), (0.49, true), (0.52, false), (4.0, false), (4.25, false), (4.5, true)]
        {
            assert_eq!(shape.contains(vec3(x, 0.02, 0.01)), inside, "{x}");
        }
    }
}

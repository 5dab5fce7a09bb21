//! Binary PLY: vertices with normals and colours, faces with the number of their region.

use super::surfaces::{Solid, narrow, place_type, write_place};
use crate::verbs::ply_header::{BINARY, Element, write_header};
use refraxel_data::{LocalOrigin, OPAQUE_REGION};
use std::io::{self, Write};

/// Writes everything solid into one file. Coordinates that are far from their `origin` have double precision.
pub fn write(solids: &[Solid], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    let vertices: usize = solids.iter().map(|s| s.mesh.vertices.len()).sum();
    let faces: usize = solids.iter().map(|s| s.mesh.triangles.len()).sum();
    let mut comments = vec!["surfaces by refraxel, world coordinates of the dataset".to_owned()];
    comments.extend(solids.iter().any(|s| s.region == 0).then(|| OPAQUE_REGION.to_owned()));
    let index = |s: &Solid| Some(format!("region {}: index of refraction {}", s.region, s.index?));
    comments.extend(solids.iter().filter_map(index));
    let vertex = Element::new("vertex", vertices)
        .with(place_type(origin), ["x", "y", "z"])
        .with("float", ["nx", "ny", "nz"])
        .with("uchar", ["red", "green", "blue"]);
    let face = Element::new("face", faces).with("list uchar int", ["vertex_indices"]).with("int", ["region"]);
    write_header(BINARY, &comments, &[vertex, face], out)?;
    for solid in solids {
        for (v, (&x, &normal)) in solid.mesh.vertices.iter().zip(&solid.mesh.normals).enumerate() {
            write_place(x, origin, out)?;
            narrow(normal).iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
            out.write_all(&solid.bytes(v))?;
        }
    }
    let mut first = 0;
    for Solid { region, mesh, .. } in solids {
        for corners in &mesh.triangles {
            out.write_all(&[3])?;
            for v in corners.map(|v| v + first).into_iter().chain([*region as u32]) {
                out.write_all(&v.to_le_bytes())?;
            }
        }
        first += mesh.vertices.len() as u32;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::surfaces::{Numbered, ball_and_shell};
    use super::*;
    use refraxel_core::{Mesh, vec3};
    use refraxel_data::read_mesh;
    use refraxel_data::synth::Shape;

    #[test]
    fn what_is_far_away_keeps_its_digits() {
        let origin = LocalOrigin::at(vec3(471_232.0, 5_270_144.0, 528.0));
        let mut surfaces = ball_and_shell();
        for surface in &mut surfaces {
            surface.surface.mesh.vertices.iter_mut().for_each(|x| *x = origin.to_world(*x));
        }
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("glass.ply");
        let mut bytes = Vec::new();
        write(&surfaces.iter().map(Numbered::solid).collect::<Vec<_>>(), origin, &mut bytes).unwrap();
        std::fs::write(&file, bytes).unwrap();
        let shape = Shape::Mesh(read_mesh(&file).unwrap());
        for (x, inside) in [(0.49, true), (0.52, false), (4.25, false), (4.5, true)] {
            assert_eq!(shape.contains(origin.to_world(vec3(x, 0.02, 0.01))), inside, "{x}");
        }
    }

    #[test]
    fn the_reader_of_meshes_finds_the_glass_and_the_air_in_it() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("glass.ply");
        let mut bytes = Vec::new();
        // Before them something opaque, which is no glass.
        let (glass, opaque) = (ball_and_shell(), &ball_and_shell()[1].surface.mesh.clone());
        let far = Mesh { vertices: opaque.vertices.iter().map(|&x| x * 9.0).collect(), ..opaque.clone() };
        let mut solids = vec![Solid { region: 0, mesh: &far, colours: None, index: None }];
        solids.extend(glass.iter().map(Numbered::solid));
        write(&solids, LocalOrigin::default(), &mut bytes).unwrap();
        std::fs::write(&file, bytes).unwrap();
        let shape = Shape::Mesh(read_mesh(&file).unwrap());
        for (x, inside) in
            [(0.1, true), (0.49, true), (0.52, false), (4.0, false), (4.25, false), (4.5, true)]
        {
            assert_eq!(shape.contains(vec3(x, 0.02, 0.01)), inside, "{x}");
        }
    }
}

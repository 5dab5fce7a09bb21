//! Wavefront OBJ: one object per region, with the colours of vertices behind their positions.

use super::surfaces::{Solid, narrow};
use refraxel_data::LocalOrigin;
use refraxel_data::synth::OPAQUE_OBJECT;
use std::io::{self, Write};

/// Writes everything solid into one file.
pub fn write(solids: &[Solid], origin: LocalOrigin, out: &mut dyn Write) -> io::Result<()> {
    writeln!(
        out,
        "# surfaces by refraxel, world coordinates of the dataset; v has sRGB colours behind the position"
    )?;
    let mut first = 1;
    for Solid { region, mesh, colours, index } in solids {
        match index {
            Some(index) => writeln!(out, "# index of refraction {index}\no region_{region}")?,
            None => writeln!(out, "o {OPAQUE_OBJECT}")?,
        }
        for (v, &x) in mesh.vertices.iter().enumerate() {
            // As many digits as the place has: more where it is far from the origin of the world.
            let place = match origin.is_of_world() {
                true => narrow(x).map(|v| v.to_string()),
                false => x.to_array().map(|v| v.to_string()),
            };
            let [x, y, z] = place;
            match colours {
                Some(colours) => {
                    let [r, g, b] = colours[v];
                    writeln!(out, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}")?;
                }
                None => writeln!(out, "v {x} {y} {z} 1 1 1")?,
            }
        }
        for &normal in &mesh.normals {
            let [x, y, z] = narrow(normal);
            writeln!(out, "vn {x:.4} {y:.4} {z:.4}")?;
        }
        for [a, b, c] in mesh.triangles.iter().map(|t| t.map(|v| v as usize + first)) {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")?;
        }
        first += mesh.vertices.len();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::surfaces::{Numbered, ball_and_shell};
    use super::*;
    use refraxel_core::vec3;
    use refraxel_data::read_mesh;
    use refraxel_data::synth::Shape;

    #[test]
    fn vertices_have_their_colours_and_the_reader_of_meshes_finds_the_glass_alone() {
        let glass = ball_and_shell();
        let mesh = &glass[0].surface.mesh;
        let mut far = mesh.clone();
        far.vertices.iter_mut().for_each(|x| *x += vec3(0.0, 9.0, 0.0));
        let colours = vec![[1.0, 0.5, 0.25]; mesh.vertices.len()];
        let mut solids = vec![Solid { region: 0, mesh: &far, colours: Some(&colours), index: None }];
        solids.extend(glass.iter().map(Numbered::solid));
        let mut bytes = Vec::new();
        write(&solids, LocalOrigin::default(), &mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let lines = |start: &str| text.lines().filter(|l| l.starts_with(start)).count();
        let sum = |count: fn(&Solid) -> usize| solids.iter().map(count).sum::<usize>();
        assert_eq!(lines("v "), sum(|s| s.mesh.vertices.len()));
        assert_eq!(
            (lines("vn "), lines("f "), lines("o ")),
            (lines("v "), sum(|s| s.mesh.triangles.len()), 3)
        );
        assert!(text.lines().nth(2).is_some_and(|l| l.ends_with(" 1.0000 0.5000 0.2500")), "{:.200}", text);
        assert!(text.contains("# index of refraction 1.33\no region_3\n"));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.obj");
        std::fs::write(&file, text).unwrap();
        let shape = Shape::Mesh(read_mesh(&file).unwrap());
        for (x, y, inside) in [(0.49, 0.02, true), (4.0, 0.02, false), (4.5, 0.02, true), (0.0, 9.0, false)] {
            assert_eq!(shape.contains(vec3(x, y, 0.01)), inside, "{x} {y}");
        }
    }
}

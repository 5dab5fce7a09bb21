//! Files that say where rays bend: `--index-from`.

use super::small::{ball, train};
use super::{Answer, Target};
use crate::fuzz::Format;
use refraxel_core::{Aabb, Vec3};
use refraxel_data::{Dataset, IndexSource, OpenOptions, check_scale, scene_region};
use std::fs;
use std::path::{Path, PathBuf};

/// A tetrahedron inside of the scene.
const OBJ: &str = "v -0.4 -0.4 -0.5\nv 0.4 -0.4 -0.5\nv 0 0.4 -0.5\nv 0 0 0.3\n\
                   f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
const BODIES: &str = r#"{"refractive": [
 {"shape": "sphere", "center": [0, 0, 0], "radius": 0.5, "ior": 1.5},
 {"shape": "box", "min": [-0.2, -0.2, -0.2], "max": [0.1, 0.2, 0.2], "ior": 1.33}
]}
"#;

pub fn targets() -> Vec<Target> {
    use Format::{Binary, Text};
    let target = |name, format, prepare| Target { name, format, prepare, ask };
    vec![
        target("scene-json", Text, |at| ball(&at.join("data")).map(|()| at.join("data/scene.json"))),
        target("bodies-json", Text, |at| beside(at, "bodies.json", BODIES.as_bytes())),
        target("obj", Text, |at| beside(at, "mesh.obj", OBJ.as_bytes())),
        target("ply-text", Text, |at| beside(at, "mesh.ply", ply("ascii", &text_body()).as_slice())),
        target("ply", Binary, |at| {
            beside(
                at,
                "mesh.ply",
                ply("binary_little_endian", &binary_body(f32::to_le_bytes, i32::to_le_bytes)).as_slice(),
            )
        }),
        target("ply-big-endian", Binary, |at| {
            beside(
                at,
                "mesh.ply",
                ply("binary_big_endian", &binary_body(f32::to_be_bytes, i32::to_be_bytes)).as_slice(),
            )
        }),
        target("npz", Binary, |at| {
            ball(&at.join("data"))?;
            let entries = fs::read_dir(at.join("data"))?.flatten().map(|e| e.path());
            let found = entries.into_iter().find(|p| p.extension().is_some_and(|e| e == "npz"));
            found.ok_or_else(|| anyhow::anyhow!("the dataset has no index volume"))
        }),
        target("npy", Binary, |at| beside(at, "index.npy", &npy())),
    ]
}

fn beside(at: &Path, name: &str, content: &[u8]) -> anyhow::Result<PathBuf> {
    ball(&at.join("data"))?;
    fs::write(at.join(name), content)?;
    Ok(at.join(name))
}

fn ask(folder: &Path, file: &Path) -> Answer {
    // Where the file lies in the dataset, the dataset may refuse it.
    let data = match Dataset::open(folder.join("data"), &OpenOptions::default()) {
        Ok(data) => data,
        Err(error) => return Answer::Refused(error.to_string()),
    };
    let unit = Aabb::new(Vec3::splat(-0.5), Vec3::splat(0.5));
    let is_npy = file.extension().is_some_and(|e| e == "npy");
    let index = match IndexSource::read(file, is_npy.then_some(unit)) {
        Ok(index) => index,
        Err(error) => return Answer::Refused(error.to_string()),
    };
    if let Err(error) = check_scale("the file", &index.bounds(), &scene_region(&data).bounds) {
        return Answer::Refused(error.to_string());
    }
    train(data, Some(index))
}

const VERTICES: [[f32; 3]; 4] = [[-0.4, -0.4, -0.5], [0.4, -0.4, -0.5], [0.0, 0.4, -0.5], [0.0, 0.0, 0.3]];
const FACES: [[i32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn ply(format: &str, body: &[u8]) -> Vec<u8> {
    let head = format!(
        "ply\nformat {format} 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    );
    [head.as_bytes(), body].concat()
}

fn binary_body(float: fn(f32) -> [u8; 4], int: fn(i32) -> [u8; 4]) -> Vec<u8> {
    let vertices = VERTICES.iter().flatten().flat_map(|v| float(*v));
    let faces = FACES.iter().flat_map(|f| [vec![3], f.iter().flat_map(|i| int(*i)).collect()].concat());
    vertices.chain(faces).collect()
}

fn text_body() -> Vec<u8> {
    let vertices = VERTICES.map(|[x, y, z]| format!("{x} {y} {z}\n")).concat();
    let faces = FACES.map(|[a, b, c]| format!("3 {a} {b} {c}\n")).concat();
    (vertices + &faces).into_bytes()
}

/// An index of 4³ cells.
fn npy() -> Vec<u8> {
    let mut header = "{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4, 4), }".to_owned();
    header += &" ".repeat(63 - (header.len() + 10) % 64);
    header.push('\n');
    let values = (0..64).map(|i| if (i / 16) % 4 == 1 { 1.3_f32 } else { 1.0 });
    let length = (header.len() as u16).to_le_bytes();
    [
        b"\x93NUMPY\x01\x00",
        &length[..],
        header.as_bytes(),
        &values.flat_map(f32::to_le_bytes).collect::<Vec<_>>(),
    ]
    .concat()
}

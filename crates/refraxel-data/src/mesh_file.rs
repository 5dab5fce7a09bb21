//! Closed triangle meshes from OBJ and PLY files.

use crate::formats::ply;
use crate::synth::TriangleMesh;
use crate::{DataError, limits};
use refraxel_core::Aabb;
use std::cmp::Ordering;
use std::collections::HashMap;
use std::path::Path;

/// Reads a closed triangle mesh from a Wavefront `.obj` or a `.ply` file (ASCII or binary), in the file's coordinates.
///
/// Closed means that every edge belongs to an even number of triangles; vertices at the same place count as one. The
/// triangles may be turned either way.
pub fn read_mesh(path: &Path) -> Result<TriangleMesh, DataError> {
    let fault = |key: &str, found: String, expected| DataError::Value {
        path: path.to_owned(),
        key: key.into(),
        found,
        expected,
    };
    let unusable = |source| DataError::Mesh { path: path.to_owned(), source };
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    let mesh = match extension.as_str() {
        "obj" => TriangleMesh::from_obj(&limits::read_text(path)?).map_err(unusable)?,
        "ply" => {
            let content = limits::read(path, limits::BINARY_BYTES)?;
            let (vertices, triangles) = ply::mesh(path, &content)?;
            TriangleMesh::new(vertices, triangles).map_err(unusable)?
        }
        other => return Err(fault("the file type", format!("{other:?}"), "a mesh as .obj or .ply")),
    };
    let (vertices, _) = mesh.parts();
    if let Some(at) = vertices.iter().position(|v| !v.is_finite()) {
        return Err(fault(
            &format!("vertex {at}"),
            format!("{:?}", vertices[at].to_array()),
            "finite numbers",
        ));
    }
    let bounds = Aabb::around(vertices.iter().copied()).unwrap_or(Aabb::empty());
    if bounds.extent().min_element().partial_cmp(&0.0) != Some(Ordering::Greater) {
        let found = format!("{:?} long along x, y and z", bounds.extent().to_array());
        return Err(fault("the mesh", found, "a body with edges > 0"));
    }
    match open_edges(&mesh) {
        0 => Ok(mesh),
        n => Err(fault(
            "the mesh",
            format!("open at {n} edges"),
            "a closed surface; fill its holes in a mesh editor",
        )),
    }
}

/// Number of edges that belong to an odd number of triangles.
fn open_edges(mesh: &TriangleMesh) -> usize {
    let (vertices, triangles) = mesh.parts();
    // Adding zero makes −0 and 0 one place.
    let place = |i: u32| vertices[i as usize].to_array().map(|c| (c + 0.0).to_bits());
    let mut edges: HashMap<_, usize> = HashMap::new();
    for t in triangles {
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let (a, b) = (place(t[i]), place(t[j]));
            if a != b {
                *edges.entry((a.min(b), a.max(b))).or_default() += 1;
            }
        }
    }
    edges.values().filter(|n| *n % 2 == 1).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::ply::{OPAQUE_REGION, tetrahedron};
    use crate::synth::{OPAQUE_OBJECT, Shape};
    use refraxel_core::vec3;

    fn read(name: &str, content: &[u8]) -> Result<TriangleMesh, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        read_mesh(&path).map_err(|e| e.to_string())
    }

    const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

    #[test]
    fn obj_and_ply_hold_the_same_tetrahedron() {
        for mesh in [read("a.obj", OBJ.as_bytes()), read("a.PLY", &tetrahedron("binary_little_endian"))] {
            let shape = Shape::Mesh(mesh.unwrap());
            assert!(shape.contains(vec3(0.2, 0.2, 0.2)) && !shape.contains(vec3(0.4, 0.4, 0.4)));
        }
    }

    #[test]
    fn what_a_file_of_this_program_calls_opaque_is_no_glass() {
        let second = |offset: usize| {
            let face = |t: [usize; 3]| format!("f {} {} {}\n", t[0] + offset, t[1] + offset, t[2] + offset);
            [[1, 3, 2], [1, 2, 4], [1, 4, 3], [2, 3, 4]].map(face).concat()
        };
        let far = "v 9 9 9\nv 10 9 9\nv 9 10 9\nv 9 9 10\n";
        let obj = format!("o {OPAQUE_OBJECT}\n{far}{}o region_1\n{}{}", second(0), &OBJ[..32], second(4));
        let header = "ply\nformat ascii 1.0\nCOMMENTelement vertex 8\nproperty float x\nproperty float y\n\
                      property float z\nelement face 8\nproperty list uchar int vertex_indices\nproperty int region\nend_header\n";
        let points = format!("{far}{}", &OBJ[..32]).replace("v ", "");
        let faces = |first: usize, region: usize| {
            [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
                .map(|t| format!("3 {} {} {} {region}\n", t[0] + first, t[1] + first, t[2] + first))
                .concat()
        };
        let ply = |comment: &str| {
            let text = header.replace("COMMENT", comment) + &points + &faces(0, 0) + &faces(4, 1);
            read("a.ply", text.as_bytes()).unwrap()
        };
        for mesh in [read("a.obj", obj.as_bytes()).unwrap(), ply(&format!("comment {OPAQUE_REGION}\n"))] {
            assert_eq!(mesh.parts().1.len(), 4);
            assert!(mesh.parts().0.iter().all(|v| v.x < 2.0), "no vertex of the opaque body");
        }
        // A region 0 of another program is a region.
        assert_eq!(ply("").parts().1.len(), 8);
    }

    #[test]
    fn an_open_or_foreign_mesh_says_so() {
        let open = OBJ.replace("f 2 3 4\n", "");
        assert!(read("a.obj", open.as_bytes()).unwrap_err().contains("open at 3 edges"));
        let flat = OBJ.replace("0 0 1\nf", "0 1 0\nf");
        assert!(
            read("a.obj", flat.as_bytes())
                .unwrap_err()
                .contains("the mesh is [1.0, 1.0, 0.0] long along x, y and z")
        );
        let empty = read("a.obj", b"").unwrap_err();
        assert!(
            empty.contains("a.obj: it has 0 vertices and 0 triangles; expected one triangle or more"),
            "{empty}"
        );
        assert!(read("a.stl", b"").unwrap_err().contains(".obj or .ply"));
        assert!(read("a.obj", b"v 0 0 0\nf 1 2 3\n").unwrap_err().contains("a.obj"));
    }
}

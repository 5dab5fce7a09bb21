//! What a mesh is: vertices and the triangles between them.

use crate::{Aabb, Vec3};

/// A closed triangle mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// World positions of the vertices [scene unit].
    pub vertices: Vec<Vec3<f64>>,
    /// Unit normal of each vertex, outwards.
    pub normals: Vec<Vec3<f64>>,
    /// The three vertices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// World positions of the corners of a triangle [scene unit].
    pub fn corners(&self, triangle: [u32; 3]) -> [Vec3<f64>; 3] {
        triangle.map(|v| self.vertices[v as usize])
    }

    /// The box around all vertices; `None` if there are none.
    pub fn bounds(&self) -> Option<Aabb<f64>> {
        Aabb::around(self.vertices.iter().copied())
    }
}

/// Normal of a triangle, whose length is twice the area [scene unit²].
pub(super) fn doubled_area([a, b, c]: [Vec3<f64>; 3]) -> Vec3<f64> {
    (b - a).cross(c - a)
}

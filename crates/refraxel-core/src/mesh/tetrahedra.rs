//! Marching tetrahedra. Source: Doi & Koide 1991, on the subdivision of Freudenthal and Kuhn.
//!
//! Each cell is cut into six tetrahedra around its diagonal, the same way in all cells, so that neighbours agree on the
//! faces between them. The corners of a tetrahedron lie inside (negative function) or outside. One corner against three
//! gives one triangle, two against two give a quadrilateral of two triangles. A vertex belongs to the edge that it lies on,
//! and is shared by all tetrahedra around that edge: this closes the mesh.

use super::triangles::Mesh;
use crate::{Domain, Vec3};
use std::collections::HashMap;

/// The tetrahedra of a cell as corners (bit a: one step along axis a), each with a positive determinant.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 6, 4, 7]];
/// For each set of corners inside (bit k: corner k) an even permutation that has them first.
const SORTED: [[usize; 4]; 16] = [
    [0, 1, 2, 3],
    [0, 1, 2, 3],
    [1, 0, 3, 2],
    [0, 1, 2, 3],
    [2, 3, 0, 1],
    [0, 2, 3, 1],
    [1, 2, 0, 3],
    [0, 1, 2, 3],
    [3, 2, 1, 0],
    [0, 3, 1, 2],
    [1, 3, 2, 0],
    [1, 0, 3, 2],
    [2, 3, 0, 1],
    [2, 3, 0, 1],
    [3, 2, 1, 0],
    [0, 1, 2, 3],
];
/// Bisections of an edge in search of the zero: to 1e-7 of its length.
const BISECTIONS: usize = 24;
/// Vertices stay this share of an edge away from its ends, so that no triangle starts as a point.
const MARGIN: f64 = 0.05;

/// The mesh with a vertex on each edge of a tetrahedron whose ends lie on different sides; without normals.
///
/// `domain` gives the nodes, `sample` the function, of which only the sign is used.
///
/// # Panics
/// If a node of a face of the box lies inside.
pub(super) fn march(domain: &Domain<f64>, sample: &impl Fn(Vec3<f64>) -> (f64, Vec3<f64>)) -> Mesh {
    let n = domain.resolution.map(|n| n as usize);
    let inside: Vec<bool> =
        (0..n[0] * n[1] * n[2]).map(|j| sample(domain.position(at(n, j))).0 < 0.0).collect();
    let mut builder = Builder { domain, n, sample, vertices: HashMap::new(), mesh: Mesh::default() };
    // Distance in memory from the lowest corner of a cell to its corner k, x fastest.
    let step = [1, n[0], n[0] * n[1]];
    let offset: [usize; 8] =
        std::array::from_fn(|k| (0..3).filter(|a| k >> a & 1 == 1).map(|a| step[a]).sum());
    for node in 0..inside.len() {
        let i = [node % n[0], node / n[0] % n[1], node / (n[0] * n[1])];
        assert!(
            !inside[node] || (0..3).all(|a| i[a] > 0 && i[a] + 1 < n[a]),
            "the function is negative at a face of the box"
        );
        if (0..3).any(|a| i[a] + 1 == n[a]) {
            continue;
        }
        let count = offset.iter().filter(|&&o| inside[node + o]).count();
        if count % 8 != 0 {
            for tetrahedron in TETRAHEDRA {
                builder.cut(&inside, tetrahedron.map(|k| node + offset[k]));
            }
        }
    }
    builder.mesh
}

/// Node coordinates (x, y, z) of a node from its index.
fn at(n: [usize; 3], node: usize) -> Vec3<f64> {
    Vec3::from([node % n[0], node / n[0] % n[1], node / (n[0] * n[1])].map(|i| i as f64))
}

/// A mesh under construction.
struct Builder<'a, F> {
    domain: &'a Domain<f64>,
    /// Nodes per axis.
    n: [usize; 3],
    sample: &'a F,
    /// The vertex on each edge, named by its node inside and its node outside.
    vertices: HashMap<(usize, usize), u32>,
    mesh: Mesh,
}

impl<F: Fn(Vec3<f64>) -> (f64, Vec3<f64>)> Builder<'_, F> {
    /// Appends the triangles of one tetrahedron. Its corners are sorted by an even permutation, which keeps its orientation,
    /// so that the triangles face outwards.
    fn cut(&mut self, inside: &[bool], nodes: [usize; 4]) {
        let set = (0..4).filter(|&k| inside[nodes[k]]).fold(0, |set, k| set | 1 << k);
        let [a, b, c, d] = SORTED[set].map(|k| nodes[k]);
        match set.count_ones() {
            1 => {
                let t = [b, c, d].map(|outside| self.vertex(a, outside));
                self.mesh.triangles.push(t);
            }
            2 => {
                let [ac, ad, bd, bc] = [(a, c), (a, d), (b, d), (b, c)].map(|(i, o)| self.vertex(i, o));
                self.mesh.triangles.extend([[ac, ad, bd], [ac, bd, bc]]);
            }
            3 => {
                let t = [a, b, c].map(|within| self.vertex(within, d));
                self.mesh.triangles.push(t);
            }
            _ => {}
        }
    }

    /// The vertex on the edge between a node inside and one outside, found by bisection when it is first asked for.
    fn vertex(&mut self, inside: usize, outside: usize) -> u32 {
        let found = self.vertices.len() as u32;
        *self.vertices.entry((inside, outside)).or_insert_with(|| {
            let ends = [inside, outside].map(|j| self.domain.position(at(self.n, j)));
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                let x = ends[0] + (ends[1] - ends[0]) * middle;
                *(if (self.sample)(x).0 < 0.0 { &mut low } else { &mut high }) = middle;
            }
            let share = (0.5 * (low + high)).clamp(MARGIN, 1.0 - MARGIN);
            self.mesh.vertices.push(ends[0] + (ends[1] - ends[0]) * share);
            found
        })
    }
}

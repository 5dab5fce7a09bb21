//! Closed triangle meshes with smooth normals, for imported shapes: a bounding volume hierarchy over triangles.
//!
//! Where the interpolated normal and the flat triangle disagree about entering or leaving, the triangle wins.

use super::crossing::{Crossing, S_MIN};
use crate::synth::vector;
use refraxel_core::{Aabb, Ray, Vec3, vec3};
use serde::{Deserialize, Serialize};

const LEAF: usize = 4; // triangles per leaf; 2 to 8 are equally fast
const PAD: f64 = 1e-9; // scene unit

/// The object of an OBJ file of this program that is not refractive.
pub const OPAQUE_OBJECT: &str = "opaque_of_refraxel";

/// Why a mesh could not be made.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeshError {
    /// A line of an OBJ file that is not understood.
    #[error("line {line} of the OBJ file is {found:?}; expected `v x y z` or `f a b c`")]
    Line {
        /// One-based line number.
        line: usize,
        /// The offending text.
        found: String,
    },
    /// A face names a vertex that does not exist, or there is no face at all.
    #[error(
        "it has {vertices} vertices and {faces} triangles; expected one triangle or more, and the vertices that triangles name"
    )]
    Empty {
        /// Number of vertices read.
        vertices: usize,
        /// Number of triangles read.
        faces: usize,
    },
}

/// A closed, outward-oriented triangle mesh; normals are smooth across edges.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(from = "Surface", into = "Surface")]
pub struct TriangleMesh {
    surface: Surface,
    normals: Vec<Vec3<f64>>,
    nodes: Vec<Node>,
}

/// What is stored of a mesh.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Surface {
    #[serde(with = "vector::list")]
    vertices: Vec<Vec3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// A node covers the triangles `first .. first + count`; an inner one has its children at `left` and `left + 1`.
#[derive(Clone, Debug)]
struct Node {
    bounds: Aabb<f64>,
    first: usize,
    count: usize,
    left: Option<usize>,
}

impl From<Surface> for TriangleMesh {
    fn from(s: Surface) -> TriangleMesh {
        let missing = s.triangles.iter().flatten().any(|&i| i as usize >= s.vertices.len());
        TriangleMesh::build(if missing { Surface::default() } else { s })
    }
}

impl From<TriangleMesh> for Surface {
    fn from(m: TriangleMesh) -> Surface {
        m.surface
    }
}

impl TriangleMesh {
    /// A mesh from vertices [scene unit] and triangles, counter-clockwise seen from outside.
    pub fn new(vertices: Vec<Vec3<f64>>, triangles: Vec<[u32; 3]>) -> Result<TriangleMesh, MeshError> {
        if triangles.is_empty() || triangles.iter().flatten().any(|&i| i as usize >= vertices.len()) {
            return Err(MeshError::Empty { vertices: vertices.len(), faces: triangles.len() });
        }
        Ok(TriangleMesh::build(used(vertices, triangles)))
    }

    /// A mesh from the text of a Wavefront OBJ file: its `v` and `f` lines; polygons become fans. The object
    /// [`OPAQUE_OBJECT`] is left out.
    pub fn from_obj(text: &str) -> Result<TriangleMesh, MeshError> {
        let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
        let mut is_opaque = false;
        for (number, line) in text.lines().enumerate() {
            let bad = || MeshError::Line { line: number + 1, found: line.trim().chars().take(60).collect() };
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    let xyz: Vec<f64> = words.take(3).map_while(|w| w.parse().ok()).collect();
                    let xyz: [f64; 3] = xyz.try_into().map_err(|_| bad())?;
                    vertices.push(Vec3::from(xyz));
                }
                Some("o") => is_opaque = words.next() == Some(OPAQUE_OBJECT),
                Some("f") if is_opaque => {}
                Some("f") => {
                    let corners: Option<Vec<u32>> = words.map(|w| corner(w, vertices.len())).collect();
                    let corners = corners.filter(|c| c.len() >= 3).ok_or_else(bad)?;
                    triangles.extend(corners[1..].windows(2).map(|w| [corners[0], w[0], w[1]]));
                }
                _ => {}
            }
        }
        TriangleMesh::new(vertices, triangles)
    }

    /// The same mesh moved and scaled (equally along all axes) to fit a ball.
    pub fn fitted(&self, center: Vec3<f64>, radius: f64) -> TriangleMesh {
        let middle = self.bounds().center();
        let reach = self.surface.vertices.iter().map(|&v| (v - middle).length()).fold(0.0, f64::max);
        let vertices =
            self.surface.vertices.iter().map(|&v| center + (v - middle) * (radius / reach)).collect();
        TriangleMesh::build(Surface { vertices, triangles: self.surface.triangles.clone() })
    }

    /// The same mesh elsewhere.
    pub(in crate::synth) fn moved(mut self, by: Vec3<f64>) -> TriangleMesh {
        self.surface.vertices.iter_mut().for_each(|v| *v += by);
        for node in &mut self.nodes {
            node.bounds = Aabb::new(node.bounds.min + by, node.bounds.max + by);
        }
        self
    }

    fn build(mut surface: Surface) -> TriangleMesh {
        let mut normals = vec![Vec3::zero(); surface.vertices.len()];
        for t in &surface.triangles {
            let [a, b, c] = t.map(|i| surface.vertices[i as usize]);
            // The cross product weights each triangle by its area.
            t.iter().for_each(|&i| normals[i as usize] += (b - a).cross(c - a));
        }
        normals.iter_mut().for_each(|n| *n = n.normalized());
        let mut nodes = Vec::new();
        let count = surface.triangles.len();
        nodes.push(Node { bounds: Aabb::empty(), first: 0, count, left: None });
        split(&mut surface, &mut nodes, 0);
        TriangleMesh { surface, normals, nodes }
    }

    /// Vertices and triangles.
    pub(crate) fn parts(&self) -> (&[Vec3<f64>], &[[u32; 3]]) {
        (&self.surface.vertices, &self.surface.triangles)
    }

    pub(super) fn bounds(&self) -> Aabb<f64> {
        self.nodes[0].bounds
    }

    fn corners(&self, t: usize) -> [Vec3<f64>; 3] {
        self.surface.triangles[t].map(|i| self.surface.vertices[i as usize])
    }

    pub(super) fn hit(&self, ray: &Ray<f64>, s_max: f64) -> Option<Crossing> {
        self.bounds().clip(ray)?;
        // A mesh may be smaller than its unit of length by far.
        let least = S_MIN * self.bounds().extent().max_element().min(1.0);
        let (mut best, mut found) = (s_max, None);
        let mut open = vec![0];
        while let Some(at) = open.pop() {
            let node = &self.nodes[at];
            if !node.bounds.clip(ray).is_some_and(|[near, _]| near < best) {
                continue;
            }
            if let Some(left) = node.left {
                open.extend([left, left + 1]);
                continue;
            }
            for t in node.first..node.first + node.count {
                if let Some((s, u, v)) = meet(self.corners(t), ray).filter(|h| h.0 > least && h.0 < best) {
                    best = s;
                    found = Some((t, u, v));
                }
            }
        }
        let (t, u, v) = found?;
        Some(Crossing { s: best, normal: self.normal(t, [1.0 - u - v, u, v], ray.direction) })
    }

    /// The interpolated normal, or the flat one where the two disagree about the side of `direction`.
    fn normal(&self, t: usize, weights: [f64; 3], direction: Vec3<f64>) -> Vec3<f64> {
        let [a, b, c] = self.corners(t);
        let flat = (b - a).cross(c - a).normalized();
        let n = self.surface.triangles[t].map(|i| self.normals[i as usize]);
        let smooth = (n[0] * weights[0] + n[1] * weights[1] + n[2] * weights[2]).normalized();
        if smooth.dot(direction) * flat.dot(direction) > 0.0 { smooth } else { flat }
    }

    /// True inside: a line upwards from the point leaves more often than it enters.
    pub(super) fn contains(&self, x: Vec3<f64>) -> bool {
        // A slanted line does not run along the edges of regular meshes.
        let ray = Ray { origin: x, direction: vec3(0.137, 0.071, 0.988).normalized() };
        self.hit(&ray, f64::INFINITY).is_some_and(|c| c.normal.dot(ray.direction) > 0.0)
    }

    /// Signed distance to the nearest triangle and that triangle's flat normal.
    pub(super) fn surface(&self, x: Vec3<f64>) -> (f64, Vec3<f64>) {
        let (mut best, mut normal) = (f64::INFINITY, vec3(0.0, 0.0, 1.0));
        let gap = |at: usize| {
            let bounds = &self.nodes[at].bounds;
            (bounds.min - x).max(x - bounds.max).max(Vec3::zero()).length()
        };
        let mut open = vec![(0, gap(0))];
        while let Some((at, least)) = open.pop() {
            let node = &self.nodes[at];
            if least >= best {
                continue;
            }
            if let Some(left) = node.left {
                let mut children = [left, left + 1].map(|child| (child, gap(child)));
                children.sort_by(|a, b| b.1.total_cmp(&a.1)); // the nearer one comes next
                open.extend(children);
                continue;
            }
            for t in node.first..node.first + node.count {
                let [a, b, c] = self.corners(t);
                let distance = (nearest([a, b, c], x) - x).length();
                if distance < best {
                    (best, normal) = (distance, (b - a).cross(c - a).normalized());
                }
            }
        }
        (if self.contains(x) { -best } else { best }, normal)
    }
}

/// Vertex number of a corner such as `7`, `7/2/3` or `-1`.
fn corner(word: &str, vertices: usize) -> Option<u32> {
    let i: i64 = word.split('/').next()?.parse().ok()?;
    let zero_based = if i < 0 { vertices as i64 + i } else { i - 1 };
    u32::try_from(zero_based).ok()
}

/// A surface without the vertices that no triangle has.
fn used(vertices: Vec<Vec3<f64>>, mut triangles: Vec<[u32; 3]>) -> Surface {
    let mut new = vec![u32::MAX; vertices.len()];
    triangles.iter().flatten().for_each(|&v| new[v as usize] = 0);
    let kept: Vec<usize> = (0..new.len()).filter(|&v| new[v] == 0).collect();
    kept.iter().enumerate().for_each(|(to, &from)| new[from] = to as u32);
    triangles.iter_mut().flatten().for_each(|v| *v = new[*v as usize]);
    Surface { vertices: kept.into_iter().map(|v| vertices[v]).collect(), triangles }
}

/// Halves a node at the median triangle centre of its longest axis until it is a leaf.
fn split(surface: &mut Surface, nodes: &mut Vec<Node>, at: usize) {
    let Node { first, count, .. } = nodes[at];
    let mut bounds = Aabb::empty();
    for t in &surface.triangles[first..first + count] {
        t.iter().for_each(|&i| bounds.include(surface.vertices[i as usize]));
    }
    // A flat box has no inside for a line to clip.
    nodes[at].bounds = Aabb::new(bounds.min - Vec3::splat(PAD), bounds.max + Vec3::splat(PAD));
    if count <= LEAF {
        return;
    }
    let e = bounds.extent();
    let axis = if e.x >= e.y && e.x >= e.z { 0 } else { usize::from(e.z > e.y) + 1 };
    let vertices = &surface.vertices;
    let key = |t: &[u32; 3]| t.iter().map(|&i| vertices[i as usize][axis]).sum::<f64>();
    surface.triangles[first..first + count].sort_by(|a, b| key(a).total_cmp(&key(b)));
    let (half, left) = (count / 2, nodes.len());
    nodes[at].left = Some(left);
    let empty = |first, count| Node { bounds: Aabb::empty(), first, count, left: None };
    nodes.extend([empty(first, half), empty(first + half, count - half)]);
    split(surface, nodes, left);
    split(surface, nodes, left + 1);
}

/// Arc length and barycentric coordinates (of the second and third corner) where a line meets a triangle.
/// Source: Möller & Trumbore 1997.
fn meet([a, b, c]: [Vec3<f64>; 3], ray: &Ray<f64>) -> Option<(f64, f64, f64)> {
    let (e1, e2) = (b - a, c - a);
    let q = ray.direction.cross(e2);
    let det = e1.dot(q);
    if det == 0.0 {
        return None;
    }
    let v = ray.origin - a;
    let u = v.dot(q) / det;
    let r = v.cross(e1);
    let w = ray.direction.dot(r) / det;
    (u >= 0.0 && w >= 0.0 && u + w <= 1.0).then(|| (e2.dot(r) / det, u, w))
}

/// The point of a triangle nearest to `x`. Source: Ericson, Real-Time Collision Detection, § 5.1.5.
fn nearest([a, b, c]: [Vec3<f64>; 3], x: Vec3<f64>) -> Vec3<f64> {
    let n = (b - a).cross(c - a);
    let outside = |p: Vec3<f64>, q: Vec3<f64>| (q - p).cross(x - p).dot(n) <= 0.0;
    let on_edge = |p: Vec3<f64>, q: Vec3<f64>| {
        let e = q - p;
        p + e * ((x - p).dot(e) / e.dot(e)).clamp(0.0, 1.0)
    };
    let edges = [(a, b), (b, c), (c, a)];
    if !edges.iter().any(|&(p, q)| outside(p, q)) {
        return x - n * ((x - a).dot(n) / n.dot(n));
    }
    let candidates = edges.map(|(p, q)| on_edge(p, q));
    candidates.into_iter().fold(
        candidates[0],
        |best, p| {
            if (p - x).length() < (best - x).length() { p } else { best }
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
                        f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2/1 3/1 7/1 6/1\nf 3 4 8 7\nf -8 -4 -1 -5\n";

    #[test]
    fn an_obj_cube_has_the_distances_of_a_cube() {
        let mesh = TriangleMesh::from_obj(CUBE).unwrap();
        assert_eq!(mesh.surface.triangles.len(), 12);
        for (x, d) in [(vec3(0.0, 0.1, 0.3), -0.7), (vec3(2.0, 0.2, 0.0), 1.0), (vec3(4.0, 5.0, 1.0), 5.0)] {
            assert!((mesh.surface(x).0 - d).abs() < 1e-12);
            assert_eq!(mesh.contains(x), d < 0.0);
        }
    }

    #[test]
    fn lines_cross_a_mesh_in_pairs() {
        let mesh = TriangleMesh::from_obj(CUBE).unwrap().fitted(vec3(0.1, 0.2, 0.3), 1.0);
        for k in 0..200_u32 {
            let t = f64::from(k);
            let origin = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 0.37).sin()).normalized() * 4.0;
            let ray = Ray { origin, direction: (vec3(0.1, 0.2, 0.3) - origin).normalized() };
            let enter = mesh.hit(&ray, 9.0).unwrap();
            let leave = mesh.hit(&Ray { origin: ray.at(enter.s), ..ray }, 9.0).unwrap();
            assert!(enter.normal.dot(ray.direction) < 0.0 && leave.normal.dot(ray.direction) > 0.0);
        }
    }

    #[test]
    fn a_broken_obj_names_its_line() {
        let error = TriangleMesh::from_obj("v 0 0 0\nv 1 zero 0\n").unwrap_err();
        assert_eq!(error, MeshError::Line { line: 2, found: "v 1 zero 0".into() });
        assert!(matches!(TriangleMesh::from_obj("v 0 0 0\n"), Err(MeshError::Empty { .. })));
        assert!(matches!(TriangleMesh::from_obj("v 0 0 0\nf 1 2 3\n"), Err(MeshError::Empty { .. })));
    }
}

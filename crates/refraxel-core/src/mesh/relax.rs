//! Relaxation: vertices move along their surface until the triangles are well shaped, theory (2.32).
//!
//! Only positions change; the topology of the mesh stays, and with it the property that the mesh is closed.

use super::triangles::{Mesh, doubled_area};
use crate::Vec3;

/// Rounds over all vertices. After them the smallest angle of any triangle of a ball is 21 degrees, and the mean over the
/// triangles of their smallest angle is 42 degrees.
const ROUNDS: usize = 12;
/// Part of the way to the mean of its neighbours that a vertex moves in one round [1].
const SHARE: f64 = 0.7;
/// Newton steps onto the surface, each at most half a cell.
const STEPS: usize = 8;
/// A vertex counts as on the surface when its next Newton step would be shorter than this [cell].
const CLOSE: f64 = 1e-5;
/// Least cosine of the angle between the normals of a triangle and of the surface [1]; a triangle below it is about to turn
/// over.
const UPRIGHT: f64 = 0.2;

/// Moves each vertex towards the mean of its neighbours and back onto the zero level of `sample`, theory (2.32), if it
/// arrives there and no triangle turns over. Round 0 only moves vertices onto the surface. `cell` is the edge length of a
/// cell [scene unit].
///
/// Vertices are visited in order and see where the ones before them went (Gauss–Seidel).
pub(super) fn relax(mesh: &mut Mesh, cell: f64, sample: &impl Fn(Vec3<f64>) -> (f64, Vec3<f64>)) {
    let ring = Rings::of(mesh);
    for round in 0..=ROUNDS {
        for v in 0..mesh.vertices.len() {
            let old = mesh.vertices[v];
            let share = if round == 0 { 0.0 } else { SHARE };
            let wanted = old + (ring.middle(mesh, v) - old) * share;
            let Some((x, normal)) = onto(wanted, cell, sample) else { continue };
            let upright = |mesh: &Mesh| ring.least_cosine(mesh, v, normal);
            let before = upright(mesh);
            mesh.vertices[v] = x;
            let after = upright(mesh);
            if after < UPRIGHT && after < before {
                mesh.vertices[v] = old;
            }
        }
    }
}

/// The point of the zero level near `x` and its unit normal, by x ← x − φ ∇φ/|∇φ|², theory (2.32). `None` if the steps do
/// not settle.
fn onto(
    mut x: Vec3<f64>,
    cell: f64,
    sample: &impl Fn(Vec3<f64>) -> (f64, Vec3<f64>),
) -> Option<(Vec3<f64>, Vec3<f64>)> {
    for _ in 0..STEPS {
        let (value, gradient) = sample(x);
        let step = gradient * (value / gradient.dot(gradient));
        let length = step.length();
        if !length.is_finite() {
            return None;
        }
        if length < CLOSE * cell {
            return Some((x, gradient.normalized()));
        }
        x -= step * (0.5 * cell / length).min(1.0);
    }
    None
}

/// The triangles around each vertex, in compressed rows: those of vertex v are `triangles[start[v]..start[v + 1]]`.
struct Rings {
    start: Vec<usize>,
    triangles: Vec<u32>,
}

impl Rings {
    /// The rings of a mesh, by counting sort.
    fn of(mesh: &Mesh) -> Self {
        let mut start = vec![0; mesh.vertices.len() + 1];
        mesh.triangles.iter().flatten().for_each(|&v| start[v as usize + 1] += 1);
        (1..start.len()).for_each(|v| start[v] += start[v - 1]);
        let (mut next, mut triangles) = (start.clone(), vec![0; 3 * mesh.triangles.len()]);
        for (t, corners) in mesh.triangles.iter().enumerate() {
            for &v in corners {
                triangles[next[v as usize]] = t as u32;
                next[v as usize] += 1;
            }
        }
        Self { start, triangles }
    }

    /// The triangles around a vertex.
    fn around<'a>(&'a self, mesh: &'a Mesh, v: usize) -> impl Iterator<Item = [u32; 3]> + 'a {
        self.triangles[self.start[v]..self.start[v + 1]].iter().map(|&t| mesh.triangles[t as usize])
    }

    /// Mean position of the neighbours of a vertex [scene unit].
    fn middle(&self, mesh: &Mesh, v: usize) -> Vec3<f64> {
        let (mut sum, mut count) = (Vec3::zero(), 0.0);
        // In a closed mesh each neighbour is in two triangles.
        for u in self.around(mesh, v).flatten().filter(|&u| u as usize != v) {
            sum += mesh.vertices[u as usize];
            count += 1.0;
        }
        sum / count
    }

    /// Smallest cosine of the angles between `normal` and the triangles around a vertex; −1 for a triangle without area.
    fn least_cosine(&self, mesh: &Mesh, v: usize, normal: Vec3<f64>) -> f64 {
        let cosine = |t| {
            let n = doubled_area(mesh.corners(t));
            n.dot(normal) / n.length()
        };
        self.around(mesh, v).map(cosine).map(|c| if c.is_nan() { -1.0 } else { c }).fold(1.0, f64::min)
    }
}

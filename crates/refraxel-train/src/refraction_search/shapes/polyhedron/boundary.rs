//! Faces and edges of the body below some planes.

use crate::model::polyhedron::tangents;
use refraxel_core::Vec3;

/// A plane that bounds a body from outside: normal · x ≤ offset inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facet {
    /// Unit normal, outwards.
    pub normal: Vec3<f64>,
    /// Distance from the origin, which lies inside.
    pub offset: f64,
}

impl Facet {
    pub(super) fn height(&self, x: Vec3<f64>) -> f64 {
        self.normal.dot(x) - self.offset
    }

    /// Two unit vectors along it.
    pub(super) fn tangents(&self) -> [Vec3<f64>; 2] {
        tangents(self.normal)
    }
}

/// Where two faces meet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    /// Their numbers, the smaller first.
    pub faces: [usize; 2],
    pub ends: [Vec3<f64>; 2],
}

/// A face as a convex polygon.
#[derive(Clone, Debug, Default)]
pub(super) struct Face {
    pub area: f64,
    /// Mean of its corners.
    pub middle: Vec3<f64>,
    corners: Vec<Corner>,
}

/// A corner of a face, and the plane that bounds the face from here to the next corner.
#[derive(Clone, Copy, Debug)]
struct Corner {
    x: Vec3<f64>,
    beyond: usize,
}

/// The surface of a body below some planes.
#[derive(Clone, Debug)]
pub(super) struct Boundary {
    /// One per plane; without area where the plane does not touch the body.
    pub faces: Vec<Face>,
    pub edges: Vec<Edge>,
}

/// Half the width of the sheet that a face is cut from, in units of the body's radius: further out a body is
/// open.
const SHEET: f64 = 6.0;
/// What bounds a face of an open body.
const OPEN: usize = usize::MAX;

impl Boundary {
    /// Cuts each face out of its plane by all others: O(planes²) and exact for bodies whose corners have more
    /// than three faces.
    pub(super) fn of(planes: &[Facet]) -> Self {
        let faces: Vec<Face> = (0..planes.len()).map(|k| Face::cut(planes, k)).collect();
        let mut edges = Vec::new();
        for (k, face) in faces.iter().enumerate() {
            for (i, corner) in face.corners.iter().enumerate() {
                let next = face.corners[(i + 1) % face.corners.len()];
                if corner.beyond != OPEN && k < corner.beyond {
                    edges.push(Edge { faces: [k, corner.beyond], ends: [corner.x, next.x] });
                }
            }
        }
        Self { faces, edges }
    }

    /// The area of all faces.
    pub(super) fn area(&self) -> f64 {
        self.faces.iter().map(|f| f.area).sum()
    }

    /// Whether planes enclose the body on all sides.
    pub(super) fn is_closed(&self) -> bool {
        self.faces.iter().all(|f| f.corners.iter().all(|c| c.beyond != OPEN))
    }
}

impl Face {
    fn cut(planes: &[Facet], k: usize) -> Self {
        let plane = planes[k];
        let ([u, v], foot) = (plane.tangents(), plane.normal * plane.offset);
        let sheet = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corner = |(a, b): (f64, f64)| Corner { x: foot + (u * a + v * b) * SHEET, beyond: OPEN };
        let mut corners: Vec<Corner> = sheet.map(corner).to_vec();
        for (other, by) in planes.iter().enumerate().filter(|(other, _)| *other != k) {
            corners = clipped(&corners, by, other);
            if corners.len() < 3 {
                return Self::default();
            }
        }
        let middle = corners.iter().fold(Vec3::zero(), |sum, c| sum + c.x) / corners.len() as f64;
        let pairs = corners.iter().zip(corners.iter().cycle().skip(1));
        let twice: Vec3<f64> =
            pairs.fold(Vec3::zero(), |sum, (a, b)| sum + (a.x - middle).cross(b.x - middle));
        Self { area: 0.5 * twice.length(), middle, corners }
    }
}

/// What of a convex polygon lies below a plane (Sutherland & Hodgman 1974).
fn clipped(polygon: &[Corner], by: &Facet, number: usize) -> Vec<Corner> {
    let heights: Vec<f64> = polygon.iter().map(|c| by.height(c.x)).collect();
    if heights.iter().all(|h| *h <= 0.0) {
        return polygon.to_vec();
    }
    let mut out = Vec::with_capacity(polygon.len() + 1);
    for (i, corner) in polygon.iter().enumerate() {
        let j = (i + 1) % polygon.len();
        let at = || {
            let t = heights[i] / (heights[i] - heights[j]);
            corner.x + (polygon[j].x - corner.x) * t
        };
        match (heights[i] <= 0.0, heights[j] <= 0.0) {
            (true, true) => out.push(*corner),
            (true, false) => out.extend([*corner, Corner { x: at(), beyond: number }]),
            (false, true) => out.push(Corner { x: at(), beyond: corner.beyond }),
            (false, false) => {}
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    fn cube() -> Vec<Facet> {
        let axes = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
        axes.into_iter().flat_map(|m| [m, -m]).map(|normal| Facet { normal, offset: 0.5 }).collect()
    }

    #[test]
    fn a_cube_has_six_faces_twelve_edges_and_a_plane_that_misses_it_has_no_area() {
        let mut planes = cube();
        planes.push(Facet { normal: vec3(1.0, 1.0, 1.0).normalized(), offset: 0.9 });
        let boundary = Boundary::of(&planes);
        assert_eq!((boundary.edges.len(), boundary.is_closed()), (12, true));
        assert!(boundary.faces[..6].iter().all(|f| (f.area - 1.0).abs() < 1e-12));
        assert_eq!(boundary.faces[6].area, 0.0);
        assert!((boundary.faces[0].middle - vec3(0.5, 0.0, 0.0)).length() < 1e-12);
        assert!(!Boundary::of(&planes[1..6]).is_closed());
    }

    #[test]
    fn a_corner_that_is_cut_off_gives_a_triangle_with_three_edges() {
        let mut planes = cube();
        planes.push(Facet { normal: vec3(1.0, 1.0, 1.0).normalized(), offset: 1.3 / 3.0_f64.sqrt() });
        let boundary = Boundary::of(&planes);
        let of_cut = boundary.edges.iter().filter(|e| e.faces[1] == 6);
        let lengths: Vec<f64> = of_cut.map(|e| (e.ends[0] - e.ends[1]).length()).collect();
        assert_eq!((boundary.edges.len(), lengths.len()), (15, 3));
        // The corner (½, ½, ½) lies 0.2 along each axis above the cut.
        assert!(lengths.iter().all(|l| (l - 0.2 * 2.0_f64.sqrt()).abs() < 1e-12), "{lengths:?}");
    }
}

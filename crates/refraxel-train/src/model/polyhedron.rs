//! Bodies with flat faces: the planes that enclose them are what learns, theory (4.14).

use crate::level_set::{at_nodes, level_set};
use refraxel_core::{Aabb, Domain, LevelSet, Real, Vec3, vec3};
use serde::{Deserialize, Serialize};

/// A plane, and which side of it is above.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "[f32; 4]", into = "[f32; 4]")]
pub struct Plane {
    normal: Vec3<f32>,
    offset: f32,
}

impl From<[f32; 4]> for Plane {
    fn from([x, y, z, offset]: [f32; 4]) -> Self {
        Self { normal: vec3(x, y, z), offset }
    }
}

impl From<Plane> for [f32; 4] {
    fn from(Plane { normal, offset }: Plane) -> Self {
        [normal.x, normal.y, normal.z, offset]
    }
}

impl Plane {
    /// The plane of a unit normal at a distance from the origin.
    pub fn facing(normal: Vec3<f32>, offset: f32) -> Self {
        Self { normal, offset }
    }

    /// The plane through three points, with a fourth above it; `None` where they lie on a line.
    pub fn through(a: Vec3<f32>, b: Vec3<f32>, c: Vec3<f32>, above: Vec3<f32>) -> Option<Self> {
        let normal = (b - a).cross(c - a);
        let length = normal.length();
        if length <= 1e-6 * (b - a).length() * (c - a).length() {
            return None;
        }
        let normal = normal / length;
        let normal = if normal.dot(above - a) < 0.0 { -normal } else { normal };
        Some(Self { normal, offset: normal.dot(a) })
    }

    /// Height of a point above the plane [scene unit].
    pub fn height(&self, x: Vec3<f32>) -> f32 {
        self.normal.dot(x) - self.offset
    }

    /// Its unit normal, upwards.
    pub fn normal(&self) -> Vec3<f32> {
        self.normal
    }

    /// Its distance from the origin.
    pub fn offset(&self) -> f32 {
        self.offset
    }

    /// Two unit vectors along it.
    pub fn tangents(&self) -> [Vec3<f32>; 2] {
        tangents(self.normal)
    }

    /// Shifted up by `rise`, and turned about the point `about` of the old plane so that points at a distance `arm` from it
    /// along the two tangents rise by `tilt`, to first order.
    fn moved(&self, about: Vec3<f32>, arm: f32, [rise, tilt @ ..]: [f32; 3]) -> Self {
        let [u, v] = self.tangents();
        let normal = (self.normal - (u * tilt[0] + v * tilt[1]) / arm).normalized();
        let pivot = about + self.normal * rise;
        Self { normal, offset: normal.dot(pivot) }
    }
}

/// Two unit vectors across a unit vector, and across each other.
pub fn tangents<T: Real>(m: Vec3<T>) -> [Vec3<T>; 2] {
    let (zero, one) = (T::zero(), T::one());
    let side = m.cross(if m.x.abs() < T::of(0.5) { vec3(one, zero, zero) } else { vec3(zero, one, zero) });
    let u = side.normalized();
    [u, m.cross(u)]
}

/// What of a body lies below some planes, with sharp edges.
pub fn cut_by(body: LevelSet<f32>, planes: &[Plane]) -> LevelSet<f32> {
    body.cut_by(planes.iter().map(|p| (p.normal, p.offset)))
}

/// A body below all of some planes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Polyhedron {
    /// Its faces, normals outwards.
    pub faces: Vec<Plane>,
    /// A face that does not learn: hidden in the ground.
    pub base: Option<Plane>,
}

/// Parameters of a face: its height and two tilts.
const OF_FACE: usize = 3;

impl Polyhedron {
    /// Height above the highest plane: negative inside.
    pub fn height(&self, x: Vec3<f32>) -> f32 {
        self.planes().map(|p| p.height(x)).fold(f32::MIN, f32::max)
    }

    /// All planes.
    pub fn planes(&self) -> impl Iterator<Item = &Plane> {
        self.faces.iter().chain(&self.base)
    }

    /// Its surface, with sharp edges, on a grid.
    pub fn level_set(&self, bounds: Aabb<f32>, resolution: [u32; 3]) -> LevelSet<f32> {
        self.sharpened(level_set(bounds, resolution, |x| self.height(x)))
    }

    /// A level set of heights above its highest plane, with sharp edges.
    pub fn sharpened(&self, heights: LevelSet<f32>) -> LevelSet<f32> {
        heights.with_planes(self.planes().map(|p| (p.normal, p.offset)))
    }

    /// Its surface on the grid of a level set of planes, in place of what is there.
    pub fn put(&self, level: &mut LevelSet<f32>) {
        let Domain { bounds, resolution, .. } = *level.domain();
        let heights = at_nodes(bounds, resolution, |x| self.height(x));
        level.move_planes(heights, self.planes().map(|p| (p.normal, p.offset)));
    }

    /// What of a body lies below all planes.
    pub fn cut(&self, body: &LevelSet<f32>) -> LevelSet<f32> {
        let domain = body.domain();
        level_set(domain.bounds, domain.resolution, |x| self.height(x).max(body.value(x)))
    }

    /// The body whose faces, all but the base, lie further out by `by` [scene unit].
    #[must_use]
    pub fn grown(&self, by: f32) -> Self {
        let out = |p: &Plane| Plane { offset: p.offset + by, ..*p };
        Self { faces: self.faces.iter().map(out).collect(), base: self.base }
    }

    /// How many parameters learn.
    pub fn parameters(&self) -> usize {
        OF_FACE * self.faces.len()
    }

    /// dLoss/d(parameters) from the derivatives by planes of [`LevelSet::scatter`] on [`Self::level_set`], theory (4.14). Parameters are
    /// displacements [scene unit]: of the whole face, and of points 0.4 times the longest edge of the grid from its middle.
    pub fn vjp(&self, level: &LevelSet<f32>, d_planes: &[f32]) -> Vec<f32> {
        let arm = Self::arm(level);
        // Where the face rises, φ falls.
        let of = |(face, [x, y, z, height]): (&Plane, &[f32; 4])| {
            let [u, v] = face.tangents().map(|t| -t.dot(vec3(*x, *y, *z)) / arm);
            [-height, u, v]
        };
        self.faces.iter().zip(d_planes.as_chunks().0).flat_map(of).collect()
    }

    /// Move the faces by displacements of their parameters [scene unit].
    pub fn advance(&mut self, level: &LevelSet<f32>, by: &[f32]) {
        let arm = Self::arm(level);
        for (face, by) in self.faces.iter_mut().zip(by.as_chunks().0) {
            *face = face.moved(Self::middle(face, level), arm, *by);
        }
    }

    /// Where a face is turned about: its point nearest to the middle of the grid.
    fn middle(face: &Plane, level: &LevelSet<f32>) -> Vec3<f32> {
        let center = level.domain().bounds.center();
        center - face.normal * face.height(center)
    }

    /// About half the width of a face [scene unit].
    fn arm(level: &LevelSet<f32>) -> f32 {
        0.4 * level.domain().bounds.extent().max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn prism() -> Polyhedron {
        let face = |x: f32, y: f32, z: f32, offset| Plane::facing(vec3(x, y, z).normalized(), offset);
        let faces = vec![
            face(1.0, 0.2, 0.3, 0.5),
            face(-1.0, 0.6, 0.1, 0.4),
            face(-0.2, -1.0, 0.0, 0.5),
            face(0.1, 0.0, 1.0, 0.55),
        ];
        Polyhedron { faces, base: Some(face(0.0, 0.0, -1.0, 0.6)) }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let body = prism();
        let level = body.level_set(Aabb::cube(1.0), [21; 3]);
        // A loss of heights and normals at points all over the body and beside it.
        let random = Random::new(3);
        let number = |k: u64, i: u64| random.uniform(k, i) as f32 - 0.5;
        let point = |k: u64| {
            let three = |i: u64| vec3(number(k, i), number(k, i + 1), number(k, i + 2));
            (three(0) * 1.6, number(k, 3), three(4))
        };
        // Normals jump where another plane becomes the highest.
        let is_far_from_creases = |(x, ..): &(Vec3<f32>, f32, Vec3<f32>)| {
            let mut heights: Vec<f32> = body.planes().map(|p| p.height(*x)).collect();
            heights.sort_by(|a, b| b.total_cmp(a));
            heights[0] - heights[1] > 0.01
        };
        let points: Vec<_> = (0..2000).map(point).filter(is_far_from_creases).collect();
        let mut d_planes = vec![0.0; level.coefficients().len()];
        points
            .iter()
            .for_each(|(x, d_value, d_normal)| level.scatter(*x, *d_value, *d_normal, &mut d_planes));
        let grad = body.vjp(&level, &d_planes);
        let loss = |by: &[f32]| {
            let mut moved = body.clone();
            moved.advance(&level, by);
            let moved = moved.level_set(Aabb::cube(1.0), [21; 3]);
            let of = |(x, d_value, d_normal): &(Vec3<f32>, f32, Vec3<f32>)| {
                let (phi, normal) = moved.sample(*x);
                f64::from(d_value * phi + d_normal.dot(normal))
            };
            points.iter().map(of).sum::<f64>()
        };
        let largest = grad.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
        for k in 0..body.parameters() {
            let h = 1e-3;
            let at = |h: f32| {
                loss(&(0..body.parameters()).map(|i| if i == k { h } else { 0.0 }).collect::<Vec<_>>())
            };
            let numeric = ((at(h) - at(-h)) / f64::from(2.0 * h)) as f32;
            assert!((numeric - grad[k]).abs() < 0.01 * largest, "{k}: {numeric} and {}", grad[k]);
        }
    }

    #[test]
    fn the_surface_of_a_polyhedron_is_flat_and_its_base_stays() {
        let mut body = prism();
        let level = body.level_set(Aabb::cube(1.0), [41; 3]);
        let base = body.base;
        body.advance(&level, &[0.02, 0.01, -0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.03, 0.0, 0.0]);
        let mut moved = level.clone();
        body.put(&mut moved);
        let level = body.level_set(Aabb::cube(1.0), [41; 3]);
        for j in level.parameters() {
            assert_eq!(moved.coefficients()[j], level.coefficients()[j]);
            assert_eq!(moved.sample(level.position(j)), level.sample(level.position(j)));
        }
        assert_eq!(body.base, base);
        let lowered = body.faces[3];
        assert!((lowered.offset() - 0.52).abs() < 1e-5, "{lowered:?}");
        assert!((lowered.normal() - prism().faces[3].normal()).length() < 1e-6, "{lowered:?}");
        let on = Polyhedron::middle(&body.faces[0], &level);
        let [u, v] = body.faces[0].tangents();
        for k in 0..20 {
            let x = on + u * (0.02 * (k as f32 - 10.0)) + v * (0.013 * (k as f32 - 9.0));
            assert!(level.value(x).abs() < 1e-5, "{}", level.value(x));
        }
    }
}

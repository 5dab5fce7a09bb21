//! Flat faces, exactly, theory (4.14): φ is the height above the highest of some planes, or that and a spline, whichever is larger.
//!
//! A spline rounds edges over about two voxels, and a rounded edge sends the rays that meet it anywhere: a bright line
//! along each edge, and along each of its reflections.

use super::lattice::Lattice;
use crate::{Real, Vec3};

/// The body is cut off this far inside the faces of its grid [node], as the border of a spline cuts it off.
const INSET: f64 = 2.5;

/// Planes that cut the body off inside its grid, the last of [`LevelSet::planes`](super::LevelSet::planes).
pub const CUTS: usize = 6;

/// Planes in node coordinates: heights are h + m·g [scene unit].
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Facets<T: Copy> {
    /// (h, m) of each; those that cut a body of planes alone off inside its grid last.
    pub planes: Vec<(T, Vec3<T>)>,
    /// They enclose the body, which has no other surface.
    pub alone: bool,
}

impl<T: Real> Facets<T> {
    /// Planes with these unit normals and distances from the origin [scene unit], which cut a body.
    pub fn cutting(planes: impl IntoIterator<Item = (Vec3<T>, T)>, lattice: &Lattice<T>) -> Self {
        let per_node = lattice.scale.map(T::recip);
        let of = |(normal, offset): (Vec3<T>, T)| {
            (normal.dot(lattice.domain.bounds.min) - offset, normal.hadamard(per_node))
        };
        Self { planes: planes.into_iter().map(of).collect(), alone: false }
    }

    /// The same, which enclose one.
    pub fn enclosing(planes: impl IntoIterator<Item = (Vec3<T>, T)>, lattice: &Lattice<T>) -> Self {
        let per_node = lattice.scale.map(T::recip);
        let Self { mut planes, .. } = Self::cutting(planes, lattice);
        for axis in 0..3 {
            let mut m = Vec3::zero();
            m[axis] = per_node[axis];
            let last = T::of(f64::from(lattice.domain.resolution[axis] - 1) - INSET);
            planes.extend([(m[axis] * T::of(INSET), -m), (-m[axis] * last, m)]);
        }
        Self { planes, alone: true }
    }

    /// The same in another precision.
    pub fn cast<U: Real>(&self) -> Facets<U> {
        let planes = self.planes.iter().map(|(h, m)| (U::of(h.f64()), m.cast())).collect();
        Facets { planes, alone: self.alone }
    }

    /// φ [scene unit] and its gradient [scene unit / node] at node coordinates `g`.
    #[inline(always)]
    pub fn sample(&self, g: Vec3<T>) -> (T, Vec3<T>) {
        let (height, which) = self.highest(g);
        (height, self.planes[which].1)
    }

    /// The height above the highest plane [scene unit], and which one that is; the first of equals.
    #[inline(always)]
    fn highest(&self, g: Vec3<T>) -> (T, usize) {
        let mut highest = (T::neg_infinity(), 0);
        for (k, (h, m)) in self.planes.iter().enumerate() {
            let height = *h + m.dot(g);
            if height > highest.0 {
                highest = (height, k);
            }
        }
        highest
    }

    /// Transpose of φ and ∇φ at `g`, which lies at `arm` from the middle of the box [scene unit]: adds four numbers for the plane that
    /// is the highest there. They follow each other in `grad`, plane by plane: dLoss/d(its normal), turned about the middle, and
    /// dLoss/d(its height below the middle). The planes that cut the body off receive nothing.
    pub fn scatter(&self, g: Vec3<T>, arm: Vec3<T>, d_value: T, d_gradient: Vec3<T>, grad: &mut [T]) {
        let which = self.highest(g).1;
        if which + CUTS < self.planes.len() {
            let d_normal = arm * d_value + d_gradient;
            let numbers = [d_normal.x, d_normal.y, d_normal.z, d_value];
            grad[4 * which..].iter_mut().zip(numbers).for_each(|(sum, d)| *sum += d);
        }
    }

    /// Where the line g + t v is below all planes: from the first to the second, which are no range where it never is.
    #[inline(always)]
    pub fn inside(&self, g: Vec3<T>, v: Vec3<T>) -> [T; 2] {
        let [mut first, mut last] = [T::neg_infinity(), T::infinity()];
        for (h, m) in &self.planes {
            let (height, slope) = (*h + m.dot(g), m.dot(v));
            if slope < T::zero() {
                first = first.max(-height / slope);
            } else if slope > T::zero() {
                last = last.min(-height / slope);
            } else if height > T::zero() {
                first = T::infinity();
            }
        }
        [first, last]
    }
}

#[cfg(test)]
mod tests {
    use crate::{Aabb, LevelSet, Ray, Vec3, vec3};

    /// A wedge of four planes, and a base.
    fn planes() -> [(Vec3<f64>, f64); 5] {
        let face = |x: f64, y: f64, z: f64, offset| (vec3(x, y, z).normalized(), offset);
        [
            face(1.0, 0.2, 0.3, 0.5),
            face(-1.0, 0.6, 0.1, 0.4),
            face(-0.2, -1.0, 0.0, 0.5),
            face(0.1, 0.0, 1.0, 0.55),
            face(0.0, 0.0, -1.0, 0.6),
        ]
    }

    fn height(x: Vec3<f64>) -> f64 {
        planes().into_iter().map(|(n, offset)| n.dot(x) - offset).fold(f64::MIN, f64::max)
    }

    /// The wedge on a grid of voxels of different edge lengths.
    fn wedge() -> LevelSet<f64> {
        let bounds = Aabb::new(vec3(-1.2, -1.1, -1.0), vec3(1.1, 1.2, 1.0));
        LevelSet::from_control_values(bounds, [31, 37, 33], height).with_planes(planes())
    }

    #[test]
    fn heights_and_normals_are_those_of_the_highest_plane_up_to_the_edges() {
        let body = wedge();
        for k in 0..2000 {
            let at = |m: usize| ((k * m % 1009) as f64 / 1009.0 - 0.5) * 1.6;
            let x = vec3(at(17), at(91), at(331));
            let (phi, gradient) = body.sample(x);
            assert!((phi - height(x)).abs() < 1e-12, "{phi} at {x:?}");
            assert!(planes().iter().any(|(n, _)| (gradient - *n).length() < 1e-12), "{gradient:?}");
            assert_eq!(body.hessian(x, vec3(1.0, 2.0, 3.0)), Vec3::zero());
        }
        let single = body.cast::<f32>();
        assert!((f64::from(single.value(vec3(0.1, 0.2, 0.3))) - height(vec3(0.1, 0.2, 0.3))).abs() < 1e-6);
    }

    #[test]
    fn derivatives_by_planes_match_central_differences() {
        let (body, middle, e) = (wedge(), wedge().domain().bounds.center(), 1e-6);
        let moved = |which: usize, turned: Vec3<f64>, raised: f64| {
            let mut planes = planes();
            let (n, offset) = planes[which];
            planes[which] = (n + turned, offset + turned.dot(middle) - raised);
            body.clone().with_planes(planes)
        };
        // Each plane turned towards each axis, and raised: forth and back.
        let differences: [[_; 4]; 5] = std::array::from_fn(|which| {
            std::array::from_fn(|a| {
                [e, -e].map(|by| {
                    let mut d = [0.0; 4];
                    d[a] = by;
                    moved(which, vec3(d[0], d[1], d[2]), d[3])
                })
            })
        });
        for k in 0..300 {
            let at = |m: usize| ((k * m % 1009) as f64 / 1009.0 - 0.5) * 1.6;
            let (x, v) = (vec3(at(17), at(91), at(331)), vec3(at(5), at(7), at(11)));
            let mut grad = vec![0.0; body.coefficients().len()];
            body.scatter(x, 0.7, v, &mut grad);
            let loss = |body: &LevelSet<f64>| {
                let (phi, gradient) = body.sample(x);
                0.7 * phi + v.dot(gradient)
            };
            for (p, [forth, back]) in differences.as_flattened().iter().enumerate() {
                let (found, fd) = (grad[p], (loss(forth) - loss(back)) / (2.0 * e));
                assert!((found - fd).abs() < 1e-7, "plane {}, {}: {found} and {fd}", p / 4, p % 4);
            }
            assert!(grad[20..].iter().all(|d| *d == 0.0));
        }
    }

    #[test]
    fn a_body_that_reaches_its_box_is_cut_off_inside_it() {
        let cube = Aabb::cube(1.0);
        let below = |x: Vec3<f64>| x.z;
        let half = LevelSet::from_control_values(cube, [21; 3], below);
        let half = half.with_planes([(vec3(0.0, 0.0, 1.0), 0.0)]);
        assert!(half.is_inside(vec3(0.3, 0.2, -0.7)) && !half.is_inside(vec3(0.3, 0.2, 0.01)));
        for x in [vec3(0.8, 0.0, -0.5), vec3(0.3, 0.2, -0.8), vec3(-0.95, 0.0, -0.5), vec3(3.0, 0.0, -0.2)] {
            assert!(!half.is_inside(x), "{x:?}");
        }
    }

    /// A ball whose middle part alone is left, between oblique planes.
    fn lens() -> (LevelSet<f64>, [(Vec3<f64>, f64); 2]) {
        let cuts = [(vec3(0.36, -0.48, 0.8), 0.2), (vec3(-0.3, 0.1, -0.9).normalized(), 0.35)];
        let cube = Aabb::cube(1.0);
        let ball = LevelSet::from_control_values(cube, [41; 3], |x: Vec3<f64>| x.length() - 0.7);
        (ball.cut_by(cuts), cuts)
    }

    #[test]
    fn a_spline_that_planes_cut_ends_there_with_sharp_edges() {
        let ((body, cuts), e) = (lens(), 1e-5);
        let ball = body.clone().cut_by([]);
        assert!(ball.planes().is_empty());
        let mut by_planes = 0;
        for k in 0..2000 {
            let at = |m: usize| ((k * m % 1009) as f64 / 1009.0 - 0.5) * 1.6;
            let x = vec3(at(17), at(91), at(331));
            let height = cuts.map(|(n, offset)| n.dot(x) - offset).into_iter().fold(f64::MIN, f64::max);
            let (phi, gradient) = body.sample(x);
            assert!((phi - ball.value(x).max(height)).abs() < 1e-12, "{phi} at {x:?}");
            let is_plane = height > ball.value(x);
            by_planes += usize::from(is_plane);
            // Nothing is received where a plane is the surface; else what the ball receives.
            let mut grads = [(); 2].map(|()| vec![0.0; body.coefficients().len()]);
            body.scatter(x, 0.7, vec3(0.1, 0.2, -0.3), &mut grads[0]);
            ball.scatter(x, 0.7, vec3(0.1, 0.2, -0.3), &mut grads[1]);
            let v = vec3(0.3, -1.1, 0.7);
            if is_plane {
                assert!(cuts.iter().any(|(n, _)| (gradient - *n).length() < 1e-12));
                assert!(grads[0].iter().all(|d| *d == 0.0));
                assert_eq!(body.hessian(x, v), Vec3::zero());
            } else {
                assert_eq!(grads[0], grads[1]);
                let slope = (ball.sample(x + v * e).1 - ball.sample(x - v * e).1) / (2.0 * e);
                assert!((body.hessian(x, v) - slope).length() < 1e-4, "{slope:?}");
            }
        }
        assert!((200..1800).contains(&by_planes), "{by_planes}");
    }

    #[test]
    fn what_learns_or_is_made_a_distance_stays_cut() {
        let (mut body, cuts) = lens();
        body.coefficients_mut().iter_mut().for_each(|c| *c -= 0.05);
        body.find_surface();
        body.redistance();
        let single = body.cast::<f32>();
        for (n, offset) in cuts {
            let (above, below) = (n * (offset + 1e-3), n * (offset - 1e-3));
            assert!(body.is_inside(below) && !body.is_inside(above));
            assert!(single.is_inside(below.cast()) && !single.is_inside(above.cast()));
        }
        let side = cuts[0].0.cross(cuts[1].0).normalized();
        assert!(body.is_inside(side * 0.74) && !body.is_inside(side * 0.76));
    }

    #[test]
    fn changed_coefficients_make_it_a_spline_again() {
        let mut body = wedge();
        let edge = vec3(0.0, 0.0, 0.0);
        body.coefficients_mut().iter_mut().for_each(|c| *c += 0.1);
        body.find_surface();
        assert!((body.value(edge) - height(edge) - 0.1).abs() < 0.05);
    }

    #[test]
    fn a_slab_moves_rays_by_its_closed_form_and_edges_bend_nothing() {
        use crate::optics::{Options, Tracer};
        use crate::{Domain, IndexGrid, Medium};
        let cube = Aabb::cube(1.0);
        let slab = |x: Vec3<f64>| (x.z.abs() - 0.25).max(x.x.abs() - 0.6).max(x.y.abs() - 0.6);
        let faces = (0..6).map(|k: usize| {
            let mut n = Vec3::zero();
            n[k / 2] = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            (n, if k / 2 == 2 { 0.25 } else { 0.6 })
        });
        let body = LevelSet::from_control_values(cube, [41; 3], slab).with_planes(faces);
        let index = 1.5;
        let medium = Medium::new(vec![IndexGrid::sharp(body, index)]).unwrap();
        let domain = Domain::with_longest(cube, crate::Extent::Bounded, 41);
        let tracer = Tracer::new(&medium, &domain, Options::default());
        let mut near_an_edge = 0;
        for k in 0..400 {
            let at = |m: usize| (k * m % 401) as f64 / 401.0 - 0.5;
            let direction = vec3(0.9 * at(29), 0.9 * at(83), -1.0).normalized();
            // All over the face, up to a hundredth of a voxel from its edges.
            let inner = 0.5998;
            let meets = vec3(2.0 * inner * at(17), 2.0 * inner * at(53), 0.25);
            let path = tracer.trace(&Ray { origin: meets - direction * 2.0, direction });
            let slope = |d: Vec3<f64>| vec3(d.x, d.y, 0.0) / -d.z;
            let inside = vec3(direction.x / index, direction.y / index, 0.0);
            let inside = inside - vec3(0.0, 0.0, (1.0 - inside.dot(inside)).sqrt());
            let leaves = meets + slope(inside) * 0.5 - vec3(0.0, 0.0, 0.5);
            if leaves.x.abs() > inner || leaves.y.abs() > inner {
                continue; // through a side
            }
            near_an_edge += usize::from(meets.x.abs().max(meets.y.abs()) > 0.55);
            let last = path.segments.last().unwrap();
            let away = (last.start - leaves).length();
            assert!(away < 1e-9, "{away} from {leaves:?}");
            assert!((last.momentum - direction).length() < 1e-9, "{:?}", last.momentum);
        }
        assert!(near_an_edge > 20, "{near_an_edge}");
    }
}

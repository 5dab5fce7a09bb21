//! An ellipsoid, from silhouettes: balls of glass and lenses with an index gradient.
//!
//! The plane through the camera and the contour touches the body. A plane m · x = h touches the ellipsoid
//! {c + S^½ u : |u| ≤ 1} where (h − m · c)² = mᵀSm, which is linear in c and P = S − c cᵀ: least squares. Noise of m would
//! make the body smaller, so that m is that of the plane through the line of sight which is nearest to touching the last one.

use super::contours::{Contours, Touch, View, pixels_per_radius, structure, weight};
use crate::least_squares::solved;
use refraxel_core::{Mat3, Vec3};

/// A body whose surface is |x − c|² = 1 in the metric S⁻¹.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::refraction_search) struct Ellipsoid {
    /// c [scene unit].
    pub center: Vec3<f64>,
    /// S⁻¹ [scene unit⁻²].
    metric: Mat3<f64>,
    /// Root mean square distance of the contours from its outlines, without the noise of single pixels [pixel].
    pub misfit: f64,
}

/// Times the lines of sight are weighted anew by how far they miss.
const ROUNDS: usize = 8;
/// Unknowns: c, and P by its diagonal and what lies beside it.
const UNKNOWNS: usize = 9;
/// What antialiased contours miss at best [pixel].
const NOISE: f64 = 0.2;
/// Longest axis by shortest: what is flatter is no ellipsoid, but something that few views see.
const FLATTEST: f64 = 8.0;

/// The ellipsoid whose silhouettes have these contours; `None` where they miss it by more than `tolerance` [part of its radius],
/// and what no picture shows better.
pub(in crate::refraction_search) fn ellipsoid(contours: &Contours, tolerance: f64) -> Option<Ellipsoid> {
    let Contours { frame, views, .. } = contours;
    let unit = Mat3::identity();
    let mut shape = Shape { center: Vec3::zero(), spread: unit, metric: unit };
    for _ in 0..ROUNDS {
        shape = shape.fitted(views)?;
    }
    let misfit = structure(views.iter().map(|v| v.touches.iter().map(|t| shape.miss(v, t)).collect()));
    let metric = shape.metric;
    // Trace and trace of the inverse bound both ends of the axes' squares.
    let trace = |m: &Mat3<f64>| (0..3).map(|k| m.columns[k][k]).sum::<f64>();
    let is_compact = trace(&shape.spread) * trace(&metric) < FLATTEST * FLATTEST;
    let limit = NOISE + tolerance * pixels_per_radius(views);
    let columns = metric.columns.map(|c| c / (frame.radius * frame.radius));
    let center = frame.center + shape.center * frame.radius;
    (is_compact && misfit <= limit).then_some(Ellipsoid { center, metric: Mat3 { columns }, misfit })
}

impl Ellipsoid {
    /// Signed distance from its surface to first order, exact for a ball [scene unit].
    pub(in crate::refraction_search) fn distance(&self, x: Vec3<f64>) -> f64 {
        let y = x - self.center;
        let gradient = self.metric * y;
        let radius = y.dot(gradient).sqrt();
        let slope = gradient.length();
        if slope > 0.0 {
            radius * (radius - 1.0) / slope
        } else {
            -self.metric.columns[0].length().sqrt().recip()
        }
    }
}

/// An ellipsoid by c, S and S⁻¹.
#[derive(Clone, Copy, Debug)]
struct Shape {
    center: Vec3<f64>,
    spread: Mat3<f64>,
    metric: Mat3<f64>,
}

/// A plane through a line of sight, and where a shape is when it meets it.
struct Tangency {
    /// Its unit normal m, and its distance h from the origin.
    normal: Vec3<f64>,
    height: f64,
    /// √(mᵀSm), and what the plane lies outside: h − m · c − √(mᵀSm).
    reach: f64,
    gap: f64,
    /// Pixels per unit of length where it touches.
    scale: f64,
}

impl Shape {
    /// The plane through a line of sight that is nearest to touching the shape; it faces as the contour does.
    fn tangency(&self, view: &View, touch: &Touch) -> Tangency {
        let along = self.metric * touch.direction;
        let from = view.eye - self.center;
        let nearest = from - touch.direction * (from.dot(along) / touch.direction.dot(along));
        let normal = (self.metric * nearest).normalized();
        let is_sound = normal.is_finite() && normal.dot(touch.normal) > 0.5;
        let normal = if is_sound { normal } else { touch.normal };
        let pole = self.spread * normal;
        let reach = normal.dot(pole).max(f64::MIN_POSITIVE).sqrt();
        let (height, at) = (normal.dot(view.eye), self.center + pole / reach);
        let gap = height - normal.dot(self.center) - reach;
        Tangency { normal, height, reach, gap, scale: touch.per_radian / (at - view.eye).length() }
    }

    /// How far outside a line of sight passes [pixel].
    fn miss(&self, view: &View, touch: &Touch) -> f64 {
        let t = self.tangency(view, touch);
        t.gap * t.scale
    }

    /// Least squares, in which each line of sight counts by how well the old shape follows it.
    fn fitted(&self, views: &[View]) -> Option<Self> {
        let mut matrix = vec![0.0; UNKNOWNS * UNKNOWNS];
        let mut right = vec![0.0; UNKNOWNS];
        for (view, touch) in views.iter().flat_map(|v| v.touches.iter().map(move |t| (v, t))) {
            let Tangency { normal: m, height, reach, gap, scale } = self.tangency(view, touch);
            // The squares' difference is 2 reach times the gap.
            let share = weight(gap * scale) * (scale / (2.0 * reach)).powi(2);
            let c = m * (2.0 * height);
            let row = [m.x * m.x, m.y * m.y, m.z * m.z, m.y * m.z, m.z * m.x, m.x * m.y, c.x, c.y, c.z];
            for (i, a) in row.into_iter().enumerate() {
                right[i] += share * a * height * height;
                for (j, b) in row.into_iter().enumerate() {
                    matrix[i * UNKNOWNS + j] += share * a * b;
                }
            }
        }
        let x = solved(&matrix, &right, 1e-12)?;
        let center = Vec3::new(x[6], x[7], x[8]);
        let [yz, zx, xy] = [0.5 * x[3], 0.5 * x[4], 0.5 * x[5]];
        let moment = Mat3::from_rows([[x[0], xy, zx], [xy, x[1], yz], [zx, yz, x[2]]]);
        let square = center.to_array().map(|c| center * c);
        let spread = Mat3 { columns: [0, 1, 2].map(|k| moment.columns[k] + square[k]) };
        Some(Self { center, spread, metric: inverse(&spread)? })
    }
}

/// The inverse of a symmetric matrix; `None` unless it is positive definite.
fn inverse(m: &Mat3<f64>) -> Option<Mat3<f64>> {
    let [a, b, c] = m.columns;
    let (det, minor) = (m.determinant(), a.x * b.y - a.y * b.x);
    let is_positive = a.x > 0.0 && minor > 0.0 && det > 0.0;
    is_positive.then(|| Mat3 { columns: [b.cross(c), c.cross(a), a.cross(b)].map(|v| v / det) })
}

#[cfg(test)]
mod tests {
    use super::super::views::{cameras, footprint, hull, shaken, silhouettes};
    use super::*;
    use crate::silhouettes::Outlines;
    use refraxel_core::{Ray, vec3};

    const FROM_ABOVE: [f64; 2] = [0.1, 0.9];
    const TOLERANCE: f64 = 0.01;

    /// Axes along which the body below reaches 0.7, 0.5 and 0.6.
    fn axes() -> [Vec3<f64>; 3] {
        let a = vec3(0.8, 0.36, 0.48).normalized();
        let b = a.cross(vec3(0.0, 0.0, 1.0)).normalized();
        [a, b, a.cross(b)]
    }
    const CENTER: Vec3<f64> = Vec3 { x: 0.08, y: -0.05, z: 0.1 };

    /// Whether a ray meets the ellipsoid of these semi-axes.
    fn meets(reach: [f64; 3]) -> impl Fn(&Ray<f64>) -> bool {
        move |ray| {
            let scaled = |v: Vec3<f64>| {
                let [a, b, c] = axes();
                vec3(a.dot(v) / reach[0], b.dot(v) / reach[1], c.dot(v) / reach[2])
            };
            let (o, d) = (scaled(ray.origin - CENTER), scaled(ray.direction));
            (o - d * (o.dot(d) / d.dot(d))).length() < 1.0
        }
    }

    fn found(views: &[crate::silhouettes::Silhouette]) -> Option<Ellipsoid> {
        let outlines = Outlines::new(views);
        let contours = Contours::new(&outlines, &hull(&outlines, 1.05, 64), None)?;
        ellipsoid(&contours, TOLERANCE)
    }

    #[test]
    fn an_ellipsoid_is_found_from_views_from_above_to_a_part_of_a_pixel() {
        let views = silhouettes(&cameras(24, FROM_ABOVE), meets([0.7, 0.5, 0.6]));
        for (views, pixels) in [(views.clone(), 0.1), (shaken(views, 1.0), 0.2)] {
            let found = found(&views).unwrap();
            for (axis, reach) in axes().into_iter().zip([0.7, 0.5, 0.6]) {
                for pole in [CENTER + axis * reach, CENTER - axis * reach] {
                    let off = found.distance(pole).abs();
                    assert!(off < pixels * footprint(), "{off} {} {found:?}", footprint());
                }
            }
        }
    }

    #[test]
    fn masks_that_are_all_too_large_show_a_larger_ellipsoid_and_a_few_wrong_ones_do_no_harm() {
        let cameras = cameras(24, FROM_ABOVE);
        let mut views = silhouettes(&cameras, meets([0.7, 0.5, 0.6]));
        let larger = silhouettes(&cameras, meets([0.9, 0.8, 0.8]));
        views[3] = larger[3].clone();
        views[11] = larger[11].clone();
        let found = found(&views).unwrap();
        assert!(found.distance(CENTER + axes()[0] * 0.7).abs() < 0.3 * footprint(), "{found:?}");
    }

    #[test]
    fn a_cube_and_two_balls_in_one_are_none() {
        let slab = |ray: &Ray<f64>, axis: Vec3<f64>, half: f64| {
            let (o, d) = (axis.dot(ray.origin), axis.dot(ray.direction));
            let ends = [(-half - o) / d, (half - o) / d];
            [ends[0].min(ends[1]), ends[0].max(ends[1])]
        };
        let cube = |ray: &Ray<f64>| {
            let all = axes().map(|a| slab(ray, a, 0.4));
            all.iter().fold(f64::MIN, |t, s| t.max(s[0])) < all.iter().fold(f64::MAX, |t, s| t.min(s[1]))
        };
        let pair = |ray: &Ray<f64>| {
            let near = |c: Vec3<f64>| (ray.origin - c).cross(ray.direction).length() < 0.45;
            near(vec3(0.15, 0.0, 0.0)) || near(vec3(-0.15, 0.0, 0.0))
        };
        let cameras = cameras(24, FROM_ABOVE);
        assert!(found(&silhouettes(&cameras, cube)).is_none());
        assert!(found(&silhouettes(&cameras, pair)).is_none());
    }

    #[test]
    fn the_distance_of_a_ball_is_exact() {
        let columns = Mat3::<f64>::identity().columns.map(|c| c * 4.0);
        let ball = Ellipsoid { center: CENTER, metric: Mat3 { columns }, misfit: 0.0 };
        for x in [vec3(0.3, 0.2, -0.7), vec3(0.1, 0.0, 0.1), CENTER] {
            assert!((ball.distance(x) - ((x - CENTER).length() - 0.5)).abs() < 1e-12);
        }
    }
}

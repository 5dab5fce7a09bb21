//! Lines of sight that touch a silhouette.

use super::{Outline, Outlines};
use rayon::prelude::*;
use refraxel_core::{Ray, Vec3};

/// A line of sight through the contour of a silhouette: it touches the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tangent {
    /// From the camera through the contour.
    pub ray: Ray<f64>,
    /// Unit normal, out of the silhouette, of the plane through the camera that touches the body along the
    /// contour.
    pub normal: Vec3<f64>,
    /// Pixels that a radian covers in the picture.
    pub per_radian: f64,
}

/// Distance of the samples whose difference is the contour's normal [sample].
const ARM: f32 = 2.0;

impl Outlines {
    /// Per view the lines of sight through the contour, where edges of the pixel raster cross it: at most
    /// about `most` of a view, taken evenly in the order of rows.
    ///
    /// Error: that of the distance map, 0.05 pixel on antialiased edges; corners are rounded over about a
    /// pixel.
    pub(crate) fn tangents(&self, most: usize) -> Vec<Vec<Tangent>> {
        let of_view = |view: &Outline| {
            let points = view.crossings();
            let stride = points.len().div_ceil(most.max(1)).max(1);
            points.into_iter().step_by(stride).filter_map(|at| view.tangent(at)).collect()
        };
        self.views.par_iter().map(|view| of_view(view)).collect()
    }
}

impl Outline {
    /// Where lines between neighbouring samples cross the contour [sample].
    fn crossings(&self) -> Vec<[f32; 2]> {
        let [w, h] = self.size;
        let d = &self.distance;
        let mut out = Vec::new();
        for i in 0..w * h {
            let (x, y) = (i % w, i / w);
            let crossed = |other: usize| (d[i] < 0.0) != (d[other] < 0.0);
            let share = |other: usize| d[i] / (d[i] - d[other]);
            if x + 1 < w && crossed(i + 1) {
                out.push([x as f32 + share(i + 1), y as f32]);
            }
            if y + 1 < h && crossed(i + w) {
                out.push([x as f32, y as f32 + share(i + w)]);
            }
        }
        out
    }

    /// The line of sight through a place of the distance map [sample].
    fn tangent(&self, [x, y]: [f32; 2]) -> Option<Tangent> {
        let clamp = |p: f32, n: usize| p.clamp(0.0, (n - 1) as f32);
        let at = |dx: f32, dy: f32| self.bilinear(clamp(x + dx, self.size[0]), clamp(y + dy, self.size[1]));
        let gradient = [at(ARM, 0.0) - at(-ARM, 0.0), at(0.0, ARM) - at(0.0, -ARM)];
        let length = gradient[0].hypot(gradient[1]);
        let out = gradient.map(|g| f64::from(g / length));
        let pixel = [x, y].map(|p| (f64::from(p) + 0.5) * self.stride as f64);
        let toward = |dx: f64, dy: f64| self.camera.ray(pixel[0] + dx, pixel[1] + dy);
        let (ray, along, outside) = (toward(0.0, 0.0)?, toward(-out[1], out[0])?, toward(out[0], out[1])?);
        let normal = ray.direction.cross(along.direction).normalized();
        let normal = if normal.dot(outside.direction) < 0.0 { -normal } else { normal };
        let tangent = Tangent { ray, normal, per_radian: 1.0 / f64::from(self.per_pixel) };
        normal.is_finite().then_some(tangent)
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::around::{Ball, cameras, silhouettes};
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn lines_of_sight_through_the_contour_of_a_ball_touch_it() {
        let Ball(centre, radius) = Ball(vec3(0.1, -0.2, 0.15), 0.6);
        let views = silhouettes(&cameras(7, 120), &[Ball(centre, radius)], &[]);
        let tangents = Outlines::new(&views).tangents(150);
        assert_eq!(tangents.len(), 7);
        for t in tangents.iter().flatten() {
            let to = centre - t.ray.origin;
            let along = to.dot(t.ray.direction);
            let miss = (to - t.ray.direction * along).length() - radius;
            assert!(miss.abs() / along * t.per_radian < 0.15, "{} pixel", miss / along * t.per_radian);
            // The plane through the eye touches the ball: within 2°, which is the length of the arm.
            let height = -t.normal.dot(to) - radius;
            assert!(height.abs() < 0.02 * radius, "{height}");
        }
        assert!(tangents.iter().all(|t| (75..=150).contains(&t.len())), "{}", tangents[0].len());
    }
}

//! Planes whose body has the silhouettes that views show.
//!
//! A line of sight through a contour touches the body. Where it misses the outline of the model by ρ pixels,
//! the two faces that meet at the edge of that outline can move: least squares over all lines of sight, three
//! unknowns per face.

use super::super::contours::{OUTLIER, Touch, View, loss, weight};
use super::boundary::{Boundary, Edge, Facet};
use crate::least_squares::solved;
use rayon::prelude::*;
use refraxel_core::Vec3;

/// An edge of the model that a view sees as its outline: the normal of the plane through the camera and the
/// edge, as a combination of the normals of both faces.
struct Outer<'a> {
    edge: &'a Edge,
    normal: Vec3<f64>,
    shares: [f64; 2],
}

/// Parameters of a face: a shift along its normal and two slopes about its middle, in units of the body's
/// radius.
pub(super) const OF_FACE: usize = 3;
/// Least and largest damping of a step, relative to the curvature.
const DAMPING: [f64; 2] = [1e-4, 1e3];

/// A model of planes, of which the first `free` may move.
#[derive(Clone, Debug)]
pub(super) struct Model {
    pub planes: Vec<Facet>,
    pub free: usize,
}

/// How a model fits.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub model: Model,
    /// Σ ψ(ρ) [pixel²].
    pub cost: f64,
}

/// The residual of a line of sight.
#[derive(Clone, Copy, Debug)]
pub(super) struct Miss {
    /// ρ [pixel], positive outside the model.
    pub pixels: f64,
    /// Its nearest point on the outline of the model.
    pub at: Vec3<f64>,
}

impl Model {
    /// The edges of a view's outline: those between a face that is seen and one that is not.
    fn outline<'a>(&self, boundary: &'a Boundary, eye: Vec3<f64>) -> Vec<Outer<'a>> {
        let heights: Vec<f64> = self.planes.iter().map(|p| p.height(eye)).collect();
        let edges = boundary.edges.iter().filter_map(|edge| {
            let [a, b] = edge.faces;
            let (of_a, of_b) = (heights[b].abs(), heights[a].abs());
            let is_outer = (heights[a] > 0.0) != (heights[b] > 0.0);
            let sum = self.planes[a].normal * of_a + self.planes[b].normal * of_b;
            let length = sum.length();
            (is_outer && length > 0.0).then(|| Outer {
                edge,
                normal: sum / length,
                shares: [of_a / length, of_b / length],
            })
        });
        edges.collect()
    }

    /// Calls `visit` with every line of sight's residual [pixel], in order, and the edge it belongs to.
    fn residuals(
        &self,
        boundary: &Boundary,
        views: &[View],
        mut visit: impl FnMut(Vec3<f64>, &Touch, f64, &Outer),
    ) {
        for view in views {
            let outline = self.outline(boundary, view.eye);
            for touch in &view.touches {
                let height = |outer: &Outer| outer.normal.dot(touch.direction);
                let mut highest: Option<(f64, &Outer)> = None;
                for outer in &outline {
                    let h = height(outer);
                    if highest.is_none_or(|(most, _)| h > most) {
                        highest = Some((h, outer));
                    }
                }
                if let Some((h, outer)) = highest {
                    visit(view.eye, touch, h * touch.per_radian, outer);
                }
            }
        }
    }

    /// Σ ψ(ρ) [pixel²]. Lines of sight at which the model shows no outline miss it by any distance: a model of no body costs
    /// most.
    pub(super) fn cost(&self, views: &[View]) -> f64 {
        let boundary = Boundary::of(&self.planes);
        let of_view = |view: &View| {
            let (mut cost, mut without) = (0.0, view.touches.len());
            self.residuals(&boundary, std::slice::from_ref(view), |_, _, rho, _| {
                cost += loss(rho);
                without -= 1;
            });
            cost + OUTLIER * without as f64
        };
        // Summed in the order of the views, whatever the threads do.
        views.par_iter().map(of_view).collect::<Vec<f64>>().into_iter().sum()
    }

    /// Residuals of all lines of sight, per view.
    pub(super) fn misses(&self, views: &[View]) -> Vec<Vec<Miss>> {
        let boundary = Boundary::of(&self.planes);
        let of_view = |view: &View| {
            let mut misses = Vec::with_capacity(view.touches.len());
            self.residuals(&boundary, std::slice::from_ref(view), |eye, touch, pixels, outer| {
                misses.push(Miss { pixels, at: outer.nearest(eye, touch.direction) });
            });
            misses
        };
        views.par_iter().map(of_view).collect()
    }

    /// The normal equations of a step: their matrix, by rows, and right-hand side.
    fn equations(&self, views: &[View]) -> (Vec<f64>, Vec<f64>) {
        let n = OF_FACE * self.free;
        let (mut matrix, mut right) = (vec![0.0; n * n], vec![0.0; n]);
        let boundary = Boundary::of(&self.planes);
        let frames: Vec<_> =
            self.planes.iter().zip(&boundary.faces).map(|(p, f)| (f.middle, p.tangents())).collect();
        self.residuals(&boundary, views, |eye, touch, rho, outer| {
            let x = outer.nearest(eye, touch.direction);
            let scale = -touch.per_radian / (x - eye).length();
            let weight = weight(rho);
            // A face that rises by h pushes the outline out by its share of h.
            let mut row = [(0, 0.0); 2 * OF_FACE];
            for side in 0..2 {
                let face = outer.edge.faces[side];
                let (middle, [u, v]) = frames[face];
                let by = scale * outer.shares[side];
                let slopes = [by, by * u.dot(x - middle), by * v.dot(x - middle)];
                let is_free = face < self.free;
                for k in 0..OF_FACE {
                    let value = if is_free { slopes[k] } else { 0.0 };
                    row[OF_FACE * side + k] = (if is_free { OF_FACE * face + k } else { 0 }, value);
                }
            }
            for (i, a) in row {
                right[i] -= weight * a * rho;
                for (j, b) in row {
                    matrix[i * n + j] += weight * a * b;
                }
            }
        });
        (matrix, right)
    }

    /// The planes after a step of their parameters.
    fn moved(&self, step: &[f64]) -> Self {
        let boundary = Boundary::of(&self.planes);
        let mut out = self.clone();
        for (k, by) in step.as_chunks::<OF_FACE>().0.iter().enumerate() {
            let (plane, middle) = (self.planes[k], boundary.faces[k].middle);
            let [u, v] = plane.tangents();
            let normal = (plane.normal - u * by[1] - v * by[2]).normalized();
            out.planes[k] = Facet { normal, offset: normal.dot(middle + plane.normal * by[0]) };
        }
        out
    }

    /// Without planes that do not touch the body.
    fn without_idle(mut self) -> Self {
        let boundary = Boundary::of(&self.planes);
        let least = 1e-6 * boundary.area();
        for k in (0..self.free).rev().filter(|&k| boundary.faces[k].area <= least) {
            self.planes.remove(k);
            self.free -= 1;
        }
        self
    }

    /// The fit after at most `steps` steps of Levenberg and Marquardt.
    pub(super) fn refined(self, views: &[View], steps: usize) -> Fit {
        let model = self.without_idle();
        let mut fit = Fit { cost: model.cost(views), model };
        let mut damping = 1e-2;
        let mut equations = None;
        for _ in 0..steps {
            let (matrix, right) = equations.get_or_insert_with(|| fit.model.equations(views));
            let Some(step) = solved(matrix, right, damping) else { break };
            let tried = fit.model.moved(&step);
            let cost = tried.cost(views);
            if cost < fit.cost {
                let settled = fit.cost - cost < 1e-3 * fit.cost;
                fit = Fit { model: tried.without_idle(), cost };
                equations = None;
                damping = (0.2 * damping).max(DAMPING[0]);
                if settled {
                    break;
                }
            } else if damping < DAMPING[1] {
                damping *= 8.0;
            } else {
                break;
            }
        }
        fit
    }
}

impl Outer<'_> {
    /// The point of the edge that is seen in a direction, or the end nearest to it.
    fn nearest(&self, eye: Vec3<f64>, direction: Vec3<f64>) -> Vec3<f64> {
        let [a, b] = self.edge.ends;
        let across = self.normal.cross(direction);
        let (along, whole) = ((eye - a).dot(across), (b - a).dot(across));
        let t = if whole == 0.0 { 0.5 } else { (along / whole).clamp(0.0, 1.0) };
        a + (b - a) * t
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    /// A skewed box, with touches at made-up places around it.
    fn setting() -> (Model, Vec<View>) {
        let facet = |x: f64, y: f64, z: f64, offset| Facet { normal: vec3(x, y, z).normalized(), offset };
        let planes = vec![
            facet(1.0, 0.2, 0.1, 0.6),
            facet(-1.0, 0.1, 0.0, 0.5),
            facet(0.0, 1.0, -0.2, 0.7),
            facet(0.1, -1.0, 0.1, 0.6),
            facet(0.2, 0.0, 1.0, 0.5),
            facet(0.0, 0.0, -1.0, 0.6),
        ];
        let view = |i: usize| {
            let a = i as f64;
            let eye = vec3(a.cos(), a.sin(), 0.4 * (3.0 * a).sin()).normalized() * 5.0;
            let touch = |k: usize| {
                let b = 0.7 * k as f64;
                let side = eye.cross(vec3(0.3, 0.1, 1.0)).normalized();
                let up = side.cross(eye).normalized();
                let at = (side * b.cos() + up * b.sin()) * 0.8;
                Touch { direction: (at - eye).normalized(), normal: at.normalized(), per_radian: 20.0 }
            };
            View { eye, touches: (0..9).map(touch).collect() }
        };
        (Model { planes, free: 5 }, (0..8).map(view).collect())
    }

    #[test]
    fn the_right_hand_side_is_the_slope_of_the_cost() {
        let (model, views) = setting();
        let (_, right) = model.equations(&views);
        for i in 0..right.len() {
            let at = |h: f64| {
                let step: Vec<f64> = (0..right.len()).map(|j| if j == i { h } else { 0.0 }).collect();
                model.moved(&step).cost(&views)
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            // Angles stand for distances in the picture: to second order in the residual's angle.
            assert!((slope + 2.0 * right[i]).abs() < 0.02 * (1.0 + slope.abs()), "{i}: {slope} {}", right[i]);
        }
    }

    #[test]
    fn a_model_of_no_body_costs_most() {
        let planes = |by: f64| {
            let axes = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
            let faces = axes.into_iter().flat_map(|a| [a, -a]);
            let planes = faces.map(|normal| Facet { normal, offset: by }).collect();
            Model { planes, free: 6 }
        };
        // The right and the left side of a cube, seen from far away.
        let touch = |x: f64| Touch {
            direction: vec3(x, 0.0, 10.0).normalized(),
            normal: vec3(x, 0.0, 0.0),
            per_radian: 100.0,
        };
        let views = [View { eye: vec3(0.0, 0.0, -10.0), touches: vec![touch(1.0), touch(-1.0)] }];
        let [right, small, none] = [1.0, 0.5, -1.0].map(|by| planes(by).cost(&views));
        assert!(right < small && small < none, "{right}, {small}, {none}");
        assert_eq!(none, 2.0 * OUTLIER);
    }
}

//! Emission and absorption along a path of straight segments, and its exact adjoint, theory (3.8)–(3.14).
//!
//! A path may be one straight ray or the many segments of a bent one: nothing here knows which. Forward and adjoint are
//! the same loop, read forwards and backwards.

pub mod clearcoat;
mod light;
pub mod probes;

pub use light::{MixAdjoint, mix, mix_vjp, without};
pub use probes::{ProbeGrid, ProbeStencil};

use crate::field::{FieldGradient, Matter, VoxelField};
use crate::grid::Domain;
use crate::sh;
use crate::{Ray, Real, Vec3};

/// A straight piece of a path, theory (3.1): x(t) = start + t p for t in `range`, arc length ds = |p| dt.
///
/// In vacuum p is the unit direction and t the arc length; in a medium |p| = n and t is the optical parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment<T> {
    /// x at t = 0 [scene unit].
    pub start: Vec3<T>,
    /// Optical momentum p = n dx/ds.
    pub momentum: Vec3<T>,
    /// Interval of t [scene unit].
    pub range: [T; 2],
}

impl<T: Real> Segment<T> {
    /// The part of a straight ray inside a domain, from arc length `near` on.
    pub fn straight(ray: &Ray<T>, domain: &Domain<T>, near: T) -> Option<Self> {
        let range = domain.clip(ray, near)?;
        Some(Self { start: ray.origin, momentum: ray.direction, range })
    }
    /// The point at t.
    #[inline(always)]
    pub fn at(&self, t: T) -> Vec3<T> {
        self.start + self.momentum * t
    }
}

/// A quadrature point: the field is taken as constant, with its value at `t`, over an interval of length `dt` about
/// `t`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraturePoint<T> {
    /// Which segment of the path.
    pub segment: usize,
    /// Parameter of the midpoint [scene unit].
    pub t: T,
    /// Length of the interval in t [scene unit]; its arc length is |p| dt.
    pub dt: T,
}

/// Points that share one step length, so that one vector of 16 lanes can work on them.
pub const GROUP: usize = 16;

/// Midpoint rule along a path with steps of about `step` [scene unit inside the box], shifted by `offset` ∈ [0, 1) steps.
/// The step is adapted to the distance from the box every [`GROUP`] points. What is left of a step at the end of a segment
/// is continued in the next: however short the segments, points come once per step.
///
/// The points are part of the discretisation: derivatives are taken with t and dt held fixed.
pub fn quadrature<T: Real>(
    domain: &Domain<T>,
    path: &[Segment<T>],
    step: T,
    offset: T,
) -> Vec<QuadraturePoint<T>> {
    let half = T::of(0.5);
    let mut points = Vec::new();
    let mut phase = offset; // steps from the start of the segment to its first point
    for (segment, s) in path.iter().enumerate() {
        let per_t = s.momentum.length().recip();
        let [t0, t1] = s.range;
        if t0 >= t1 {
            continue;
        }
        let mut dt = domain.step_at(s.at(t0), step) * per_t;
        let mut t = t0 + (phase - half) * dt;
        'segment: loop {
            for k in 0..GROUP {
                let middle = t + (T::of(k as f64) + half) * dt;
                if middle <= t1 {
                    points.push(QuadraturePoint { segment, t: middle, dt });
                } else {
                    phase = (middle - t1) / dt;
                    break 'segment;
                }
            }
            t += T::of(GROUP as f64) * dt;
            dt = domain.step_at(s.at(t), step) * per_t;
        }
    }
    points
}

/// What one path collects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel<T> {
    /// C = Σ T a c, without the background.
    pub colour: [T; 3],
    /// Transmittance left at the end of the path.
    pub transmittance: T,
    /// Σ T a s: arc length to what is seen, times its opacity [scene unit].
    pub depth: T,
}

/// March a path front to back, theory (3.9): τ = σ ds, a = 1 − e^(−τ), C += T a c, T *= 1 − a.
///
/// Worked number: one grey point (c = ½) of optical depth ln 2 gives C = ¼ and leaves T = ½.
/// Source: Max 1995, emission–absorption model.
pub fn render<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
) -> Pixel<T> {
    let mut pixel = Pixel { colour: [T::zero(); 3], transmittance: T::one(), depth: T::zero() };
    let (mut segment, mut arc) = (0, T::zero()); // arc length to the start of the segment
    for q in points {
        while segment < q.segment {
            arc += path[segment].momentum.length() * path[segment].range[1];
            segment += 1;
        }
        let s = &path[q.segment];
        let speed = s.momentum.length();
        let y = sh::basis(field.degree, s.momentum.normalized());
        let Some(medium) = field.at(s.at(q.t), &y) else { continue };
        let a = -(-medium.density * q.dt * speed).exp_m1();
        let weight = pixel.transmittance * a;
        for c in 0..3 {
            pixel.colour[c] += weight * medium.colour[c];
        }
        pixel.depth += weight * (arc + q.t * speed);
        pixel.transmittance *= T::one() - a;
    }
    pixel
}

/// What the adjoint starts from.
#[derive(Clone, Copy, Debug)]
pub struct PixelAdjoint<T> {
    /// ḡ = dLoss/d(C + T B).
    pub colour: [T; 3],
    /// dLoss/dT beyond what the background explains (opacity priors, alpha).
    pub transmittance: T,
    /// B, the radiance that arrives from behind the path.
    pub behind: [T; 3],
}

/// (dLoss/dstart, dLoss/dmomentum) of one segment.
pub type SegmentAdjoint<T> = (Vec3<T>, Vec3<T>);

/// Transpose of the derivative of `C + T B` and T from [`render`], back to front: adds to `grad` and returns, for each
/// segment, (dLoss/dstart, dLoss/dmomentum). dLoss/dB is T ḡ and left to the caller.
///
/// Theory (3.10)–(3.14). Exact for the discrete march with the points held fixed. Not differentiable where
/// [`VoxelField::at_vjp`] is not.
pub fn render_vjp<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
    d: &PixelAdjoint<T>,
    grad: &mut FieldGradient<T>,
) -> Vec<SegmentAdjoint<T>> {
    let mut d_path = vec![(Vec3::zero(), Vec3::zero()); path.len()];
    let before = transmittances(field, path, points);
    let last = before[points.len()];
    let mut behind = d.behind;
    for (k, q) in points.iter().enumerate().rev() {
        let s = &path[q.segment];
        let (speed, unit) = (s.momentum.length(), s.momentum.normalized());
        let (x, y) = (s.at(q.t), sh::basis(field.degree, unit));
        let Some(medium) = field.at(x, &y) else { continue };
        let ds = q.dt * speed;
        let a = -(-medium.density * ds).exp_m1();
        let contrast: T = (0..3).map(|c| d.colour[c] * (medium.colour[c] - behind[c])).sum();
        let d_tau = before[k] * (T::one() - a) * contrast - last * d.transmittance;
        let d_medium = Matter { density: d_tau * ds, colour: d.colour.map(|g| g * before[k] * a) };
        let (d_x, d_y) = field.at_vjp(x, &y, &d_medium, grad);
        let d_unit = sh::basis_vjp(field.degree, unit, &d_y);
        let tangent = (d_unit - unit * unit.dot(d_unit)) / speed;
        d_path[q.segment].0 += d_x;
        d_path[q.segment].1 += d_x * q.t + unit * (d_tau * medium.density * q.dt) + tangent;
        for c in 0..3 {
            behind[c] = a * medium.colour[c] + (T::one() - a) * behind[c];
        }
    }
    d_path
}

/// Transmittance in front of each point, and at the end.
fn transmittances<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
) -> Vec<T> {
    let mut out = Vec::with_capacity(points.len() + 1);
    let mut optical_depth = T::zero();
    for q in points {
        out.push((-optical_depth).exp());
        let s = &path[q.segment];
        let y = sh::basis(field.degree, s.momentum.normalized());
        if let Some(medium) = field.at(s.at(q.t), &y) {
            optical_depth += medium.density * q.dt * s.momentum.length();
        }
    }
    out.push((-optical_depth).exp());
    out
}

#[cfg(test)]
mod tests;

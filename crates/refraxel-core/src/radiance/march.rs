//! The march along a path, theory (3.9), and its adjoint, theory (3.10)–(3.14): the same loop, read forwards and backwards.

use super::absorption::Absorption;
use super::quadrature::QuadraturePoint;
use crate::field::{FieldGradient, Matter, VoxelField};
use crate::segment::{Segment, SegmentAdjoint};
use crate::{Real, sh};

/// What the march along one path collects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixel<T> {
    /// C = Σ T a c, without the background (sRGB-encoded, 1 = white).
    pub colour: [T; 3],
    /// Transmittance T at the end of the path, in [0, 1].
    pub transmittance: T,
    /// Σ T a s [scene unit]: the arc length to what is seen, times its opacity.
    pub depth: T,
}

/// Marches a path front to back, theory (3.9): τ = σ ds, a = 1 − e^(−τ), C += T a c, T *= 1 − a.
///
/// `points` are those of [`quadrature`](super::quadrature) on the same path. The direction of each segment, not that of the
/// camera ray, selects the colour, theory (3.7).
///
/// Worked number: one grey point (c = ½) of optical depth ln 2 gives C = ¼ and leaves T = ½.
/// Source: Max 1995, emission–absorption model.
pub fn render<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
) -> Pixel<T> {
    march(field, path, points, |_, colour| colour)
}

/// [`render`] through the bodies on the path, theory (7.18): the colour of each point is attenuated by what lies before it.
/// `absorption` is that of the same path; its [`whole`](Absorption::whole) attenuates what shows behind the path.
///
/// Its adjoint is made of [`render_vjp`]'s sweep over the attenuated colours, [`Filtered`](super::Filtered) and
/// [`AbsorptionAdjoint`](super::AbsorptionAdjoint).
pub fn render_through<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
    absorption: &Absorption<T>,
) -> Pixel<T> {
    march(field, path, points, |q, colour| absorption.filter(q.segment, q.t).through(colour).colour)
}

/// [`render`] with colours that pass `seen`.
fn march<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
    seen: impl Fn(&QuadraturePoint<T>, [T; 3]) -> [T; 3],
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
        let colour = seen(q, medium.colour);
        for c in 0..3 {
            pixel.colour[c] += weight * colour[c];
        }
        pixel.depth += weight * (arc + q.t * speed);
        pixel.transmittance *= T::one() - a;
    }
    pixel
}

/// dLoss/d([`Pixel`]) over a background: the input of [`render_vjp`].
#[derive(Clone, Copy, Debug)]
pub struct PixelAdjoint<T> {
    /// dLoss/d(C + T B).
    pub colour: [T; 3],
    /// dLoss/dT beyond what the background explains (a measured depth, alpha).
    pub transmittance: T,
    /// B, the radiance that arrives from behind the path (sRGB-encoded).
    pub behind: [T; 3],
}

/// Transpose of the derivative of `C + T B` and T from [`render`], theory (3.10)–(3.14), back to front: adds to `grad` and
/// returns dLoss/d(segment), one per segment. dLoss/dB is T dLoss/dC and left to the caller.
///
/// Exact for the discrete march with the points held fixed. The depth has no adjoint. Not differentiable where
/// [`VoxelField::at_vjp`] is not.
/// Source: Max 1995 for the march; the adjoint is its discrete transpose.
pub fn render_vjp<T: Real>(
    field: &VoxelField<T>,
    path: &[Segment<T>],
    points: &[QuadraturePoint<T>],
    d: &PixelAdjoint<T>,
    grad: &mut FieldGradient<T>,
) -> Vec<SegmentAdjoint<T>> {
    let mut d_path = vec![SegmentAdjoint::default(); path.len()];
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
        d_path[q.segment].start += d_x;
        d_path[q.segment].momentum += d_x * q.t + unit * (d_tau * medium.density * q.dt) + tangent;
        for c in 0..3 {
            behind[c] = a * medium.colour[c] + (T::one() - a) * behind[c];
        }
    }
    d_path
}

/// Transmittance T_i in front of each point, and T_N at the end: one more than there are points.
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

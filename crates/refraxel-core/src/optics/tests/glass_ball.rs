//! The evidence for the default interpolation: derivatives of the deflection of a glass ball against Snell's law.
//!
//! Ball of radius 20 voxels, n = 1.5, its edge blurred with a standard deviation of 1 voxel; 300 rays of random direction
//! and impact b < 0.9 R. Each derivative is divided by the exact one of the sharp ball.

use super::measures::exit_vjp;
use super::scene::options;
use crate::index::tests::Sequence;
use crate::optics::{Integrator, RayAdjoint, Tracer};
use crate::{Aabb, Domain, Extent, IndexGrid, Interpolation, Medium, Ray, Vec3};

const RADIUS: f64 = 20.0;
const INDEX: f64 = 1.5;
const BLUR: f64 = 1.0;

/// Error function complement. Source: Abramowitz & Stegun 7.1.26, absolute error 1.5e-7.
fn erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let poly = [1.061_405_429, -1.453_152_027, 1.421_413_741, -0.284_496_736, 0.254_829_592];
    let tail = poly.iter().fold(0.0, |s, c| (s + c) * t) * (-x * x).exp();
    if x >= 0.0 { tail } else { 2.0 - tail }
}

/// Deflection of a sharp ball at impact b, and its derivatives with respect to n and R.
fn snell(b: f64, n: f64, r: f64) -> [f64; 3] {
    let (outer, inner) = ((b / r).asin(), (b / (n * r)).asin());
    let d_outer = (1.0 - (b / r).powi(2)).sqrt().recip();
    let d_inner = (1.0 - (b / (n * r)).powi(2)).sqrt().recip();
    let by_index = 2.0 * b / (n * n * r) * d_inner;
    let by_radius = 2.0 * (b / (n * r * r) * d_inner - b / (r * r) * d_outer);
    [2.0 * (outer - inner), by_index, by_radius]
}

/// n of the blurred ball, in voxels.
fn ball(x: Vec3<f64>, n: f64, r: f64) -> f64 {
    1.0 + (n - 1.0) * 0.5 * erfc((x.length() - r) / (BLUR * 2.0_f64.sqrt()))
}

fn grid(interpolation: Interpolation, n: f64, r: f64) -> IndexGrid<f64> {
    // Nodes at half-integers: no ray meets the grid symmetrically.
    IndexGrid::from_samples(Aabb::cube(28.5), [58; 3], interpolation, |x| ball(x, n, r))
}

/// Quantiles 5 %, 50 %, 95 % over rays of found / exact, for deflection, d/dn and d/dR.
fn ratios(interpolation: Interpolation) -> [[f64; 3]; 3] {
    let e = 1e-4;
    let derivative = |n: f64, r: f64| -> Vec<f64> {
        let (up, down) =
            (grid(interpolation, INDEX + n, RADIUS + r), grid(interpolation, INDEX - n, RADIUS - r));
        up.coefficients().iter().zip(down.coefficients()).map(|(a, b)| (a - b) / (2.0 * e)).collect()
    };
    let (by_index, by_radius) = (derivative(e, 0.0), derivative(0.0, e));
    let medium = Medium::new(vec![grid(interpolation, INDEX, RADIUS)]).unwrap();
    let domain = Domain::with_longest(Aabb::cube(60.0), Extent::Bounded, 16);
    let tracer = Tracer::new(&medium, &domain, options(Integrator::Leapfrog, 0.25));
    let (mut r, mut found) = (Sequence(3), [const { Vec::new() }; 3]);
    for _ in 0..300 {
        let d = r.vector().normalized();
        let u = d.cross(r.vector()).normalized();
        let b = RADIUS * (0.05 + 0.85 * r.next().abs());
        let ray = Ray { origin: u * b - d * 50.0, direction: d };
        let path = tracer.trace(&ray);
        // Deflection towards the axis: the angle between the exit and d, measured against u.
        let exit = path.exit.direction;
        let (across, ahead) = (-exit.dot(u), exit.dot(d));
        let d_exit = (d * -across - u * ahead) / (across * across + ahead * ahead);
        let mut grad = medium.zero_gradient();
        let d_exit = RayAdjoint { origin: Vec3::zero(), direction: d_exit };
        exit_vjp(&tracer, &ray, &path, d_exit, &mut grad);
        let inner = |v: &[f64]| -> f64 { grad.index[0].iter().zip(v).map(|(a, b)| a * b).sum() };
        let exact = snell(b, INDEX, RADIUS);
        found[0].push(across.atan2(ahead) / exact[0]);
        found[1].push(inner(&by_index) / exact[1]);
        found[2].push(inner(&by_radius) / exact[2]);
    }
    found.map(|mut v| {
        v.sort_by(f64::total_cmp);
        [v[v.len() / 20], v[v.len() / 2], v[v.len() * 19 / 20]]
    })
}

/// Asserts that quantiles 5 %, 50 %, 95 % lie within a range.
fn within(found: [f64; 3], low: f64, high: f64) {
    assert!(found.iter().all(|q| (low..high).contains(q)), "{found:.3?} outside {low} … {high}");
}

#[test]
fn a_cubic_spline_gives_the_derivatives_of_snells_law() {
    // Measured 5/50/95 %: deflection .955/.987/.993, d/dn .882/.967/1.064, d/dR .716/.959/1.187.
    let [deflection, by_index, by_radius] = ratios(Interpolation::CubicBSpline);
    within(deflection, 0.94, 1.0);
    within(by_index, 0.85, 1.1);
    within(by_radius, 0.65, 1.25);
    assert!((0.9..1.05).contains(&by_index[1]) && (0.9..1.05).contains(&by_radius[1]));
}

#[test]
fn interpolated_differences_give_the_derivatives_of_snells_law_with_wider_tails() {
    // Measured: d/dn .602/.957/1.318, d/dR .583/.948/1.233.
    let [_, by_index, by_radius] = ratios(Interpolation::TrilinearOfDifferences);
    assert!((0.9..1.05).contains(&by_index[1]) && (0.9..1.05).contains(&by_radius[1]));
    assert!(by_index[0] < 0.75 && by_index[2] > 1.2, "tails {by_index:.3?}");
}

#[test]
fn plain_trilinear_refracts_well_and_differentiates_wrongly() {
    // Measured: deflection .924/.980/1.030, yet d/dn −2.33/.045/2.16 and d/dR −2.02/1.74/5.75. The gradient is exact
    // for the discrete renderer; it is the renderer whose force jumps at every face that has another derivative.
    let [deflection, by_index, by_radius] = ratios(Interpolation::Trilinear);
    within(deflection, 0.9, 1.1);
    assert!(by_index[1] < 0.5 && by_index[0] < 0.0, "d/dn {by_index:.3?}");
    assert!(by_radius[1] > 1.4 && by_radius[0] < 0.0, "d/dR {by_radius:.3?}");
}

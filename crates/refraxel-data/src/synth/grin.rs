//! Rays in a graded index, theory (2.2): dx/dt = p, dp/dt = ∇(n²/2), dt = ds/n, by an embedded Runge–Kutta pair with
//! error control.

use super::medium::Index;
use refraxel_core::Vec3;

/// A point of a bent ray in phase space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Position [scene unit].
    pub x: Vec3<f64>,
    /// Optical momentum n dx/ds; |p| = n.
    pub p: Vec3<f64>,
    /// Arc length so far [scene unit].
    pub s: f64,
}

impl Phase {
    /// A ray at `x` that travels along the unit vector `d` in a medium.
    pub fn new(x: Vec3<f64>, d: Vec3<f64>, index: &Index) -> Phase {
        Phase { x, p: d * index.n(x), s: 0.0 }
    }

    /// Right-hand side of the ray equation; ds/dt = n.
    fn rate(&self, index: &Index) -> Phase {
        Phase { x: self.p, p: index.force(self.x), s: index.n(self.x) }
    }

    /// self + h Σ weights · rates.
    fn add(&self, h: f64, weights: &[f64], rates: &[Phase]) -> Phase {
        let mut y = *self;
        for (&w, k) in weights.iter().zip(rates) {
            y.x += k.x * (h * w);
            y.p += k.p * (h * w);
            y.s += k.s * (h * w);
        }
        y
    }

    /// Direction of travel.
    pub fn direction(&self) -> Vec3<f64> {
        self.p.normalized()
    }
}

// Dormand & Prince 1980, RK5(4)7M. The last row of A is the fifth-order solution; ERROR is
// that solution minus the fourth-order one.
const A: [&[f64]; 6] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
const ERROR: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// One step of size `h` in t: the fifth-order end point and the estimated error of (x, p) [scene unit, 1].
///
/// Source: Dormand & Prince, J. Comp. Appl. Math. 6 (1980).
pub fn step(index: &Index, y: &Phase, h: f64) -> (Phase, f64) {
    let mut rates = [Phase { x: Vec3::zero(), p: Vec3::zero(), s: 0.0 }; 7];
    rates[0] = y.rate(index);
    let mut end = *y;
    for (i, row) in A.iter().enumerate() {
        end = y.add(h, row, &rates[..=i]);
        rates[i + 1] = end.rate(index);
    }
    let zero = Phase { x: Vec3::zero(), p: Vec3::zero(), s: 0.0 };
    let e = zero.add(h, &ERROR, &rates);
    (end, e.x.length().max(e.p.length()))
}

/// Step size control, theory (6.10): the next h for an `error` made with `h` when `tolerance` is allowed per step.
pub fn next_step(h: f64, error: f64, tolerance: f64) -> f64 {
    // 0.9 keeps most steps from being repeated; the bounds keep one odd estimate from ruining the step size.
    h * (0.9 * (tolerance / error.max(1e-300)).powf(0.2)).clamp(0.2, 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;
    use std::f64::consts::PI;

    const TIGHT: f64 = 1e-13; // error per step; hundreds of steps stay below 1e-10

    /// Follow a ray for a time `t` > 0 with at most `tolerance` of estimated error per step.
    ///
    /// Error: about `tolerance` times the number of steps.
    fn advance(index: &Index, start: Phase, t: f64, tolerance: f64) -> Phase {
        let (mut y, mut left, mut h) = (start, t, t.min(0.05));
        while left > 0.0 {
            let trial = h.min(left);
            let (end, error) = step(index, &y, trial);
            h = next_step(trial, error, tolerance);
            if error <= tolerance {
                y = end;
                left -= trial;
            }
        }
        y
    }

    #[test]
    fn a_fibre_ray_is_a_harmonic_oscillation() {
        let (ior, alpha) = (1.6, 1.3);
        let index = Index::Fibre { center: Vec3::zero(), axis: vec3(0.0, 0.0, 1.0), ior, alpha };
        let start = Phase::new(vec3(0.2, -0.1, 0.0), vec3(0.1, 0.2, 1.0).normalized(), &index);
        let (t, w) = (3.7_f64, ior * alpha);
        let end = advance(&index, start, t, TIGHT);
        for a in 0..2 {
            let exact = start.x[a] * (w * t).cos() + start.p[a] / w * (w * t).sin();
            assert!((end.x[a] - exact).abs() < 1e-10);
        }
        assert!((end.x.z - start.p.z * t).abs() < 1e-11);
    }

    #[test]
    fn a_fish_eye_ray_is_a_circle_that_closes() {
        let index = Index::FishEye { center: Vec3::zero(), radius: 1.0 };
        let start = Phase::new(vec3(0.5, 0.0, 0.0), vec3(0.3, 0.9, 0.2).normalized(), &index);
        // By stereographic projection the ray is a great circle of the unit sphere with dl = 2 ds / (1 + r²) = n ds.
        let (mut y, mut optical, h) = (start, 0.0, 2e-3_f64);
        while optical < 2.0 * PI - 1e-9 {
            let n = index.n(y.x);
            let dt = h.min((2.0 * PI - optical) / (n * n));
            let next = step(&index, &y, dt).0;
            let middle = step(&index, &y, 0.5 * dt).0;
            let n2 = [n * n, index.n(middle.x).powi(2), index.n(next.x).powi(2)];
            optical += dt * (n2[0] + 4.0 * n2[1] + n2[2]) / 6.0; // Simpson: dl = n ds = n² dt
            y = next;
        }
        assert!((y.x - start.x).length() < 1e-6, "{:?}", y.x); // stops within 1e-9 optical length; h⁴ quadrature
    }

    #[test]
    fn a_weak_gaussian_bump_deflects_by_the_line_integral_of_its_gradient() {
        let (a, sigma, b) = (1e-6, 0.1, 0.07);
        let index = Index::Gaussian { center: Vec3::zero(), sigma, peak: 1.0 + a };
        let start = Phase::new(vec3(-1.0, b, 0.0), vec3(1.0, 0.0, 0.0), &index);
        let end = advance(&index, start, 2.0, 1e-15);
        let exact = -a * b / sigma * (2.0 * PI).sqrt() * (-0.5 * b * b / (sigma * sigma)).exp();
        assert!((end.direction().y / exact - 1.0).abs() < 1e-4, "{} {exact}", end.direction().y);
    }

    #[test]
    fn a_strong_gaussian_bump_keeps_energy_and_angular_momentum() {
        let index = Index::Gaussian { center: Vec3::zero(), sigma: 0.15, peak: 1.6 };
        let start = Phase::new(vec3(-1.0, 0.11, 0.02), vec3(1.0, 0.0, 0.1).normalized(), &index);
        let end = advance(&index, start, 1.5, TIGHT);
        assert!((end.p.length() - index.n(end.x)).abs() < 1e-11);
        assert!((end.x.cross(end.p) - start.x.cross(start.p)).length() < 1e-11);
        assert!(end.direction().dot(start.direction()) < 0.99, "the bump did bend the ray");
    }

    #[test]
    fn the_pair_is_of_fifth_order() {
        let index = Index::FishEye { center: Vec3::zero(), radius: 0.5 };
        let start = Phase::new(vec3(-0.4, 0.1, 0.0), vec3(1.0, 0.2, 0.0).normalized(), &index);
        let exact = advance(&index, start, 0.4, 1e-15).x;
        let error = |steps: u32| {
            let end = (0..steps).fold(start, |y, _| step(&index, &y, 0.4 / f64::from(steps)).0);
            (end.x - exact).length()
        };
        let order = (error(20) / error(40)).log2();
        assert!((4.5..6.5).contains(&order), "{order}");
    }
}

//! Priors, theory (4.3)–(4.5), (4.27): penalties for what is unlikely in a scene, whatever its images show. Next to each
//! is its slope, the derivative by its first argument; where only the slope is used, it stands alone.

use crate::Real;

/// Charbonnier penalty of the difference d of two neighbours, theory (4.4): ψ(d) = √(d² + ε²) − ε, which is |d| for large
/// and d²/2ε for small d.
///
/// Source: Charbonnier et al. 1994; per edge of the grid, summed over the three axes (anisotropic total variation).
#[inline(always)]
pub fn charbonnier<T: Real>(d: T, epsilon: T) -> T {
    (d * d + epsilon * epsilon).sqrt() - epsilon
}

/// ψ'(d) of [`charbonnier`].
#[inline(always)]
pub fn charbonnier_slope<T: Real>(d: T, epsilon: T) -> T {
    d / (d * d + epsilon * epsilon).sqrt()
}

/// Huber penalty ψ(d): d²/2 for |d| ≤ δ, δ (|d| − δ/2) beyond. Source: Huber 1964.
#[inline(always)]
pub fn huber<T: Real>(d: T, delta: T) -> T {
    let (a, half) = (d.abs(), T::of(0.5));
    if a <= delta { half * d * d } else { delta * (a - half * delta) }
}

/// ψ'(d) of [`huber`].
#[inline(always)]
pub fn huber_slope<T: Real>(d: T, delta: T) -> T {
    d.max(-delta).min(delta)
}

/// w |c − C*|² of a sample, theory (4.5), by its colour c alone: 2 w (c − C*). Its weight w = T a is held fixed, so that nothing gains by
/// hiding what differs.
///
/// Source: DVGO (Sun et al. 2022).
#[inline(always)]
pub fn sample_colour_slope<T: Real>(weight: T, colour: [T; 3], target: [T; 3]) -> [T; 3] {
    [0, 1, 2].map(|c| T::of(2.0) * weight * (colour[c] - target[c]))
}

/// κ of theory (4.27): what sensors of depth err by, as a share of what they measure.
pub const DEPTH_ERROR: f64 = 0.02;

/// What a unit of weight costs at the distance t along a ray where d > 0 was measured, theory (4.27): (t − d)² / ((t − d)² + κ² d²), from 0 at
/// d to 1 far from it; κ is [`DEPTH_ERROR`].
///
/// Source: Geman and McClure 1987.
#[inline(always)]
pub fn depth_cost<T: Real>(t: T, d: T) -> T {
    let (away, error) = (t - d, T::of(DEPTH_ERROR) * d);
    away * away / (away * away + error * error)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_derivatives() {
        let e = 1e-6;
        for x in [-0.7, -0.01, 0.003, 0.4, 0.9_f64] {
            let check = |f: &dyn Fn(f64) -> f64, g: f64| {
                let fd = (f(x + e) - f(x - e)) / (2.0 * e);
                assert!((fd - g).abs() < 1e-7, "{fd} vs {g}");
            };
            check(&|x| charbonnier(x, 0.05), charbonnier_slope(x, 0.05));
            check(&|x| huber(x, 0.2), huber_slope(x, 0.2));
            let target = [0.3, 0.1, 0.6];
            let slope = sample_colour_slope(0.7, [x, 0.2, 0.5], target)[0];
            check(&|x| 0.7 * (x - target[0]).powi(2), slope);
        }
    }
}

//! The update rule of the optimiser, theory (4.7), for one parameter at a time, and the share of its gradient that a sample
//! passes on; backends decide which parameters to touch.

use crate::Real;

/// RMSProp, theory (4.7): v ← β v + (1 − β) g², x ← x − rate · g / (√v + ε).
///
/// The first update of a parameter (v = 0) sets v = g², so that its first step has the length `rate`. The rule does not
/// depend on the scale of the loss, as long as √v exceeds ε.
/// Source: Hinton 2012; the first update as in Plenoxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RmsProp<T> {
    /// Decay β of the second moment per update [1], in [0, 1).
    pub decay: T,
    /// Floor ε of the denominator [unit of the gradient].
    pub epsilon: T,
}

impl<T: Real> RmsProp<T> {
    /// The step to add to a parameter with gradient `g`; updates its second moment `v`. `rate` has the unit of the
    /// parameter.
    #[inline(always)]
    pub fn step(&self, g: T, v: &mut T, rate: T) -> T {
        g * self.scale(g * g, v, rate)
    }

    /// The factor from a gradient to its step, for parameters that share the second moment `v`; `mean_square` is the mean
    /// of their g².
    #[inline(always)]
    pub fn scale(&self, mean_square: T, v: &mut T, rate: T) -> T {
        let fresh = *v == T::zero();
        *v = if fresh { mean_square } else { self.decay * *v + (T::one() - self.decay) * mean_square };
        -rate / (v.sqrt() + self.epsilon)
    }
}

/// Share of its gradient by which a sample at the distance t from the camera moves the field, theory (4.29): min(1, t²/t₀²), and 1 for t₀ = 0. The
/// rays of a camera that meet a voxel are about as many as 1/t².
///
/// Source: Philip and Deschaintre 2023.
#[inline(always)]
pub fn near_share<T: Real>(t: T, full: T) -> T {
    if t < full { (t / full) * (t / full) } else { T::one() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_step_has_the_length_of_the_rate() {
        let rule = RmsProp { decay: 0.95_f64, epsilon: 0.0 };
        let mut v = 0.0;
        assert!((rule.step(1e-5, &mut v, 0.1) + 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_quadratic_is_minimised() {
        let rule = RmsProp { decay: 0.9_f64, epsilon: 1e-12 };
        let (mut x, mut v) = (3.0, 0.0);
        for k in 0..400 {
            x += rule.step(2.0 * (x - 1.0), &mut v, 0.1 * 0.98_f64.powi(k));
        }
        assert!((x - 1.0).abs() < 1e-3);
    }

    #[test]
    fn samples_near_the_camera_have_a_smaller_share() {
        assert_eq!([0.0, 0.5, 1.0, 2.0, 9.0].map(|t| near_share(t, 2.0)), [0.0, 0.0625, 0.25, 1.0, 1.0]);
        assert_eq!(near_share(0.0, 0.0), 1.0);
    }
}

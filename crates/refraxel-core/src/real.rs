//! The scalar that the mathematics is generic over: `f32` in production, `f64` as the oracle.

use num_traits::{Float, NumAssign};
use std::fmt::Debug;
use std::iter::Sum;

/// A real scalar: `f32` or `f64`.
pub trait Real: Float + NumAssign + Sum + Default + Debug + Send + Sync + 'static {
    /// The nearest value of this type to a literal of the theory.
    fn of(x: f64) -> Self;
    /// This value in double precision (exact).
    fn f64(self) -> f64;
}

impl Real for f32 {
    #[inline(always)]
    fn of(x: f64) -> f32 {
        x as f32
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn of(x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self
    }
}

//! The scalar that the mathematics is generic over: `f32` in production, `f64` as the oracle.
//!
//! A formula is written once. Its tests run in f64, where rounding hides no mistake, and the tests of the backends compare
//! the production code in f32 with it.

use num_traits::{Float, NumAssign};
use std::fmt::Debug;
use std::iter::Sum;

/// A real scalar: `f32` or `f64`.
pub trait Real: Float + NumAssign + Sum + Default + Debug + Send + Sync + 'static {
    /// The value of this type nearest to `x`: for the numbers of a formula, such as `T::of(0.5)`.
    fn of(x: f64) -> Self;
    /// This value in double precision, without rounding. Sums over many terms are taken there.
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

//! Whom the suite tests, and how strictly.

use crate::backend::Backend;
use crate::model::Model;

/// A backend to be tested, and how far it may be from the reference.
pub struct Suite<B: Backend> {
    /// A backend with a model that has not learned yet.
    pub make: fn(Model) -> B,
    /// What it answers for.
    pub tolerances: Tolerances,
}

impl<B: Backend> Suite<B> {
    /// A backend with this model.
    pub(super) fn backend(&self, model: Model) -> B {
        (self.make)(model)
    }
}

/// Largest deviations from the reference in f64, those of gradients relative to the largest entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerances {
    /// Colours of straight rays, and gradients of what they meet.
    pub straight: f64,
    /// Gradients of straight rays themselves, which jump where a sample changes its cell by rounding.
    pub ray: f64,
    /// Colours of bent rays, and gradients of the field they meet.
    pub bent: f64,
    /// Gradients of the index and of bent rays.
    pub index: f64,
    /// Gradients through surfaces that mirror, against central differences.
    pub mirrored_index: f64,
    /// Gradients through the normals of opaque things, sums of slopes that nearly cancel in a rough field.
    pub clearcoat: f64,
}

impl Tolerances {
    /// Those of arithmetic in f32: epsilon 6e-8 × about 30 samples × up to 16 terms each, with a margin of 3, for straight
    /// rays; the rounding of a path's position shows in all others.
    pub const SINGLE_PRECISION: Self =
        Self { straight: 1e-4, ray: 1e-3, bent: 2e-3, index: 5e-3, mirrored_index: 2e-2, clearcoat: 5e-3 };
}

//! Density, colour and background: how they start, learn and are regularised.

use super::section::section;

section! {
    /// Density, colour and background: how they start, how fast they learn, and how they are regularised.
    pub struct FieldOptions "field" {
        /// Degree of the spherical harmonics of colour.
        sh_degree: u8 = 2, in 0..=3;
        /// Learning rate of raw density at the start of the run, theory (4.8).
        rate_density: f32 = 1.0, in 0.0..=100.0;
        /// Learning rate of SH coefficients at the start of the run.
        rate_colour: f32 = 0.02, in 0.0..=100.0;
        /// Weight of measured depth, where photographs have depth maps, theory (4.27).
        depth: f32 = 0.03, in 0.0..;
        /// Weight of the total variation of density. A fifth of it where a backdrop bounds the scene and nothing is known to refract.
        tv_density: f32 = 1e-5, in 0.0..;
        /// Weight of the total variation of colour.
        tv_colour: f32 = 1e-5, in 0.0..;
    }
}

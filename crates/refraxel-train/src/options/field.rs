//! Density, colour and background: how they start, learn and are regularised.

use super::section::section;

section! {
    /// Density, colour and background: how they start, how fast they learn, and how they are regularised.
    pub struct FieldOptions "field" {
        /// Degree of the spherical harmonics of colour.
        sh_degree: u8 = 2, in 0..=3;
        /// Raw density everywhere at the start.
        initial_density: f32 = -5.0, in -9.0..=9.0;
        /// Learning rate of raw density at the start of the run, theory (4.8).
        rate_density: f32 = 1.0, in 0.0..=100.0;
        /// Learning rate of SH coefficients at the start of the run.
        rate_colour: f32 = 0.02, in 0.0..=100.0;
        /// Learning rate of the background at the start of the run.
        rate_background: f32 = 0.01, in 0.0..=100.0;
        /// Factor on all learning rates that is reached at the end of the run.
        rate_decay: f32 = 0.05, in 1e-6..=1.0;
        /// Share of the run during which the learning rates rise from a tenth of their value.
        warm_up: f32 = 0.01, in 0.0..=1.0;
        /// Where rays bend in a bounded scene: share of the run during which the learning rate of view-dependent colour rises from 0
        /// to that of all colour, theory (4.8); 0: it has that rate from the start.
        view_warm_up: f32 = 1.0, in 0.0..=1.0;
        /// Weight of the Cauchy sparsity prior per sample.
        sparsity: f32 = 0.0, in 0.0..;
        /// Weight of the opacity prior per ray.
        opacity: f32 = 0.0, in 0.0..;
        /// Weight of the total variation of density.
        tv_density: f32 = 1e-5, in 0.0..;
        /// Weight of the total variation of colour.
        tv_colour: f32 = 1e-5, in 0.0..;
        /// Factor on the weights of total variation that is reached at the end of the run.
        tv_decay: f32 = 0.1, in 1e-6..=1.0;
        /// In one step, total variation visits one in this many voxels.
        tv_period: u32 = 16, in 1..=1_048_576, "voxels";
        /// Factor on `tv_density` once rays bend: the views through a refractive medium show the scene from few sides.
        tv_density_refractive: f32 = 2.0, in 0.0..=1000.0;
        /// Rows of the learned panorama behind an unbounded scene.
        background_rows: u32 = 64, in 1..=2048, "rows";
    }
}

//! Where a ray crosses a surface.

use refraxel_core::Vec3;

/// Crossings nearer than this are the surface the ray has just left [scene unit]; chords shorter than it are not seen.
pub(in crate::synth) const S_MIN: f64 = 1e-7;

/// Where a ray crosses a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Arc length from the ray's origin [scene unit].
    pub s: f64,
    /// Outward unit normal: the ray enters where d · normal < 0 and leaves where it is > 0.
    pub normal: Vec3<f64>,
}

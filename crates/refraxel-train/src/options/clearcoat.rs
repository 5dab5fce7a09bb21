//! The clearcoat of opaque things.

use super::Switch;
use super::section::section;

section! {
    /// The clearcoat of opaque things.
    pub struct ClearcoatOptions "clearcoat" {
        /// Whether opaque things have a clearcoat that mirrors.
        enabled: Switch = Switch::Off;
        /// Index of refraction of the clearcoat.
        index: f32 = 1.5, in 1.0..=4.0;
        /// Share of the run after which the clearcoat is there: surfaces must be known before they can mirror.
        start: f64 = 0.15, in 0.0..=1.0;
        /// Radiance probes of the clearcoat along the longest edge of the scene.
        probes: u32 = 16, in 2..=64;
        /// Learning rate of the strength with which the clearcoat mirrors.
        rate: f32 = 0.02, in 0.0..=1.0;
    }
}

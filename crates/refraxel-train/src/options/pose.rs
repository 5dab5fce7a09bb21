//! How the poses of the photographs learn.

use super::Switch;
use super::section::section;

section! {
    /// How the poses of the photographs learn. Gauss–Newton steps on the error of the rays move each camera; what all cameras do
    /// together is left out, for photographs cannot tell it from the scene doing the opposite.
    pub struct PoseOptions "pose" {
        /// Whether poses learn. Otherwise they are taken as exact.
        enabled: Switch = Switch::Off;
        /// Whether the focal length and the first radial coefficient of each lens learn together with the poses: one pair for all
        /// photographs whose data say the same lens. They begin after a fifth of the run.
        lens: Switch = Switch::Off;
        /// Steps of training from one step of the poses to the next.
        every: u64 = 4, in 1..;
        /// Rays of such a step.
        rays: u32 = 4096, in 1..=1_048_576, "rays";
        /// The first of them: poses need a scene to be compared with.
        first: u64 = 48;
        /// Poses are held after this share of the run.
        hold: f64 = 0.9, in 0.0..=1.0;
    }
}

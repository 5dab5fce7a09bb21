//! How the poses of the photographs learn.

use super::Switch;
use super::section::section;

section! {
    /// How the poses of the photographs learn. Gauss–Newton steps on the error of the rays move each camera; what all cameras do
    /// together is left out, because photographs cannot distinguish it from the opposite movement of the scene.
    pub struct PoseOptions "pose" {
        /// Whether poses learn. Otherwise they are taken as exact.
        enabled: Switch = Switch::Off;
        /// Whether the focal length and the first radial coefficient of each lens learn together with the poses: one pair for all
        /// photographs whose data say the same lens. They begin after a fifth of the run.
        lens: Switch = Switch::Off;
    }
}

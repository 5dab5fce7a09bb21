//! Whether exposure and white balance of the photographs learn.

use super::Switch;
use super::section::section;

section! {
    /// Exposure and white balance of the photographs.
    pub struct ExposureOptions "exposure" {
        /// Whether each photograph learns three gains of light, one per channel, whose mean over all photographs is 1. Otherwise all
        /// are taken as equally exposed. They learn as often and from as many rays as poses.
        enabled: Switch = Switch::Off;
    }
}

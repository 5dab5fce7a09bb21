//! How refractive things are sought where no mask shows them.

use super::Allowed;
use super::Switch;
use super::section::section;

section! {
    /// How refractive things are sought where no mask shows them, before the run begins. Straight rays of few pixels and a coarse grid
    /// learn the scene; where they fail to show what the photographs show, and many views agree on the place, something may refract.
    pub struct DetectionOptions "detection" {
        /// Whether refractive things are sought where neither masks nor a file say what is refractive. Otherwise rays stay straight
        /// there. A run that finds nothing has the bits of one that did not look.
        enabled: Switch = Switch::On;
        /// What is found must separate pixels that straight rays explain from those that they do not: least share of the variance
        /// of the residuals that it explains. It was 0 to 0.08 where nothing refracts, mirrors and photographs included, and 0.22 to 0.42
        /// of glass.
        separation: f64 = 0.13, in 0.0..=1.0;
        /// Rays from which straight rays learn before the look; 0: 1.2 million, but at most a tenth of the rays of the run, and none where
        /// that is less than a quarter of them. Where the run has a clock, looking takes a tenth of its time at most.
        rays: u64 = 0, in Allowed::AutoOrWithin(1000.0, 1e12), "rays";
    }
}

//! How refractive things are sought where no mask shows them.

use super::Allowed;
use super::Switch;
use super::section::section;

section! {
    /// The search for refractive regions where no mask shows them, before the run begins. Straight rays of few pixels learn the scene on a
    /// coarse grid; where they cannot reproduce the photographs, and many views agree on the place, something may refract.
    pub struct DetectionOptions "detection" {
        /// Whether refractive regions are searched for where neither masks nor a file state them. Otherwise rays stay straight
        /// there. A run that finds nothing has the bits of one without the search.
        enabled: Switch = Switch::On;
        /// Least share of the variance of the residuals that a region must explain by separating pixels that straight rays reproduce
        /// from those that they do not. Measured: 0 to 0.08 where nothing refracts, mirrors and photographs included, and 0.22
        /// to 0.42 for glass.
        separation: f64 = 0.13, in 0.0..=1.0;
        /// Rays from which the detector learns before it searches; 0: 1.2 million, but at most a tenth of the rays of the run, and no search where
        /// that tenth is less than a quarter of 1.2 million. Where the run has a clock, the search takes at most a tenth of its time.
        rays: u64 = 0, in Allowed::AutoOrWithin(1000.0, 1e12), "rays";
    }
}

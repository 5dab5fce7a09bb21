//! How refractive things are sought where no mask shows them.

use super::Switch;
use super::section::section;

section! {
    /// How refractive things are sought where no mask shows them, before the run begins. Straight rays of few pixels and a coarse grid
    /// learn the scene; where they fail to show what the photographs show, and many views agree on the place, something may refract.
    pub struct SeekOptions "seek" {
        /// Whether refractive things are sought where neither masks nor a file say what is refractive. Otherwise rays stay straight
        /// there. A run that finds nothing has the bits of one that did not look.
        enabled: Switch = Switch::On;
        /// What is found must separate pixels that straight rays explain from those that they do not: least share of the variance
        /// of the residuals that it explains. It was 0 to 0.08 where nothing refracts, mirrors and photographs included, and 0.22 to 0.42
        /// of glass.
        separation: f64 = 0.13, in 0.0..=1.0;
        /// Cells of all photographs together, each of which teaches, and is compared with, one ray, about.
        cells: u32 = 400_000, in 1000..=100_000_000, "cells";
        /// Rays from which straight rays learn before the look.
        rays: u64 = 1_200_000, in 1000.., "rays";
        /// Most of a run that looking may take: of its time, or of its rays where it has steps. A run that leaves less than a
        /// quarter of `rays` does not look.
        cost: f64 = 0.1, in 0.0..=0.5;
    }
}

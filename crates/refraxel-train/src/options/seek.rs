//! How refractive things are sought where no mask shows them.

use super::Switch;
use super::section::section;

section! {
    /// How refractive things are sought where no mask shows them. Straight rays learn the scene for some steps; where they fail to
    /// show what the photographs show, and many views agree on the place, something may refract. What is found there is left out
    /// while straight rays learn the surroundings anew, and is then looked at again.
    pub struct SeekOptions "seek" {
        /// Whether refractive things are sought. Otherwise rays stay straight where nothing says what is refractive. What is found
        /// shows where glass is better than it shows its shape: balls bend so far, other things stay straight, at the cost of a fifth
        /// of a short run.
        enabled: Switch = Switch::Off;
        /// Looks at the photographs: the first one, and some more at the scene without what was found.
        looks: u32 = 3, in 1..=20;
        /// Steps of straight rays from one look to the next.
        pause: u64 = 120;
        /// What is found must separate pixels that straight rays explain from those that they do not: least share of the variance
        /// of the residuals that it explains. It was at most 0.07 where nothing refracts, and 0.15 to 0.55 of glass before a textured ground.
        separation: f64 = 0.1, in 0.0..=1.0;
        /// Cells of all photographs together, each of which a look compares with one ray, about.
        cells: u32 = 400_000, in 1000..=100_000_000, "cells";
    }
}

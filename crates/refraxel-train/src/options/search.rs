//! What is assumed of the first index and its profile.

use super::Switch;
use super::section::section;
use super::value::choice;

choice! {
    /// How the index changes from the outside of a refractive body to its inside.
    pub enum SurfaceProfile {
        /// The program takes the profile that fits the training images best.
        Auto = "auto",
        /// It jumps at a surface, which is the level set of a function.
        Sharp = "sharp",
        /// It changes smoothly over some voxels.
        Smooth = "smooth",
        /// It rises from 1 at the hull to the middle, as in a lens with an index gradient.
        Graded = "graded",
    }
}

section! {
    /// The search for the body in each region, with its index and its dimensions, by prediction without training.
    pub struct SearchOptions "search" {
        /// Whether the first index is searched. Otherwise it is `guess`.
        enabled: Switch = Switch::On;
        /// Index of refraction to start from without a search.
        guess: f32 = 1.4, in 1.0..=4.0;
        /// How the index changes from the outside of a refractive body to its inside.
        profile: SurfaceProfile = SurfaceProfile::Auto;
    }
}

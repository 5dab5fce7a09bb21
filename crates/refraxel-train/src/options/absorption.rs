//! The colour of refractive bodies.

use super::Switch;
use super::section::section;

section! {
    /// The colour of refractive bodies: what they absorb.
    pub struct AbsorptionOptions "absorption" {
        /// Whether refractive bodies learn what they absorb of red, green and blue. Otherwise they stay as clear, or as
        /// tinted, as they are.
        enabled: Switch = Switch::On;
        /// Learning rate of the optical thickness over the longest edge of a body's box.
        rate: f32 = 0.03, in 0.0..=1.0;
    }
}

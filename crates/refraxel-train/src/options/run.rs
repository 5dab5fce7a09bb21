//! How long a run takes, and what it may use.

use super::Allowed;
use super::section::section;

section! {
    /// How long a run takes, and what it may use.
    pub struct RunOptions "run" {
        /// Seed of all random numbers. The same seed, data and options give the same bits.
        seed: u64 = 0;
        /// Steps of the run; ignored where `minutes` is set.
        steps: u64 = 12_000, in 1..;
        /// Steps after which the run stops as if it were interrupted, saved and ready to be resumed; 0: never.
        stop_after: u64 = 0;
        /// Wall-clock time of the run [minute]; 0: it takes `steps` instead. A clock is not reproducible, steps are.
        minutes: f64 = 0.0, in 0.0.., "minutes";
        /// Time between two checkpoints [second]; 0: a minute, or longer where saving would take more than 1 % of the time.
        save_every: f64 = 0.0, in 0.0..=1e6, "seconds";
        /// Rays in the batch of a step.
        batch: u32 = 8192, in 1..=1_048_576, "rays";
        /// Largest estimated memory of parameters and moments [GiB]. The resolution is lowered until they fit.
        memory: f64 = 8.0, in Allowed::Above(0.0), "GiB";
    }
}

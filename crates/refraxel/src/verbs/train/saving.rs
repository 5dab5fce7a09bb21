//! How often a run is saved.

use std::time::{Duration, Instant};

/// Time between two saves where nothing else is asked for: more is never lost.
const USUAL: Duration = Duration::from_secs(60);
/// A pause is at least so many times as long as a save: saving takes at most 1 % of the time.
const PAUSE_PER_SAVE: u32 = 99;

/// When a run is saved next.
pub struct Saving {
    /// The option `run.save_every`, where it is not 0.
    asked: Option<Duration>,
    /// How long the last save took.
    took: Duration,
}

impl Saving {
    /// By `run.save_every` [s].
    pub fn new(save_every: f64) -> Self {
        let asked = Some(save_every).filter(|s| *s > 0.0).map(Duration::from_secs_f64);
        Self { asked, took: Duration::ZERO }
    }

    /// Time until the next save.
    pub fn pause(&self) -> Duration {
        self.asked.unwrap_or(USUAL.max(PAUSE_PER_SAVE * self.took))
    }

    /// Saves, and takes the time.
    pub fn time<T>(&mut self, save: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let saved = save();
        self.took = start.elapsed();
        saved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saving_takes_a_hundredth_of_the_time_at_most_unless_it_is_asked_for() {
        let mut usual = Saving::new(0.0);
        assert_eq!(usual.pause(), USUAL);
        usual.took = Duration::from_secs(2);
        assert_eq!(usual.pause(), Duration::from_secs(198));
        let mut asked = Saving::new(0.25);
        asked.took = Duration::from_secs(2);
        assert_eq!(asked.pause(), Duration::from_millis(250));
        assert_eq!(asked.time(|| 7), 7);
        assert!(asked.took < Duration::from_secs(2));
    }
}

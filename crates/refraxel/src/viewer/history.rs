//! What was told of a training, for pages that open later: its curve thinned out, and its latest events.

use super::protocol::Training;
use std::collections::VecDeque;

/// Records of the curve that are kept at most; where there are more, every second one is left out.
const MOST_RECORDS: usize = 1000;
/// Events that are kept, as many as a page lists.
const MOST_EVENTS: usize = 200;

/// What was told, in its order.
#[derive(Debug, Default)]
pub struct History {
    records: Vec<(u64, Training)>,
    events: VecDeque<(u64, Training)>,
    told: u64,
    /// Of so many records one is kept.
    every: u64,
    recorded: u64,
    /// The last record, which is kept in any case.
    last: Option<(u64, Training)>,
}

impl History {
    /// Keeps what was told.
    pub fn keep(&mut self, what: Training) {
        self.told += 1;
        if !matches!(what, Training::Record { .. }) {
            self.events.push_back((self.told, what));
            if self.events.len() > MOST_EVENTS {
                self.events.pop_front();
            }
            return;
        }
        self.every = self.every.max(1);
        if self.recorded.is_multiple_of(self.every) {
            self.records.push((self.told, what.clone()));
        }
        self.recorded += 1;
        self.last = Some((self.told, what));
        if self.records.len() > MOST_RECORDS {
            let mut is_kept = false;
            self.records.retain(|_| {
                is_kept = !is_kept;
                is_kept
            });
            self.every *= 2;
        }
    }

    /// What is kept, in the order in which it was told.
    pub fn told(&self) -> impl Iterator<Item = &Training> {
        let last = self.last.iter().filter(|(n, _)| self.records.last().is_none_or(|(kept, _)| kept < n));
        let mut all: Vec<&(u64, Training)> = self.records.iter().chain(&self.events).chain(last).collect();
        all.sort_by_key(|(n, _)| *n);
        all.into_iter().map(|(_, what)| what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(step: u64) -> Training {
        let (steps, progress) = (Some(100_000), step as f64 / 100_000.0);
        Training::Record { step, steps, progress, train_psnr: Some(20.0), val_psnr: None, phase: "straight" }
    }

    fn event(step: u64) -> Training {
        Training::Event { text: format!("at {step}") }
    }

    #[test]
    fn a_long_training_is_told_in_bounded_space_from_its_first_record_to_its_last() {
        let mut history = History::default();
        for step in 0..100_000 {
            history.keep(record(step));
            history.keep(event(step));
        }
        let told: Vec<&Training> = history.told().collect();
        let step =
            |what: &&Training| if let Training::Record { step, .. } = what { Some(*step) } else { None };
        let steps: Vec<u64> = told.iter().filter_map(step).collect();
        assert!((MOST_RECORDS / 2..=MOST_RECORDS + 1).contains(&steps.len()), "{}", steps.len());
        assert_eq!((steps[0], *steps.last().unwrap()), (0, 99_999));
        let gaps: Vec<u64> = steps.windows(2).map(|two| two[1] - two[0]).collect();
        assert!(gaps[..gaps.len() - 1].iter().all(|gap| *gap == gaps[0]), "{gaps:?}");
        let events = told.iter().filter(|what| matches!(what, Training::Event { .. })).count();
        assert_eq!((events, *told.last().unwrap()), (MOST_EVENTS, &event(99_999)));
    }

    #[test]
    fn a_short_training_is_told_as_it_was() {
        let mut history = History::default();
        let all: Vec<Training> = (0..9).map(|k| if k % 3 == 0 { event(k) } else { record(k) }).collect();
        all.iter().for_each(|what| history.keep(what.clone()));
        assert!(history.told().eq(&all));
    }
}

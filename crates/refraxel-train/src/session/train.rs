//! Training until something ends it.

use super::SessionError;
use super::start::Session;
use super::until::{Stop, Until};
use crate::events::{Event, Observer};
use crate::trainer::TrainError;
use std::time::Instant;

impl Session {
    /// Train. Whatever happens is told to the observer, between steps and inside long phases.
    pub fn run(&mut self, until: Until, observer: &mut dyn FnMut(Event)) -> Result<Stop, SessionError> {
        self.trainer.start_clock();
        let stop = self.train(until, observer);
        self.trainer.pause_clock();
        self.serve_requests();
        if let Some(record) = self.trainer.last_words() {
            observer(Event::Record(record));
        }
        if let Ok(Stop::Cancelled) = stop {
            self.cancel.reset();
        }
        stop
    }

    fn train(&mut self, until: Until, observer: &mut dyn FnMut(Event)) -> Result<Stop, SessionError> {
        let start = Instant::now();
        let stop_after = Some(self.options().run.stop_after).filter(|&step| step > 0);
        let last = until.step.into_iter().chain(stop_after).min();
        loop {
            if self.requests.are_there() {
                self.trainer.settle(&mut Observer::new(&self.cancel, observer))?;
                self.trainer.pause_clock();
                self.serve_requests();
                self.trainer.start_clock();
            }
            let is_late = until.elapsed.is_some_and(|limit| start.elapsed() >= limit);
            let stop = if self.trainer.finished() {
                Some(Stop::Finished)
            } else if self.cancel.is_cancelled() {
                Some(Stop::Cancelled)
            } else {
                let is_reached = last.is_some_and(|limit| self.state().step >= limit);
                (is_late || is_reached).then_some(Stop::Reached)
            };
            let mut observer = Observer::new(&self.cancel, observer);
            if let Some(stop) = stop {
                // A step that failed is not done: the run has gone back, and goes on if it is to be finished.
                let is_done = self.trainer.settle(&mut observer)?;
                if is_done && stop == Stop::Finished {
                    self.trainer.round_colour()?;
                }
                if is_done || stop != Stop::Finished {
                    return Ok(stop);
                }
            }
            match self.trainer.step(&mut observer) {
                Ok(()) => {}
                Err(TrainError::Cancelled(_)) => self.cancel.cancel(),
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Gives copies to whoever asked for one.
    fn serve_requests(&mut self) {
        while let Some(request) = self.requests.next() {
            // Whoever asked may be gone.
            let _ = request.send(self.snapshot());
        }
    }
}

//! The progress of one piece of work, shown as it was asked for.

use super::bar::Bar;
use super::lines::Lines;
use super::show::Show;
use super::subtask::Subtask;
use std::io;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// The progress of one piece of work.
///
/// End it with [`Progress::finish`] or [`Progress::abandon`]; dropped without either, a bar vanishes.
pub struct Progress {
    shown: Shown,
}

enum Shown {
    Bar(Bar),
    Lines(Lines<io::Stderr>),
    Nothing,
}

impl Progress {
    /// Starts to show `name`, with `total` parts to do.
    pub fn new(show: Show, name: &str, total: u64) -> Self {
        Self::within(show, name, total, None)
    }

    /// The same of work that takes this time, whatever happens: its parts are parts of that time.
    pub fn timed(show: Show, name: &str, total: u64, time: Duration) -> Self {
        Self::within(show, name, total, Some(time))
    }

    fn within(show: Show, name: &str, total: u64, time: Option<Duration>) -> Self {
        let shown = match show {
            Show::Bar => Shown::Bar(Bar::new(name, total, time)),
            Show::Lines => Shown::Lines(Lines::new(io::stderr(), name, total, time)),
            Show::Nothing => Shown::Nothing,
        };
        Self { shown }
    }

    /// `done` parts are done; `note` is shown next to them, such as "27.3 dB". Cheap enough for every step.
    ///
    /// Shows the work itself again after a [`Progress::subtask`].
    pub fn set(&mut self, done: u64, note: &str) {
        match &mut self.shown {
            Shown::Bar(bar) => bar.set(done, note),
            Shown::Lines(lines) => lines.set(Instant::now(), done, note),
            Shown::Nothing => {}
        }
    }

    /// Shows a subtask in place of the work, until the next [`Progress::set`]. Cheap enough for every step.
    ///
    /// A subtask is known by its name: another name starts another one, with a pace of its own.
    pub fn subtask(&mut self, task: &Subtask<'_>, note: &str) {
        match &mut self.shown {
            Shown::Bar(bar) => bar.subtask(task, note),
            Shown::Lines(lines) => lines.subtask(Instant::now(), task, note),
            Shown::Nothing => {}
        }
    }

    /// Shows a line that stays, above the bar.
    pub fn say(&mut self, text: &str) {
        match &mut self.shown {
            Shown::Bar(bar) => bar.say(text),
            Shown::Lines(lines) => lines.print(text),
            Shown::Nothing => {}
        }
    }

    /// All parts are done: fills the bar, with a last note that stays.
    pub fn finish(self, note: &str) {
        match self.shown {
            Shown::Bar(bar) => bar.finish(note),
            Shown::Lines(mut lines) => lines.finish(Instant::now(), note),
            Shown::Nothing => {}
        }
    }

    /// The work stops before its end: leaves the bar where it is, or says where that is.
    pub fn abandon(self, note: &str) {
        match self.shown {
            Shown::Bar(bar) => bar.abandon(note),
            Shown::Lines(mut lines) => lines.abandon(Instant::now(), note),
            Shown::Nothing => {}
        }
    }
}

/// Shows how many of `total` parts are done: call what it returns after each, on any thread.
pub fn counter(show: Show, name: &str, total: usize) -> impl Fn() + Sync {
    let shown = Mutex::new((Progress::new(show, name, total as u64), 0));
    move || {
        if let Ok(mut shown) = shown.lock() {
            let (progress, done) = &mut *shown;
            *done += 1;
            progress.set(*done, "");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quiet_shows_nothing() {
        assert_eq!(Show::suited(true), Show::Nothing);
        let mut progress = Progress::new(Show::Nothing, "training", 10);
        progress.set(3, "27.3 dB");
        progress.subtask(&Subtask { name: "index search", done: 1, total: None }, "");
        progress.say("a line");
        progress.abandon("");
    }
}

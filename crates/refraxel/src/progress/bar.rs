//! Progress as a bar that redraws itself.

use super::lines::time_of;
use super::subtask::Subtask;
use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::time::Duration;

/// Redraws of the bar per second.
const REDRAWS: u8 = 8;
/// Layout for work with a known end.
const COUNTED: &str =
    "{prefix:>10.bold} {bar:32.cyan/black.bright} {percent:>3} % {pos}/{len}  {eta} left  {msg}";
/// Layout for work that takes a known time.
const TIMED: &str =
    "{prefix:>10.bold} {bar:32.cyan/black.bright} {percent:>3} % {pos}/{len}  {rest} left  {msg}";
/// Layout for work without a known end.
const OPEN: &str = "{prefix:>10.bold} {spinner:.cyan} {pos} done in {elapsed}  {msg}";

/// The bar, and the work that it stands for.
pub struct Bar {
    bar: ProgressBar,
    name: String,
    total: u64,
    /// How long the work takes where that is certain.
    time: Option<Duration>,
    /// Name and total of the subtask that the bar shows in place of the work.
    subtask: Option<(String, Option<u64>)>,
}

impl Bar {
    pub fn new(name: &str, total: u64, time: Option<Duration>) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(REDRAWS));
        Self::on(bar, name, total, time)
    }

    fn on(bar: ProgressBar, name: &str, total: u64, time: Option<Duration>) -> Self {
        bar.set_style(style(Some(total), time));
        bar.set_prefix(name.to_owned());
        Self { bar, name: name.to_owned(), total, time, subtask: None }
    }

    pub fn set(&mut self, done: u64, note: &str) {
        if self.subtask.take().is_some() {
            self.show(&self.name, Some(self.total), self.time, done);
        }
        self.advance(done, note);
    }

    pub fn subtask(&mut self, task: &Subtask<'_>, note: &str) {
        let shown = self.subtask.as_ref().map(|(name, total)| (name.as_str(), *total));
        if shown != Some((task.name, task.total)) {
            self.show(task.name, task.total, None, task.done);
            self.subtask = Some((task.name.to_owned(), task.total));
        }
        self.advance(task.done, note);
    }

    pub fn say(&self, text: &str) {
        self.bar.println(text);
    }

    pub fn finish(mut self, note: &str) {
        self.set(self.total, note);
        self.bar.finish();
    }

    pub fn abandon(self, note: &str) {
        self.bar.abandon_with_message(note.to_owned());
    }

    /// Begins to show other work, whose time left is not that of the work before.
    fn show(&self, name: &str, total: Option<u64>, time: Option<Duration>, done: u64) {
        self.bar.set_style(style(total, time));
        self.bar.set_prefix(name.to_owned());
        self.bar.update(|state| {
            state.set_pos(done);
            // The style for work without a known end shows no length.
            if let Some(total) = total {
                state.set_len(total);
            }
        });
        self.bar.reset_eta(); // after the position: the jump to it is no pace
        self.bar.reset_elapsed();
    }

    fn advance(&self, done: u64, note: &str) {
        if self.bar.message() != note {
            self.bar.set_message(note.to_owned());
        }
        self.bar.set_position(done);
    }
}

fn style(total: Option<u64>, time: Option<Duration>) -> ProgressStyle {
    let template = match (total, time) {
        (Some(_), None) => COUNTED,
        (Some(_), Some(_)) => TIMED,
        (None, _) => OPEN,
    };
    // A template that cannot be read gives the usual bar; a test reads all.
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    let time = time.unwrap_or_default();
    let rest = move |state: &ProgressState, out: &mut dyn Write| {
        let total = state.len().unwrap_or_default();
        let left = time_of(time, total.saturating_sub(state.pos()), total);
        let _ = write!(out, "{:#}", HumanDuration(left)); // as the bar's own time left
    };
    style.with_key("rest", rest).progress_chars("━╸─")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hidden() -> (Bar, ProgressBar) {
        let bar = ProgressBar::with_draw_target(Some(10), ProgressDrawTarget::hidden());
        (Bar::on(bar.clone(), "training", 10, None), bar)
    }

    #[test]
    fn templates_are_valid() {
        assert!([COUNTED, TIMED, OPEN].iter().all(|t| ProgressStyle::with_template(t).is_ok()));
    }

    #[test]
    fn abandoned_work_leaves_the_bar_where_it_was() {
        for done in [0, 3] {
            let (mut bar, drawn) = hidden();
            bar.set(done, "27.3 dB");
            bar.abandon("stopped");
            assert!(drawn.is_finished());
            assert_eq!((drawn.position(), drawn.message().as_str()), (done, "stopped"));
        }
    }

    #[test]
    fn finished_work_fills_the_bar() {
        let (mut bar, drawn) = hidden();
        bar.set(3, "x");
        bar.say("a line");
        bar.finish("28.0 dB");
        assert_eq!((drawn.position(), drawn.message().as_str()), (10, "28.0 dB"));
    }

    #[test]
    fn a_subtask_takes_the_bar_and_gives_it_back() {
        let (mut bar, drawn) = hidden();
        let shown = || (drawn.prefix(), drawn.position(), drawn.length());
        bar.set(4, "");
        bar.subtask(&Subtask { name: "index search", done: 12, total: Some(63) }, "n 1.33");
        assert_eq!(shown(), ("index search".into(), 12, Some(63)));
        bar.subtask(&Subtask { name: "hull", done: 2, total: None }, "");
        assert_eq!((drawn.prefix(), drawn.position()), ("hull".into(), 2));
        bar.set(5, "27.3 dB");
        assert_eq!(shown(), ("training".into(), 5, Some(10)));
    }

    #[test]
    fn time_left_after_a_subtask_is_not_that_of_the_subtask() {
        let (mut bar, drawn) = hidden();
        bar.subtask(&Subtask { name: "index search", done: 1, total: Some(63) }, "");
        bar.set(9, "");
        // The jump from 1 to 9 took no time; as a pace it would leave none.
        assert_eq!(drawn.per_sec(), 0.0);
    }

    #[test]
    fn finishing_within_a_subtask_fills_the_bar_of_the_work() {
        let (mut bar, drawn) = hidden();
        bar.subtask(&Subtask { name: "index search", done: 1, total: Some(63) }, "");
        bar.finish("");
        assert_eq!((drawn.prefix(), drawn.position(), drawn.length()), ("training".into(), 10, Some(10)));
    }
}

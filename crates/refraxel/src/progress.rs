//! Progress on standard error: a bar with the time left in a terminal, now and then a plain line elsewhere.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Time between two plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// Redraws of the bar per second.
const REDRAWS: u8 = 8;

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    /// A bar that redraws itself.
    Bar,
    /// A line every ten seconds, for logs.
    Lines,
    /// Nothing.
    Nothing,
}

impl Show {
    /// Nothing when quiet, otherwise what standard error can do.
    pub fn suited(quiet: bool) -> Self {
        if quiet {
            Self::Nothing
        } else if io::stderr().is_terminal() {
            Self::Bar
        } else {
            Self::Lines
        }
    }

    /// Shows one line where no progress is shown yet.
    pub fn say(self, text: &str) {
        if self != Self::Nothing {
            let _ = writeln!(io::stderr(), "{text}"); // as below
        }
    }
}

/// The progress of one piece of work; a bar vanishes when this is dropped before [`Progress::finish`].
pub struct Progress {
    shown: Shown,
}

enum Shown {
    Bar(ProgressBar),
    Lines(Lines<io::Stderr>),
    Nothing,
}

impl Progress {
    /// Starts to show `name`, with `total` parts to do.
    pub fn new(show: Show, name: &str, total: u64) -> Self {
        let shown = match show {
            Show::Bar => Shown::Bar(bar(name, total)),
            Show::Lines => Shown::Lines(Lines::new(io::stderr(), name, total)),
            Show::Nothing => Shown::Nothing,
        };
        Self { shown }
    }

    /// `done` parts are done; `note` is shown next to them, such as "27.3 dB". Cheap enough for every step.
    pub fn set(&mut self, done: u64, note: &str) {
        match &mut self.shown {
            Shown::Bar(bar) => {
                if bar.message() != note {
                    bar.set_message(note.to_owned());
                }
                bar.set_position(done);
            }
            Shown::Lines(lines) => lines.set(Instant::now(), done, note),
            Shown::Nothing => {}
        }
    }

    /// Shows a line that stays, above the bar.
    pub fn say(&mut self, text: &str) {
        match &mut self.shown {
            Shown::Bar(bar) => bar.println(text),
            Shown::Lines(lines) => lines.print(text),
            Shown::Nothing => {}
        }
    }

    /// Ends with a last note that stays.
    pub fn finish(self, note: &str) {
        match self.shown {
            Shown::Bar(bar) => bar.finish_with_message(note.to_owned()),
            Shown::Lines(mut lines) => lines.finish(Instant::now(), note),
            Shown::Nothing => {}
        }
    }
}

fn bar(name: &str, total: u64) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(REDRAWS));
    let template =
        "{prefix:>10.bold} {bar:32.cyan/black.bright} {percent:>3} % {pos}/{len}  {eta} left  {msg}";
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.progress_chars("━╸─"));
    }
    bar.set_prefix(name.to_owned());
    bar
}

/// Progress as plain lines.
struct Lines<W> {
    out: W,
    name: String,
    total: u64,
    start: Instant,
    last: Instant,
}

impl<W: Write> Lines<W> {
    fn new(out: W, name: &str, total: u64) -> Self {
        let now = Instant::now();
        Self { out, name: name.to_owned(), total, start: now, last: now }
    }

    fn set(&mut self, now: Instant, done: u64, note: &str) {
        if now.duration_since(self.last) < LINE_EVERY {
            return;
        }
        self.last = now;
        let percent = 100.0 * done as f64 / self.total.max(1) as f64;
        let left = match time_left(now.duration_since(self.start), done, self.total) {
            Some(left) => format!("{} left", clock(left)),
            None => "time left unknown".to_owned(),
        };
        self.print(&format!("{} {percent:.0} % {done}/{}  {left}  {note}", self.name, self.total));
    }

    fn finish(&mut self, now: Instant, note: &str) {
        let taken = clock(now.duration_since(self.start));
        self.print(&format!("{} done in {taken}  {note}", self.name));
    }

    fn print(&mut self, text: &str) {
        let _ = writeln!(self.out, "{}", text.trim_end()); // progress that nobody can read is no reason to stop
    }
}

/// At the mean pace so far; `None` before anything is done.
fn time_left(passed: Duration, done: u64, total: u64) -> Option<Duration> {
    let seconds = passed.as_secs_f64() * total.saturating_sub(done) as f64 / done as f64;
    Duration::try_from_secs_f64(seconds).ok()
}

/// "0:07", "12:30" or "1:02:03".
fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_lines_come_every_ten_seconds() {
        let mut lines = Lines::new(Vec::new(), "train", 300);
        let start = lines.start;
        for second in 0..=30 {
            lines.set(start + Duration::from_secs(second), second * 5, "27.3 dB");
        }
        lines.finish(start + Duration::from_secs(65), "28.0 dB");
        let text = String::from_utf8(lines.out).unwrap();
        let expected = "train 17 % 50/300  0:50 left  27.3 dB\n\
                        train 33 % 100/300  0:40 left  27.3 dB\n\
                        train 50 % 150/300  0:30 left  27.3 dB\n\
                        train done in 1:05  28.0 dB\n";
        assert_eq!(text, expected);
    }

    #[test]
    fn time_left_is_unknown_before_the_first_step() {
        let minute = Duration::from_secs(60);
        assert_eq!(time_left(minute, 0, 10), None);
        assert_eq!(time_left(minute, 20, 10), Some(Duration::ZERO));
        assert_eq!(time_left(Duration::ZERO, 0, 0), None);
    }

    #[test]
    fn clock_shows_hours_when_there_are_some() {
        let shown = |s| clock(Duration::from_secs(s));
        assert_eq!((shown(7), shown(750), shown(3723)), ("0:07".into(), "12:30".into(), "1:02:03".into()));
    }

    #[test]
    fn quiet_shows_nothing() {
        assert_eq!(Show::suited(true), Show::Nothing);
    }

    #[test]
    fn bar_template_is_valid() {
        let bar = bar("train", 10);
        bar.set_draw_target(ProgressDrawTarget::hidden());
        let mut progress = Progress { shown: Shown::Bar(bar) };
        progress.set(3, "x");
        progress.say("a line");
        progress.finish("done");
    }
}

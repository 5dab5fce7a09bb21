//! Progress as plain lines, for logs.

use super::subtask::Subtask;
use crate::worker::is_shown_elsewhere;
use std::io::Write;
use std::time::{Duration, Instant};

/// Time between two plain lines.
const LINE_EVERY: Duration = Duration::from_secs(10);
/// The same where a page shows them.
const LINE_EVERY_ON_PAGES: Duration = Duration::from_secs(1);

/// Lines about one piece of work and its subtasks.
pub struct Lines<W> {
    out: W,
    work: Work,
    /// The subtask that is shown in place of the work.
    subtask: Option<Work>,
    /// Names of the subtasks whose start was announced; a subtask that comes back is not announced again.
    announced: Vec<String>,
    start: Instant,
    last: Instant,
    /// Time between two lines.
    every: Duration,
}

/// A piece of work as it stands.
struct Work {
    name: String,
    done: u64,
    total: Option<u64>,
    /// How long it takes where that is certain.
    time: Option<Duration>,
    /// Since when it is shown.
    since: Instant,
    /// What was done when it was first shown; the pace is measured from there.
    from: Option<u64>,
}

impl<W: Write> Lines<W> {
    pub fn new(out: W, name: &str, total: u64, time: Option<Duration>) -> Self {
        let now = Instant::now();
        let work = Work { time, ..Work::new(name, Some(total), now) };
        let every = if is_shown_elsewhere() { LINE_EVERY_ON_PAGES } else { LINE_EVERY };
        let mut lines =
            Self { out, work, subtask: None, announced: Vec::new(), start: now, last: now, every };
        lines.print(&format!("{name} started"));
        lines
    }

    pub fn set(&mut self, now: Instant, done: u64, note: &str) {
        if self.leave_subtask(now) {
            (self.work.since, self.work.from) = (now, None);
        }
        self.work.advance(done);
        self.print_when_due(now, note);
    }

    pub fn subtask(&mut self, now: Instant, task: &Subtask<'_>, note: &str) {
        if self.subtask.as_ref().is_none_or(|s| s.name != task.name) {
            self.leave_subtask(now);
            self.subtask = Some(Work::new(task.name, task.total, now));
            if !self.announced.iter().any(|name| name == task.name) {
                self.announced.push(task.name.to_owned());
                self.last = now;
                self.print(&format!("{} started  {note}", task.name));
            }
        }
        if let Some(subtask) = &mut self.subtask {
            subtask.total = task.total;
            subtask.advance(task.done);
        }
        self.print_when_due(now, note);
    }

    pub fn finish(&mut self, now: Instant, note: &str) {
        let taken = clock(now.duration_since(self.start));
        self.print(&format!("{} done in {taken}  {note}", self.work.name));
    }

    pub fn abandon(&mut self, now: Instant, note: &str) {
        let taken = clock(now.duration_since(self.start));
        let place = match &self.subtask {
            Some(subtask) => format!("{} {}", subtask.name, subtask.count()),
            None => self.work.count(),
        };
        self.print(&format!("{} stopped at {place} after {taken}  {note}", self.work.name));
    }

    pub fn print(&mut self, text: &str) {
        let _ = writeln!(self.out, "{}", text.trim_end()); // progress that nobody can read is no reason to stop
    }

    fn print_when_due(&mut self, now: Instant, note: &str) {
        if now.duration_since(self.last) >= self.every {
            self.last = now;
            let state = self.subtask.as_ref().unwrap_or(&self.work).state(now);
            self.print(&format!("{state}  {note}"));
        }
    }

    /// True when there was a subtask; says how long it took if that was long.
    fn leave_subtask(&mut self, now: Instant) -> bool {
        let Some(subtask) = self.subtask.take() else { return false };
        let taken = now.duration_since(subtask.since);
        if taken >= LINE_EVERY {
            self.print(&format!("{} took {}", subtask.name, clock(taken)));
        }
        true
    }
}

impl Work {
    fn new(name: &str, total: Option<u64>, now: Instant) -> Self {
        Self { name: name.to_owned(), done: 0, total, time: None, since: now, from: None }
    }

    fn advance(&mut self, done: u64) {
        self.from.get_or_insert(done);
        self.done = done;
    }

    fn count(&self) -> String {
        self.total.map_or_else(|| self.done.to_string(), |total| format!("{}/{total}", self.done))
    }

    fn state(&self, now: Instant) -> String {
        let passed = now.duration_since(self.since);
        let Some(total) = self.total else {
            return format!("{} {} done in {}", self.name, self.done, clock(passed));
        };
        let percent = 100.0 * self.done as f64 / total.max(1) as f64;
        let rest = total.saturating_sub(self.done);
        let left = match self.time {
            Some(time) => Some(time_of(time, rest, total)),
            None => time_left(passed, self.done.saturating_sub(self.from.unwrap_or(0)), rest),
        };
        let left = match left {
            Some(left) => format!("{} left", clock(left)),
            None => "time left unknown".to_owned(),
        };
        format!("{} {percent:.0} % {}  {left}", self.name, self.count())
    }
}

/// What so many parts of work that takes this time take of it.
pub(super) fn time_of(time: Duration, parts: u64, total: u64) -> Duration {
    time.mul_f64(parts as f64 / total.max(1) as f64)
}

/// Time for `left` parts at the mean pace of `done` parts; `None` before anything is done.
fn time_left(passed: Duration, done: u64, left: u64) -> Option<Duration> {
    Duration::try_from_secs_f64(passed.as_secs_f64() * left as f64 / done as f64).ok()
}

/// "0:07", "12:30" or "1:02:03".
pub(crate) fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    let (hours, minutes, seconds) = (seconds / 3600, seconds / 60 % 60, seconds % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(total: u64) -> (Lines<Vec<u8>>, impl Fn(u64) -> Instant) {
        let lines = Lines::new(Vec::new(), "training", total, None);
        let start = lines.start;
        (lines, move |second| start + Duration::from_secs(second))
    }

    fn text(lines: Lines<Vec<u8>>) -> String {
        String::from_utf8(lines.out).unwrap()
    }

    const SEARCH: Subtask<'_> = Subtask { name: "index search", done: 0, total: Some(63) };

    #[test]
    fn plain_lines_come_every_ten_seconds() {
        let (mut lines, at) = lines(300);
        for second in 0..=30 {
            lines.set(at(second), second * 5, "27.3 dB");
        }
        lines.finish(at(65), "28.0 dB");
        let expected = "training started\n\
                        training 17 % 50/300  0:50 left  27.3 dB\n\
                        training 33 % 100/300  0:40 left  27.3 dB\n\
                        training 50 % 150/300  0:30 left  27.3 dB\n\
                        training done in 1:05  28.0 dB\n";
        assert_eq!(text(lines), expected);
    }

    #[test]
    fn work_that_is_resumed_has_the_pace_of_what_was_done_now() {
        let (mut lines, at) = lines(300);
        lines.set(at(0), 200, "");
        lines.set(at(10), 250, "");
        assert_eq!(text(lines), "training started\ntraining 83 % 250/300  0:10 left\n");
    }

    #[test]
    fn abandoned_work_says_where_it_stopped() {
        let (mut first, at) = lines(300);
        first.abandon(at(1), "");
        assert_eq!(text(first), "training started\ntraining stopped at 0/300 after 0:01\n");
        let (mut second, at) = lines(300);
        second.subtask(at(1), &Subtask { done: 12, ..SEARCH }, "");
        second.abandon(at(5), "");
        assert!(text(second).ends_with("training stopped at index search 12/63 after 0:05\n"));
    }

    #[test]
    fn a_subtask_is_named_when_it_starts_and_the_work_goes_on_at_its_own_pace() {
        let (mut lines, at) = lines(300);
        lines.set(at(0), 0, "");
        for second in 1..=21 {
            lines.subtask(at(second), &Subtask { done: second, ..SEARCH }, "n 1.33");
        }
        lines.set(at(22), 100, "");
        lines.set(at(32), 150, "");
        let expected = "training started\n\
                        index search started  n 1.33\n\
                        index search 17 % 11/63  0:52 left  n 1.33\n\
                        index search 33 % 21/63  0:42 left  n 1.33\n\
                        index search took 0:21\n\
                        training 50 % 150/300  0:30 left\n";
        assert_eq!(text(lines), expected);
    }

    #[test]
    fn work_of_a_known_time_has_what_is_left_of_it_whatever_its_pace() {
        let mut lines = Lines::new(Vec::new(), "training", 1000, Some(Duration::from_secs(240)));
        let start = lines.start;
        let at = |second| start + Duration::from_secs(second);
        lines.set(at(20), 84, "");
        lines.subtask(at(21), &SEARCH, "");
        lines.set(at(21), 84, "");
        lines.set(at(82), 343, "");
        let expected = "training started\n\
                        training 8 % 84/1000  3:39 left\n\
                        index search started\n\
                        training 34 % 343/1000  2:37 left\n";
        assert_eq!(text(lines), expected);
    }

    #[test]
    fn work_without_a_known_end_shows_its_count_and_its_time() {
        let (mut lines, at) = lines(300);
        lines.subtask(at(0), &Subtask { name: "hull", done: 0, total: None }, "");
        lines.subtask(at(12), &Subtask { name: "hull", done: 7, total: None }, "");
        assert_eq!(text(lines), "training started\nhull started\nhull 7 done in 0:12\n");
    }

    #[test]
    fn subtasks_that_come_again_and_again_fill_no_log() {
        let (mut lines, at) = lines(300);
        for second in 0..9 {
            lines.set(at(second), second, "");
            lines.subtask(at(second), &SEARCH, "");
        }
        assert_eq!(text(lines), "training started\nindex search started\n");
    }

    #[test]
    fn time_left_is_unknown_before_the_first_step() {
        let minute = Duration::from_secs(60);
        assert_eq!(time_left(minute, 0, 10), None);
        assert_eq!(time_left(minute, 20, 0), Some(Duration::ZERO));
        assert_eq!(time_left(Duration::ZERO, 0, 0), None);
    }

    #[test]
    fn clock_shows_hours_when_there_are_some() {
        let shown = |s| clock(Duration::from_secs(s));
        assert_eq!((shown(7), shown(750), shown(3723)), ("0:07".into(), "12:30".into(), "1:02:03".into()));
    }
}

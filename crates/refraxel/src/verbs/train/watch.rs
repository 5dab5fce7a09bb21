//! The progress of a training on standard error, from its events.

use crate::progress::{Progress, Show, Subtask};
use crate::sentences::{phase_name, sentence, task_name};
use refraxel_train::events::{Event, Record, Task};
use std::io::{self, Write};
use std::time::Duration;

/// Thousandths of a time budget.
const THOUSAND: u64 = 1000;
/// Longer runs are shown as if they took so long [s]: some thirty years.
const MOST_SECONDS: f64 = 1e9;

/// Shows what a session tells.
pub struct ProgressDisplay {
    show: Show,
    /// The photographs, then the training.
    progress: Option<Progress>,
    /// Steps in all; `None` where the time counts.
    steps: Option<u64>,
    done: u64,
    note: String,
}

impl ProgressDisplay {
    pub fn new(show: Show) -> Self {
        Self { show, progress: None, steps: None, done: 0, note: String::new() }
    }

    /// Photographs are decoded.
    pub fn load(&mut self, event: &Event) {
        let Event::Progress { task: Task::LoadingPhotos, done, total } = *event else { return };
        let new = || Progress::new(self.show, "images", total);
        self.progress.get_or_insert_with(new).set(done, "");
    }

    /// Training begins, of so many steps if they count.
    pub fn start(&mut self, steps: Option<u64>) {
        self.steps = steps;
        self.progress = Some(Progress::new(self.show, "training", steps.unwrap_or(THOUSAND)));
    }

    /// Training begins that ends after so many minutes.
    pub fn start_clock(&mut self, minutes: f64) {
        let time = Duration::from_secs_f64((60.0 * minutes).min(MOST_SECONDS));
        self.steps = None;
        self.progress = Some(Progress::timed(self.show, "training", THOUSAND, time));
    }

    /// The run stands at this share of its length.
    pub fn stands(&mut self, share: f64) {
        self.done = (share * self.steps.unwrap_or(THOUSAND) as f64).round() as u64;
        self.set();
    }

    fn set(&mut self) {
        if let Some(progress) = &mut self.progress {
            progress.set(self.done, &self.note);
        }
    }

    /// Something happened.
    pub fn tell(&mut self, event: &Event) {
        match event {
            Event::Record(record) => {
                self.note = note(record);
                self.stands(record.progress);
            }
            Event::Progress { task: Task::Training, done, total } => {
                self.stands(*done as f64 / *total as f64);
            }
            Event::Progress { task, done, total } => {
                let task = Subtask { name: task_name(*task), done: *done, total: Some(*total) };
                if let Some(progress) = &mut self.progress {
                    progress.subtask(&task, "");
                }
            }
            other => {
                if let (Some(progress), Some(text)) = (&mut self.progress, sentence(other)) {
                    progress.say(&text);
                }
            }
        }
    }

    /// Something is wrong that the run can do without; told even where no progress is shown.
    pub fn warn(&mut self, text: &str) {
        let text = format!("warning: {text}");
        match &mut self.progress {
            Some(progress) if self.show != Show::Nothing => progress.say(&text),
            _ => drop(writeln!(io::stderr(), "{text}")), // nowhere else to complain
        }
    }

    /// Training ends, at its end or before.
    pub fn end(self, finished: bool) {
        let Some(progress) = self.progress else { return };
        if finished { progress.finish(&self.note) } else { progress.abandon(&self.note) }
    }
}

fn note(r: &Record) -> String {
    let index: Vec<String> = r.index.iter().take(3).map(|n| format!("{n:.3}")).collect();
    let index = if index.is_empty() { String::new() } else { format!("  n {}", index.join(" ")) };
    let (phase, size, psnr, speed) = (phase_name(r.phase), r.resolution, r.train_psnr, r.krays_per_s);
    let overflows =
        if r.overflows > 0 { format!("  {} gradients overflowed", r.overflows) } else { String::new() };
    format!("{phase}  {size}³  {psnr:.2} dB{index}  {speed:.0} krays/s{overflows}")
}

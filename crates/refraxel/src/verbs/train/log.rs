//! The training log: RUN/log.jsonl, one record a line, and its picture RUN/curves.png.
//!
//! A run is worth more than its log. Lines that cannot be written are kept and tried again.

use crate::plot::{Plot, Series};
use crate::verbs::files::read_text;
use refraxel_data::atomic::{WriteError, write_atomic};
use refraxel_train::events::{Event, Record};
use serde::Deserialize;
use std::fs::OpenOptions;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The part of a record that says which step it belongs to, also in logs of earlier versions.
#[derive(Deserialize)]
struct Numbered {
    step: u64,
}

/// The training log.
pub struct Log {
    path: PathBuf,
    lines: String,
    /// The file holds all lines.
    is_whole: bool,
}

impl Log {
    /// Keeps the records up to `step`: those after it belong to steps that were lost and are done again. [`Log::complete`]
    /// writes them.
    pub fn open(out: &Path, step: u64) -> Self {
        let path = out.join("log.jsonl");
        let text = if step > 0 { read_text(&path).unwrap_or_default() } else { String::new() };
        let done = |line: &&str| serde_json::from_str(line).is_ok_and(|r: Numbered| r.step <= step);
        let lines = text.lines().filter(done).map(|line| format!("{line}\n")).collect();
        Self { path, lines, is_whole: false }
    }

    /// Appends a record; other events stand in the next one.
    pub fn note(&mut self, event: &Event) {
        if let Event::Record(record) = event {
            let line = serde_json::to_string(record).unwrap_or_default() + "\n";
            self.lines.push_str(&line);
            self.is_whole = self.is_whole && self.append(&line).is_ok();
        }
    }

    fn append(&self, line: &str) -> io::Result<()> {
        OpenOptions::new().append(true).open(&self.path)?.write_all(line.as_bytes())
    }

    /// Writes the whole file where lines are missing or cut off.
    pub fn complete(&mut self) -> Result<(), WriteError> {
        if !self.is_whole {
            write_atomic(&self.path, |f| f.write_all(self.lines.as_bytes()))?;
            self.is_whole = true;
        }
        Ok(())
    }

    /// Draws the curves of all records.
    pub fn draw(&self, out: &Path) -> Result<(), WriteError> {
        let records: Vec<Record> = self.lines.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let series = |name: &str, y: &dyn Fn(&Record) -> Option<f64>| Series {
            name: name.to_owned(),
            points: records
                .iter()
                .filter_map(|r| Some((r.seconds / 60.0, y(r)?)))
                .filter(|(_, v)| v.is_finite())
                .collect(),
        };
        // Without a validation view there is no such curve, and the legend names none.
        let all =
            [series("training rays", &|r| Some(r.train_psnr)), series("validation view", &|r| r.val_psnr)];
        let plot = Plot {
            title: "Training".to_owned(),
            x_label: "minutes".to_owned(),
            y_label: "PSNR [dB]".to_owned(),
            series: all.into_iter().filter(|s| !s.points.is_empty()).collect(),
            named: Vec::new(),
        };
        plot.draw(960, 540).save_png(&out.join("curves.png"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(step: u64) -> Event {
        let text = format!(
            r#"{{"step": {step}, "progress": 0.5, "seconds": 1.0, "train_psnr": 20.0, "resolution": 8, "voxels": 64,
                "samples_per_ray": 2.0, "krays_per_s": 3.0}}"#
        );
        Event::Record(serde_json::from_str(&text).unwrap())
    }

    fn steps(path: &Path) -> Vec<u64> {
        let text = std::fs::read_to_string(path).unwrap();
        text.lines().map(|line| serde_json::from_str::<Numbered>(line).unwrap().step).collect()
    }

    #[test]
    fn lines_that_could_not_be_written_are_there_once_they_can() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        std::fs::create_dir(&path).unwrap();
        let mut log = Log::open(folder.path(), 0);
        assert!(log.complete().unwrap_err().to_string().contains("log.jsonl"));
        log.note(&record(25));
        std::fs::remove_dir(&path).unwrap();
        log.complete().unwrap();
        log.note(&record(50));
        assert_eq!(steps(&path), [25, 50]);
        std::fs::remove_file(&path).unwrap(); // the disk was taken away
        log.note(&record(75));
        log.complete().unwrap();
        assert_eq!(steps(&path), [25, 50, 75]);
    }

    #[test]
    fn a_resumed_log_forgets_steps_that_are_done_again_and_a_line_that_was_cut_off() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.jsonl");
        std::fs::write(&path, "{\"step\": 25}\n{\"step\": 50}\n{\"step\": 7").unwrap();
        let mut log = Log::open(folder.path(), 40);
        log.complete().unwrap();
        log.note(&record(50));
        assert_eq!(steps(&path), [25, 50]);
    }
}

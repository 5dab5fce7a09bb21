//! The training log: RUN/log.jsonl, one record a line, and its picture RUN/curves.png.

use crate::exit::{Exit, Failure, OrExit};
use crate::plot::{Plot, Series};
use anyhow::Context;
use refraxel_train::checkpoint::write_atomic;
use refraxel_train::events::{Event, Record};
use serde::Deserialize;
use std::io::Write;
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
    /// The first line that could not be written.
    failed: Option<Failure>,
}

impl Log {
    /// Keeps the records up to `step`: those after it belong to steps that were lost and are done again.
    pub fn open(out: &Path, step: u64) -> Result<Self, Failure> {
        let path = out.join("log.jsonl");
        let text = if step > 0 { std::fs::read_to_string(&path).unwrap_or_default() } else { String::new() };
        let done = |line: &&str| serde_json::from_str(line).is_ok_and(|r: Numbered| r.step <= step);
        let lines = text.lines().filter(done).map(|line| format!("{line}\n")).collect();
        let log = Self { path, lines, failed: None };
        write_atomic(&log.path, |f| f.write_all(log.lines.as_bytes()))?;
        Ok(log)
    }

    /// Appends a record; other events stand in the next one.
    pub fn note(&mut self, event: &Event) {
        if let Event::Record(record) = event {
            let written = self.write(record);
            self.failed = self.failed.take().or(written.err());
        }
    }

    /// An error if a line could not be written.
    pub fn check(&mut self) -> Result<(), Failure> {
        self.failed.take().map_or(Ok(()), Err)
    }

    fn write(&mut self, record: &Record) -> Result<(), Failure> {
        let line = serde_json::to_string(record).or_exit(Exit::Io)? + "\n";
        self.lines.push_str(&line);
        std::fs::OpenOptions::new()
            .append(true)
            .open(&self.path)
            .and_then(|mut f| f.write_all(line.as_bytes()))
            .with_context(|| format!("cannot write to {}", self.path.display()))
            .or_exit(Exit::Io)
    }

    /// Draws the curves of all records.
    pub fn draw(&self, out: &Path) -> Result<(), Failure> {
        let records: Vec<Record> = self.lines.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let series = |name: &str, y: &dyn Fn(&Record) -> Option<f64>| Series {
            name: name.to_owned(),
            points: records
                .iter()
                .filter_map(|r| Some((r.seconds / 60.0, y(r)?)))
                .filter(|(_, v)| v.is_finite())
                .collect(),
        };
        let plot = Plot {
            title: "Training".to_owned(),
            x_label: "minutes".to_owned(),
            y_label: "PSNR [dB]".to_owned(),
            series: vec![
                series("training rays", &|r| Some(r.train_psnr)),
                series("validation view", &|r| r.val_psnr),
            ],
        };
        let path = out.join("curves.png");
        Ok(plot.draw(960, 540).save_png(&path)?)
    }
}

//! The scores of a sweep: a table in CSV and a page with pictures.

use super::job::Job;
use crate::exit::Failure;
use crate::table::{Table, score};
use crate::verbs::evaluation::Evaluation;
use crate::verbs::files::{create_folder, write_text};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The table in the folder of a sweep.
pub const TABLE: &str = "results.csv";
/// The page there.
pub const PAGE: &str = "index.html";

/// One run and its scores.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Its number, from 0.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// Name of its dataset.
    pub dataset: String,
    /// Options that vary, with their values.
    pub varied: Vec<(String, String)>,
    /// Its folder.
    pub folder: PathBuf,
    /// Whether it is done, and if not whether it failed.
    pub state: State,
    /// [dB]
    pub psnr: Option<f64>,
    /// Structural similarity [1].
    pub ssim: Option<f64>,
    /// Inside the masks [dB].
    pub psnr_inside: Option<f64>,
    /// Outside [dB].
    pub psnr_outside: Option<f64>,
    /// Mean index of what is refractive, where the truth is known.
    pub index: Option<f64>,
    /// Its mean error.
    pub index_error: Option<f64>,
    /// Seconds trained.
    pub seconds: Option<f64>,
}

/// How far a run is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Trained and scored.
    Done,
    /// Not yet.
    Open,
    /// Its training failed.
    Failed,
}

impl State {
    /// Its name in tables.
    fn name(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Open => "open",
            Self::Failed => "failed",
        }
    }
}

impl Row {
    /// The row of a run.
    pub fn of(job: &Job, evaluation: Option<&Evaluation>, state: State) -> Self {
        let scores = evaluation.map(|e| &e.scores);
        let index = evaluation.and_then(|e| e.ior.as_ref());
        Self {
            number: job.number,
            name: job.name.clone(),
            dataset: job.dataset.clone(),
            varied: job.varied.clone(),
            folder: job.folder.clone(),
            state: if evaluation.is_some() { State::Done } else { state },
            psnr: scores.and_then(|s| s.psnr),
            ssim: scores.and_then(|s| s.ssim),
            psnr_inside: scores.and_then(|s| s.psnr_inside),
            psnr_outside: scores.and_then(|s| s.psnr_outside),
            index: index.and_then(|i| i.mean_inside),
            index_error: index.and_then(|i| i.mae_inside),
            seconds: evaluation.map(|e| e.run.seconds),
        }
    }

    fn numbers(&self) -> [(&'static str, Option<f64>, usize); 7] {
        [
            ("psnr", self.psnr, 2),
            ("ssim", self.ssim, 4),
            ("psnr_inside", self.psnr_inside, 2),
            ("psnr_outside", self.psnr_outside, 2),
            ("index", self.index, 3),
            ("index_error", self.index_error, 3),
            ("seconds", self.seconds, 1),
        ]
    }
}

/// The state of all runs, written as table and page. `failed`: numbers of runs whose training failed.
pub fn collect(jobs: &[Job], failed: &[usize], out: &Path) -> Result<Vec<Row>, Failure> {
    let rows = rows(jobs, failed)?;
    create_folder(out)?;
    write(&rows, out)?;
    Ok(rows)
}

pub(super) fn rows(jobs: &[Job], failed: &[usize]) -> Result<Vec<Row>, Failure> {
    let state = |job: &Job| if failed.contains(&job.number) { State::Failed } else { State::Open };
    jobs.iter().map(|job| Ok(Row::of(job, job.done()?.as_ref(), state(job)))).collect()
}

/// For people, on standard output.
pub fn text(rows: &[Row]) -> String {
    let mut table =
        Table::new(&["run", "state", "PSNR", "SSIM", "inside", "outside", "index", "its error", "seconds"]);
    for row in rows {
        let name = format!("{} {}", row.number, row.name);
        let numbers = row.numbers().map(|(_, value, decimals)| score(value, decimals));
        table.row([name, row.state.name().to_owned()].into_iter().chain(numbers).collect());
    }
    table.text()
}

/// Writes results.csv and index.html into the folder of the sweep.
pub fn write(rows: &[Row], out: &Path) -> Result<(), Failure> {
    write_text(&out.join(TABLE), &csv(rows))?;
    write_text(&out.join(PAGE), &page(rows, out))
}

/// One line per run; words are quoted.
fn csv(rows: &[Row]) -> String {
    let Some(first) = rows.first() else { return String::new() };
    let varied = first.varied.iter().map(|(option, _)| option.as_str());
    let numbers = first.numbers().map(|(name, ..)| name);
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let headings: Vec<&str> = ["run", "dataset", "state"].into_iter().chain(varied).chain(numbers).collect();
    let mut text = headings.join(",") + "\n";
    for row in rows {
        let words = [quoted(&row.name), quoted(&row.dataset), row.state.name().to_owned()];
        let values = row.varied.iter().map(|(_, value)| quoted(value));
        let numbers = row.numbers().map(|(_, value, _)| value.map_or(String::new(), |v| v.to_string()));
        let cells: Vec<String> = words.into_iter().chain(values).chain(numbers).collect();
        text += &(cells.join(",") + "\n");
    }
    text
}

/// One table and, for each dataset, the pictures of its runs below each other. It names no file outside the folder.
fn page(rows: &[Row], out: &Path) -> String {
    let mut html = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>sweep</title><style>\
                    body{font-family:sans-serif;margin:2em}table{border-collapse:collapse}\
                    td,th{padding:.2em .8em;text-align:right;border-bottom:1px solid #ccc}\
                    td:first-child,th:first-child{text-align:left}img{max-width:100%}</style>\n<table><tr><th>run</th>"
        .to_owned();
    for (name, ..) in rows.first().map(Row::numbers).iter().flatten() {
        let _ = write!(html, "<th>{}</th>", name.replace('_', " ")); // writing to a String cannot fail
    }
    for row in rows {
        let _ = write!(html, "</tr>\n<tr><td>{} ({})</td>", row.name, row.state.name());
        for (_, value, decimals) in row.numbers() {
            let _ = write!(html, "<td>{}</td>", score(value, decimals));
        }
    }
    html += "</tr></table>\n";
    for row in rows.iter().filter(|row| row.state == State::Done) {
        let folder = row.folder.strip_prefix(out).unwrap_or(&row.folder);
        let parts: Vec<String> = folder.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        let _ = writeln!(
            html,
            "<h2>{}</h2><img loading=\"lazy\" src=\"{}/eval/test.png\" alt=\"\">",
            row.name,
            parts.join("/")
        );
    }
    html + "</html>\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commas_of_names_stay_in_their_cells() {
        let job = Job {
            number: 0,
            name: "a,b/run.seed=1".into(),
            dataset: "a,b".into(),
            data: "/data".into(),
            folder: "out".into(),
            options: Vec::new(),
            varied: vec![("run.seed".into(), "1".into())],
        };
        let text = csv(&[Row::of(&job, None, State::Open)]);
        let (headings, line) = text.trim_end().split_once('\n').unwrap();
        assert!(line.starts_with("\"a,b/run.seed=1\",\"a,b\",open,\"1\","), "{line}");
        assert_eq!(headings.matches(',').count(), line.matches(',').count() - 2, "{text}");
    }
}

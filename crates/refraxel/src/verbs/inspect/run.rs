//! A run: where it stands and how good it was when it was last evaluated.

use super::data::white_means;
use crate::console::Console;
use crate::exit::{Exit, Failure, OrExit};
use crate::sentences::verdict_text;
use crate::table::{bytes, colours, count};
use crate::verbs::evaluation::Evaluation;
use crate::verbs::loaded::load_run;
use crate::verbs::train::evidence::EVIDENCE;
use anyhow::Context;
use refraxel_core::Extent;
use refraxel_data::Part;
use refraxel_train::run::{CHECKPOINT, Read, Source};
use refraxel_train::verdict::Verdict;
use refraxel_train::{Backend, Options};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Serialize)]
struct Report {
    kind: &'static str,
    run: PathBuf,
    step: u64,
    seconds: f64,
    /// Nodes now, and at the end of the schedule.
    resolution: [u32; 3],
    finest_resolution: [u32; 3],
    #[serde(rename = "box")]
    bounds: [[f64; 3]; 2],
    /// Whether the grid reaches to infinity.
    unbounded: bool,
    extent: &'static str,
    voxels: u64,
    file_bytes: u64,
    options: Options,
    /// Those that are not the defaults.
    #[serde(skip)]
    changed: String,
    source: Source,
    /// How strongly the surface of each refractive region mirrors, 1 being Fresnel's law; empty where none does.
    reflection_strengths: Vec<f32>,
    /// What each refractive region absorbs of linear red, green and blue [1 / scene unit]; empty where all are clear.
    absorption: Vec<[f32; 3]>,
    /// By how much the borders of refractive masks were moved outwards [pixel]; absent where they stayed.
    #[serde(skip_serializing_if = "Option::is_none")]
    mask_shift: Option<f32>,
    /// What was decided about refractive regions, where hypotheses raced.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<Verdict>,
    /// The picture that it rests on, where prediction decided.
    #[serde(skip_serializing_if = "Option::is_none")]
    evidence: Option<PathBuf>,
    /// Of the test split, as last evaluated.
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluation: Option<Evaluation>,
}

pub fn inspect(folder: &Path, json: bool) -> Result<(), Failure> {
    let path = folder.join(CHECKPOINT);
    let run = load_run(folder)?;
    let size = std::fs::metadata(&path)
        .with_context(|| format!("cannot read {}", path.display()))
        .or_exit(Exit::Io)?
        .len();
    let snapshot = run.backend.snapshot();
    let field = &snapshot.model.field;
    let bounds = run.plan.origin.to_world(field.domain.bounds.cast::<f64>());
    let report = Report {
        kind: "run",
        run: folder.to_owned(),
        step: run.state.step,
        seconds: run.state.seconds,
        resolution: field.domain.resolution,
        finest_resolution: run.plan.finest.resolution,
        bounds: bounds.to_arrays(),
        unbounded: field.domain.extent.is_unbounded(),
        extent: field.domain.extent.name(),
        voxels: field.map.voxels() as u64,
        file_bytes: size,
        changed: changed_options(&run.options, field.domain.extent),
        options: run.options,
        reflection_strengths: snapshot.model.reflection.mirrors.iter().map(|m| m.strength).collect(),
        absorption: snapshot.model.refraction.absorption(),
        source: run.source,
        mask_shift: Some(run.state.mask_shift).filter(|shift| *shift != 0.0),
        verdict: run.state.verdict,
        evidence: Some(folder.join(EVIDENCE)).filter(|p| p.exists()),
        evaluation: Evaluation::read(folder, Part::Test)?,
    };
    Console::new(json).result(&report.text(), &report).or_exit(Exit::Io)
}

impl Report {
    fn text(&self) -> String {
        let [x, y, z] = self.resolution;
        let of = if self.options.run.minutes > 0.0 {
            String::new()
        } else {
            format!(" of {}", self.options.run.steps)
        };
        let mut lines = vec![
            format!("{}: a run", self.run.display()),
            format!("trained    {} steps{of}, {:.1} minutes", self.step, self.seconds / 60.0),
            format!("data       {}: {} views", self.source.name(), self.source.train.len()),
        ];
        lines.extend(self.source.read.iter().flat_map(decided));
        lines.extend([
            format!(
                "grid       {}, {x}×{y}×{z}, {} voxels; file of {}",
                self.extent,
                count(self.voxels),
                bytes(self.file_bytes)
            ),
            format!("options    {}", self.changed),
        ]);
        if !self.reflection_strengths.is_empty() {
            let strengths: Vec<String> =
                self.reflection_strengths.iter().map(|s| format!("{:.0} %", 100.0 * s)).collect();
            lines.push(format!("mirrors    {} of Fresnel's reflectance", strengths.join(", ")));
        }
        if !self.absorption.is_empty() {
            let bodies: Vec<String> = self.absorption.iter().map(|a| colours(*a)).collect();
            lines.push(format!("absorbs    {}", bodies.join("; ")));
        }
        if let Some(shift) = self.mask_shift {
            let way = if shift > 0.0 { "outwards" } else { "inwards" };
            lines.push(format!("masks      their borders were moved {way} by {:.1} pixels", shift.abs()));
        }
        if let Some(verdict) = &self.verdict {
            lines.extend(verdict_text(verdict).lines().map(|line| format!("verdict    {line}")));
        }
        if let Some(picture) = &self.evidence {
            lines.push(format!("evidence   {}", picture.display()));
        }
        lines.push(match &self.evaluation {
            None => "scores     none yet; run `refraxel eval`".to_owned(),
            Some(e) if e.run.step < self.step => {
                format!("scores     (at step {}) {}", e.run.step, e.text(Part::Test))
            }
            Some(e) => format!("scores     {}", e.text(Part::Test)),
        });
        let findings = self.source.read.iter().flat_map(|read| &read.findings);
        lines.extend(findings.map(|[severity, message]| format!("{severity:<9}  {message}")));
        lines.join("\n")
    }
}

/// What was decided about the data when they were read.
fn decided(read: &Read) -> Vec<String> {
    let masks = read.masks.as_deref().map(|meaning| format!("masks      white: {}", white_means(meaning)));
    let read = [
        format!("read as    {}", read.format),
        format!("split      {}", read.split),
        format!("backdrop   {}", read.backdrop),
    ];
    read.into_iter().chain(masks).collect()
}

/// The options that are not the defaults.
fn changed_options(options: &Options, extent: Extent) -> String {
    // The defaults for surroundings depend on whether the data said that something refracts, which a run does not keep.
    let either = [false, true].map(|is_told| options.differences(&Options::suited_to(extent, is_told)));
    let differences = either.into_iter().min_by_key(Vec::len).unwrap_or_default();
    let changed: Vec<String> = differences.iter().map(|d| format!("{}={}", d.name, d.here)).collect();
    if changed.is_empty() { "the defaults".to_owned() } else { changed.join(" ") }
}

//! What an import made.

use super::calls::Stage;
use super::stage::Done;
use super::work::LOG;
use crate::progress::clock;
use crate::shell::quoted;
use crate::table::count;
use refraxel_data::{Dataset, MaskMeaning, listed, report};
use serde::Serialize;
use std::path::Path;
use std::time::Duration;

/// Names that a sentence lists; it counts the rest.
const NAMED: usize = 6;

/// The result of an import.
#[derive(Serialize)]
pub struct Report {
    pub out: String,
    pub photographs: usize,
    pub posed: usize,
    /// Photographs that COLMAP did not pose, or posed in another model.
    pub not_posed: Vec<String>,
    /// Mean over all points of the mapper's model [pixel].
    pub mean_reprojection_error: Option<f64>,
    pub points: usize,
    /// Photographs in each model that COLMAP made; the first is kept.
    pub models: Vec<usize>,
    pub lenses: Vec<&'static str>,
    /// Smallest and largest [pixel].
    pub focal: [f64; 2],
    pub masks: usize,
    /// What white means in the masks of the dataset.
    pub mask_meaning: Option<&'static str>,
    /// Files in formats that are not read.
    pub left_out: Vec<String>,
    pub warnings: Vec<String>,
    /// Time of each stage [second].
    pub seconds: Vec<StageTime>,
    pub log: String,
    /// The command that trains on it.
    pub next: String,
}

/// How long a stage took.
#[derive(Serialize)]
pub struct StageTime {
    pub stage: &'static str,
    pub seconds: f64,
}

/// What is known when the dataset was opened.
pub struct Made<'a> {
    pub out: &'a Path,
    pub names: Vec<String>,
    pub done: &'a Done,
    pub data: &'a Dataset,
    /// As stored in the dataset.
    pub meaning: Option<MaskMeaning>,
    /// Files in formats that are not read.
    pub left_out: Vec<String>,
}

impl Report {
    pub fn new(made: Made<'_>) -> Self {
        let model = &made.done.models[0];
        let inspection = report(made.data);
        let out = made.out.display().to_string();
        // Masks of glass lie in a folder whose name says so; of others the user has to.
        let keep = if made.meaning == Some(MaskMeaning::Keep) { " --mask-meaning keep" } else { "" };
        let mut not_posed = made.names.clone();
        not_posed.retain(|name| model.images.binary_search(name).is_err());
        let time = |(stage, time): &(Stage, Duration)| StageTime {
            stage: stage.name(),
            seconds: time.as_secs_f64(),
        };
        Self {
            photographs: made.names.len(),
            posed: model.images.len(),
            not_posed,
            mean_reprojection_error: model.mean_error,
            points: model.points,
            models: made.done.models.iter().map(|model| model.images.len()).collect(),
            lenses: inspection.cameras.lenses,
            focal: inspection.cameras.focal,
            masks: inspection.masks.map_or(0, |masks| masks.count),
            mask_meaning: made.meaning.map(MaskMeaning::name),
            left_out: made.left_out,
            warnings: made.done.warnings.clone(),
            seconds: made.done.times.iter().map(time).collect(),
            log: made.out.join(LOG).display().to_string(),
            next: format!("refraxel train {} --out run{keep} --minutes 10", quoted(&out)),
            out,
        }
    }

    pub fn text(&self) -> String {
        let total = Duration::from_secs_f64(self.seconds.iter().map(|stage| stage.seconds).sum());
        let mut lines = vec![format!(
            "{}: {} of {} photographs posed in {}",
            self.out,
            self.posed,
            self.photographs,
            clock(total)
        )];
        if !self.not_posed.is_empty() {
            lines.push(format!("not posed  {}", listed(&self.not_posed, NAMED)));
        }
        if !self.left_out.is_empty() {
            lines.push(format!("left out   {}: a format that is not read", listed(&self.left_out, NAMED)));
        }
        let error =
            self.mean_reprojection_error.map_or("not stated".to_owned(), |e| format!("{e:.2} pixels"));
        lines.push(format!("points     {}, mean reprojection error {error}", count(self.points as u64)));
        let [low, high] = self.focal;
        let focal = if high - low < 0.05 { format!("{low:.1}") } else { format!("{low:.1} to {high:.1}") };
        lines.push(format!("camera     {}; focal length {focal} pixels", self.lenses.join(", ")));
        if let Some(meaning) = self.mask_meaning {
            let white = if meaning == "refractive" { "glass or water" } else { "the pixel is used" };
            lines.push(format!("masks      {} of {}; white: {white}", self.masks, self.posed));
        }
        if self.models.len() > 1 {
            let sizes: Vec<String> = self.models.iter().map(usize::to_string).collect();
            lines.push(format!(
                "models     {} that do not connect, of {} photographs; the largest is kept; photographs from between them \
                 would connect them",
                self.models.len(),
                sizes.join(", ")
            ));
        }
        lines.extend(self.warnings.iter().map(|warning| format!("warning    {warning}")));
        lines.push(format!("log        {}", self.log));
        lines.push(format!("next: {}", self.next));
        lines.join("\n")
    }
}

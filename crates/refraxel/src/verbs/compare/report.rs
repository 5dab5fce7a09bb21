//! The table of a comparison, and the same for programs.

use crate::table::{Table, count, score};
use crate::verbs::evaluation::Rays;
use refraxel_train::evaluation::IndexError;
use serde::Serialize;
use std::path::PathBuf;

/// One run of the comparison.
#[derive(Serialize)]
pub(super) struct Compared {
    pub(super) run: PathBuf,
    pub(super) rays: Option<Rays>,
    pub(super) psnr: Option<f64>,
    pub(super) ssim: Option<f64>,
    pub(super) psnr_inside: Option<f64>,
    pub(super) psnr_outside: Option<f64>,
    pub(super) minutes: f64,
    pub(super) voxels: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) ior: Option<IndexError>,
}

#[derive(Serialize)]
pub(super) struct Report {
    pub(super) images: usize,
    pub(super) protocol: String,
    pub(super) runs: Vec<Compared>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) picture: Option<PathBuf>,
    /// The animated picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) wipe: Option<PathBuf>,
}

impl Report {
    pub(super) fn text(&self) -> String {
        let with_index = self.runs.iter().any(|r| r.ior.is_some());
        let mut headings = vec!["run", "rays", "PSNR", "SSIM", "inside", "outside", "minutes", "voxels"];
        if with_index {
            headings.extend(["index inside", "true index", "index error inside"]);
        }
        let mut table = Table::new(&headings);
        for r in &self.runs {
            let mut cells = vec![
                r.run.display().to_string(),
                r.rays.map_or("–", Rays::name).to_owned(),
                score(r.psnr, 2),
                score(r.ssim, 4),
                score(r.psnr_inside, 2),
                score(r.psnr_outside, 2),
                format!("{:.1}", r.minutes),
                count(r.voxels),
            ];
            if with_index {
                let index = r.ior.unwrap_or_default();
                let of_index = [index.mean_inside, index.true_mean_inside, index.mae_inside];
                cells.extend(of_index.map(|n| score(n, 3)));
            }
            table.row(cells);
        }
        let picture = self.picture.as_ref().map_or(String::new(), |p| format!("\npicture: {}", p.display()));
        let wipe = self.wipe.as_ref().map_or(String::new(), |p| format!("\nwipe: {}", p.display()));
        format!("{}\n{} test images; protocol: {}{picture}{wipe}", table.text(), self.images, self.protocol)
    }
}

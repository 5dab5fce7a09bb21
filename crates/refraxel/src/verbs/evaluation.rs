//! The scores of a run: the document RUN/eval/SPLIT/metrics.json.

use super::files::{read_if_there, write_json};
use crate::exit::{Exit, Failure, OrExit};
use crate::table::decimals;
use anyhow::Context;
use refraxel_data::Part;
use refraxel_train::Refraction;
use refraxel_train::device::Device;
use refraxel_train::evaluation::IndexError;
use refraxel_train::exposures::ExposureShift;
use refraxel_train::metrics::Scores;
use refraxel_train::poses::{LensShift, PoseShift};
use refraxel_train::verdict::Verdict;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The scores of a run, its index errors where the truth is known, and the state of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluation {
    /// Image scores; their fields stand at the top of the document.
    #[serde(flatten)]
    pub scores: Scores,
    /// Errors of the index of refraction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ior: Option<IndexError>,
    /// What was decided about refractive regions, where hypotheses raced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// Where its cameras are, if they learned that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<LearnedShift<PoseShift>>,
    /// How its photographs are exposed, if they learned that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposures: Option<LearnedShift<ExposureShift>>,
    /// The run when it was evaluated.
    pub run: Evaluated,
}

/// How far the poses that a run has learned are from where the data put them, or its exposures from their mean.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LearnedShift<Shift> {
    /// That of the training views.
    #[serde(flatten)]
    pub shift: Shift,
    /// How the poses or exposures of the evaluated views were found.
    pub evaluated: String,
}

/// A run when it was evaluated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evaluated {
    /// The dataset.
    pub data: PathBuf,
    /// Checksum of the truth images: scores compare only where it is the same.
    pub truth_crc32: String,
    /// Steps trained.
    pub step: u64,
    /// Seconds trained.
    pub seconds: f64,
    /// The device that it was trained on last; absent where that was not noted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<Device>,
    /// The device that rendered it; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rendered_by: Option<Device>,
    /// Voxels stored.
    pub voxels: u64,
    /// Nodes of the grid.
    pub resolution: [u32; 3],
    /// The shape of its rays; absent in documents of earlier versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays: Option<Rays>,
    /// The file whose index bent the rays, if not the run's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub index_from: Option<PathBuf>,
}

/// The shape of a run's rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rays {
    /// Straight lines: the run has no index of refraction.
    Straight,
    /// Bent by an index of refraction.
    Bent,
}

impl Rays {
    /// The rays of a run.
    pub fn of(refraction: &Refraction) -> Self {
        if refraction.is_none() { Self::Straight } else { Self::Bent }
    }
    /// Their name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Bent => "bent",
        }
    }
}

/// The folder of a split's renderings in a run.
pub fn folder(run: &Path, split: Part) -> PathBuf {
    run.join("eval").join(split.name())
}

/// The folder of renderings with the index of a file.
pub fn folder_of_index(run: &Path, split: Part) -> PathBuf {
    run.join("eval").join(format!("{}-index", split.name()))
}

impl Evaluation {
    /// Writes the document into the folder of its renderings.
    pub fn write(&self, folder: &Path) -> Result<(), Failure> {
        write_json(&folder.join("metrics.json"), self)
    }

    /// Reads it back; `None` when the split was not evaluated.
    pub fn read(run: &Path, split: Part) -> Result<Option<Self>, Failure> {
        let path = folder(run, split).join("metrics.json");
        let Some(text) = read_if_there(&path)? else { return Ok(None) };
        let again = || {
            let (path, run) = (path.display(), run.display());
            format!("{path} is not a document of this version; run `refraxel eval {run}` again")
        };
        serde_json::from_str(&text).map(Some).with_context(again).or_exit(Exit::BadInput)
    }

    /// Reads the scores of the test split; an error when there are none.
    pub fn of_test(run: &Path) -> Result<Self, Failure> {
        Self::read(run, Part::Test)?.ok_or_else(|| {
            let path = folder(run, Part::Test).join("metrics.json");
            let what = if run.is_dir() { "has not been evaluated" } else { "is not the folder of a run" };
            let (run, path) = (run.display(), path.display());
            Exit::BadInput
                .because(format!("{run} {what}: there is no {path}; run `refraxel eval {run}` first"))
        })
    }

    /// The scores in one line, and the index errors in another.
    pub fn text(&self, split: Part) -> String {
        let (s, db) = (&self.scores, |name: &str, v: Option<f64>| v.map(|v| format!("{name} {v:.2} dB")));
        let psnr = s.psnr.map_or("PSNR infinite".to_owned(), |v| format!("PSNR {v:.2} dB"));
        let parts = [
            Some(psnr),
            s.ssim.map(|v| format!("SSIM {v:.4}")),
            db("inside masks", s.psnr_inside),
            db("outside", s.psnr_outside),
        ];
        let scores: Vec<String> = parts.into_iter().flatten().collect();
        let mut text = format!("{} {} images: {}", s.images, split.name(), scores.join("  "));
        if let Some(LearnedShift { shift, evaluated }) = &self.poses {
            text += &format!(
                "\nposes: cameras turned by up to {:.2} degrees (median {:.2}) and moved by up to {:.d$} (median {:.d$}); \
                 those of these images {evaluated}",
                shift.largest_turn,
                shift.median_turn,
                shift.largest_way,
                shift.median_way,
                d = decimals(shift.largest_way, 4)
            );
            if let Some(LensShift { focal, radial }) = shift.lens {
                text +=
                    &format!("\nlens: focal length \u{d7}{focal:.4}, first radial coefficient {radial:+.4}");
            }
        }
        if let Some(LearnedShift { shift, evaluated }) = &self.exposures {
            text += &format!(
                "\nexposures: up to {:.2} stops from their mean (median {:.2}); those of these images {evaluated}",
                shift.largest, shift.median
            );
        }
        if let Some(index) = &self.ior {
            text += &format!("\n{}", index_text(index));
        }
        text
    }
}

fn index_text(index: &IndexError) -> String {
    let mean = |name: &str, v: Option<f64>| v.map(|v| format!("{name} {v:.3}"));
    let parts = [
        mean("mean inside", index.mean_inside),
        mean("truth", index.true_mean_inside),
        mean("mean error inside", index.mae_inside),
        mean("at the boundary", index.mae_boundary),
        mean("outside", index.mae_outside),
    ];
    format!("index of refraction: {}", parts.into_iter().flatten().collect::<Vec<_>>().join("  "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn evaluation() -> Evaluation {
        let score = refraxel_train::metrics::ImageScore {
            name: "r_0.png".into(),
            psnr: f64::INFINITY,
            ssim: Some(1.0),
            psnr_inside: Some(20.5),
            psnr_outside: None,
        };
        let run = Evaluated {
            data: "x".into(),
            truth_crc32: "00000000".into(),
            step: 5,
            seconds: 1.5,
            device: Some(Device::cpu()),
            rendered_by: Some(Device::cpu()),
            voxels: 64,
            resolution: [4; 3],
            rays: Some(Rays::Bent),
            index_from: None,
        };
        let ior = IndexError { mean_inside: Some(1.0), mae_inside: Some(0.5), ..Default::default() };
        Evaluation {
            scores: Scores::new(vec![score]),
            ior: Some(ior),
            verdict: None,
            poses: None,
            exposures: None,
            run,
        }
    }

    #[test]
    fn document_round_trips_with_the_scores_at_its_top() {
        let folder = tempfile::tempdir().unwrap();
        let scores = super::folder(folder.path(), Part::Test);
        std::fs::create_dir_all(&scores).unwrap();
        evaluation().write(&scores).unwrap();
        assert_eq!(Evaluation::of_test(folder.path()).unwrap(), evaluation());
        let text = std::fs::read_to_string(folder.path().join("eval/test/metrics.json")).unwrap();
        let value: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!((&value["psnr_inside"], &value["ior"]["mae_inside"]), (&20.5.into(), &0.5.into()));
    }

    #[test]
    fn text_leaves_out_what_is_not_known() {
        let expected = "1 test images: PSNR infinite  SSIM 1.0000  inside masks 20.50 dB\n\
                        index of refraction: mean inside 1.000  mean error inside 0.500";
        assert_eq!(evaluation().text(Part::Test), expected);
    }

    #[test]
    fn a_run_without_scores_is_named() {
        let failure = Evaluation::of_test(Path::new("/no/such/run")).unwrap_err();
        assert_eq!(failure.exit, Exit::BadInput);
        assert!(failure.report().contains("/no/such/run is not the folder of a run"), "{}", failure.report());
    }
}

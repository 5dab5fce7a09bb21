//! What a run is asked to write.

use crate::synth::dataset::Cost;
use crate::synth::error::SynthError;
use serde_json::Value;
use std::path::PathBuf;

/// What a run writes: one file after the other, each by a job of its own.
pub(super) trait Plan: Sync {
    /// One picture and what lies beside it.
    type Job: Copy + Sync;

    /// Everything that the bytes depend on.
    fn parameters(&self) -> Value;

    fn jobs(&self) -> Vec<Self::Job>;

    /// Folders that pictures go to.
    fn folders(&self) -> Vec<String>;

    /// The picture of a job.
    fn picture(&self, job: &Self::Job) -> PathBuf;

    /// Renders a job and writes its files; the picture itself comes last and marks the job as done.
    fn render_one(&self, job: &Self::Job) -> Result<Cost, SynthError>;

    /// Everything but the pictures; `transforms_*.json` last, so that only whole datasets have them.
    fn write_truth(&self) -> Result<(), SynthError>;
}

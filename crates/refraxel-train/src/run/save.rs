//! From a run to its checkpoint.

use super::contents::RunRef;
use super::header::Header;
use super::{clearcoat, detected, field, reflection, refraction, views};
use crate::checkpoint::{self, CheckpointError, Tensor};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Name of the checkpoint in the folder of a run.
pub const CHECKPOINT: &str = "checkpoint.safetensors";

impl RunRef<'_> {
    /// Save the run in a folder, atomically: an earlier checkpoint there is whole until the new one is.
    pub fn save(&self, folder: &Path) -> Result<(), CheckpointError> {
        let path = folder.join(CHECKPOINT);
        self.with_tensors(&path, |header, tensors| checkpoint::save(&path, header, tensors))
    }

    /// Write the same bytes anywhere.
    pub fn write(&self, to: &mut dyn Write) -> Result<(), CheckpointError> {
        let path = PathBuf::from("(a stream)");
        self.with_tensors(&path, |header, tensors| checkpoint::write(to, header, tensors))
    }

    fn with_tensors(
        &self,
        path: &Path,
        write: impl FnOnce(&serde_json::Value, &[(&str, &Tensor)]) -> Result<(), CheckpointError>,
    ) -> Result<(), CheckpointError> {
        let header = serde_json::to_value(Header::of(self));
        let header =
            header.map_err(|e| CheckpointError::Foreign { path: path.to_owned(), found: e.to_string() })?;
        let (model, optimiser) = (self.model, self.optimiser);
        let tensors = [
            field::tensors(self),
            refraction::tensors(model, optimiser),
            reflection::tensors(model, optimiser),
            clearcoat::tensors(model, optimiser),
            detected::tensors(self.detected),
            views::tensors(self.alignment),
        ];
        let named: Vec<_> = tensors.iter().flatten().map(|(name, tensor)| (name.as_str(), tensor)).collect();
        write(&header, &named)
    }
}

//! From a run to its checkpoint.

use super::contents::RunRef;
use super::field::Shapes;
use super::header::Header;
use super::{clearcoat, detected, reflection, refraction, views};
use crate::checkpoint::{self, CheckpointError};
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
        write: impl FnOnce(&serde_json::Value, &[(&str, checkpoint::TensorView)]) -> Result<(), CheckpointError>,
    ) -> Result<(), CheckpointError> {
        let header = serde_json::to_value(Header::of(self));
        let header =
            header.map_err(|e| CheckpointError::Foreign { path: path.to_owned(), found: e.to_string() })?;
        let (model, optimiser) = (self.model, self.optimiser);
        let small = [
            refraction::tensors(model, optimiser),
            reflection::tensors(model, optimiser),
            clearcoat::tensors(model, optimiser),
        ]
        .concat();
        let (detected, views) = (detected::tensor(self.detected), views::tensors(self.alignment));
        let shapes = Shapes::of(self);
        let mut tensors = shapes.tensors(self);
        let named = small.iter().chain(&detected).chain(&views);
        tensors.extend(named.map(|(name, tensor)| (name.as_str(), tensor.view())));
        write(&header, &tensors)
    }
}

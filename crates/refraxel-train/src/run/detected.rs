//! What a checkpoint keeps of what was found without masks.

use super::boxes::{bounds_of, is_box};
use super::tensors::Tensors;
use crate::checkpoint::{CheckpointError, Tensor, TensorData};
use crate::model::Gate;
use refraxel_core::{Domain, Extent};
use serde::{Deserialize, Serialize};

/// Name of the tensor of its shares, in 1/255.
const NAME: &str = "detected";

/// The grid of what was found.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredDetection {
    bounds: [[f32; 3]; 2],
    resolution: [u32; 3],
}

impl StoredDetection {
    pub(super) fn of(gate: &Gate) -> Self {
        let Domain { bounds, resolution, .. } = *gate.domain();
        Self { bounds: bounds.to_arrays(), resolution }
    }
}

pub(super) fn tensors(gate: Option<&Gate>) -> Vec<(String, Tensor<'_>)> {
    let values = gate.into_iter().map(Gate::values);
    let named = values.map(|v| (NAME.to_owned(), Tensor::new(vec![v.len()], TensorData::U8(v.into()))));
    named.collect()
}

pub(super) fn restore(
    stored: Option<&StoredDetection>,
    file: &mut Tensors,
) -> Result<Option<Gate>, CheckpointError> {
    let Some(StoredDetection { bounds, resolution }) = stored else { return Ok(None) };
    if !is_box(*bounds) || !resolution.iter().all(|n| (2..=1024).contains(n)) {
        return Err(file.wrong("what was found without masks has no valid box or resolution"));
    }
    let domain = Domain { bounds: bounds_of(*bounds), extent: Extent::Bounded, resolution: *resolution };
    let gate = Gate::from_values(domain, file.u8s(NAME)?);
    gate.map(Some).ok_or_else(|| file.wrong("what was found without masks has another size than its grid"))
}

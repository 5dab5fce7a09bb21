//! What a checkpoint keeps of poses that learn.

use super::tensors::Tensors;
use crate::checkpoint::{CheckpointError, Tensor, TensorData};
use crate::poses::Poses;
use serde::{Deserialize, Serialize};

/// Name of the tensor of their numbers, the bits of f64.
const NAME: &str = "poses";

/// How many there are.
#[derive(Serialize, Deserialize)]
pub(super) struct StoredPoses {
    views: usize,
}

impl StoredPoses {
    pub(super) fn of(poses: &Poses) -> Self {
        Self { views: poses.len() }
    }
}

pub(super) fn tensor(poses: Option<&Poses>) -> Option<(String, Tensor)> {
    let bits: Vec<u64> = poses?.to_numbers().into_iter().map(f64::to_bits).collect();
    Some((NAME.to_owned(), Tensor { shape: vec![bits.len()], data: TensorData::U64(bits) }))
}

pub(super) fn restore(
    stored: Option<&StoredPoses>,
    views: usize,
    file: &mut Tensors,
) -> Result<Option<Poses>, CheckpointError> {
    let Some(stored) = stored else { return Ok(None) };
    let numbers: Vec<f64> = file.u64s(NAME)?.into_iter().map(f64::from_bits).collect();
    let poses = Poses::of_numbers(&numbers).filter(|p| p.len() == stored.views && p.len() == views);
    poses.map(Some).ok_or_else(|| file.wrong("its poses are not those of its views"))
}

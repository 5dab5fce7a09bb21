//! What a checkpoint keeps of what the photographs themselves learn: where their cameras are, and their exposures.

use super::tensors::Tensors;
use crate::alignment::Alignment;
use crate::checkpoint::{CheckpointError, Tensor, TensorData};
use crate::exposures::Exposures;
use crate::poses::Poses;
use serde::{Deserialize, Serialize};

/// Names of the tensors of their numbers, the bits of f64.
const POSES: &str = "poses";
const EXPOSURES: &str = "exposures";
const LENSES: &str = "lenses";

/// What learns.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct StoredViews {
    poses: bool,
    exposures: bool,
    #[serde(default)]
    lenses: bool,
}

impl StoredViews {
    pub(super) fn of(alignment: &Alignment) -> Self {
        let Alignment { poses, exposures } = alignment;
        let lenses = poses.as_ref().is_some_and(Poses::learns_lenses);
        Self { poses: poses.is_some(), exposures: exposures.is_some(), lenses }
    }
}

pub(super) fn tensors(alignment: &Alignment) -> Vec<(String, Tensor<'static>)> {
    let tensor = |name: &str, numbers: Vec<f64>| {
        let bits: Vec<u64> = numbers.into_iter().map(f64::to_bits).collect();
        (name.to_owned(), Tensor::new(vec![bits.len()], TensorData::U64(bits.into())))
    };
    let poses = alignment.poses.as_ref().map(|p| tensor(POSES, p.to_numbers()));
    let exposures = alignment.exposures.as_ref().map(|e| tensor(EXPOSURES, e.to_numbers()));
    let lenses = alignment.poses.as_ref().and_then(Poses::lenses_to_numbers).map(|n| tensor(LENSES, n));
    poses.into_iter().chain(exposures).chain(lenses).collect()
}

pub(super) fn restore(
    stored: &StoredViews,
    views: usize,
    file: &mut Tensors,
) -> Result<Alignment, CheckpointError> {
    let mut numbers = |is_there: bool, name: &str| -> Result<Option<Vec<f64>>, CheckpointError> {
        let bits = if is_there { Some(file.u64s(name)?) } else { None };
        Ok(bits.map(|bits| bits.into_iter().map(f64::from_bits).collect()))
    };
    let (poses, exposures) = (numbers(stored.poses, POSES)?, numbers(stored.exposures, EXPOSURES)?);
    let lenses = numbers(stored.lenses, LENSES)?;
    let wrong = |what: &str| file.wrong(&format!("its {what} are not those of its views"));
    let poses = poses.map(|n| Poses::of_numbers(&n).filter(|p| p.len() == views).ok_or_else(|| wrong(POSES)));
    let poses = poses.transpose()?.map(|poses| match &lenses {
        Some(n) => poses.with_lenses_of_numbers(n).ok_or_else(|| wrong(LENSES)),
        None => Ok(poses),
    });
    let exposures = exposures
        .map(|n| Exposures::of_numbers(&n).filter(|e| e.len() == views).ok_or_else(|| wrong(EXPOSURES)));
    Ok(Alignment { poses: poses.transpose()?, exposures: exposures.transpose()? })
}

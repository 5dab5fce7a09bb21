//! What mirrors and clearcoats keep alike in a checkpoint: two grids of probes and their moments, four tensors.

use crate::checkpoint::{CheckpointError, Tensor, TensorData};
use refraxel_core::ShDegree;

/// Four tensors of these names.
pub(super) fn tensors(names: [String; 4], values: [&Vec<f32>; 4]) -> [(String, Tensor); 4] {
    let mut values = values.into_iter();
    names.map(|name| {
        let values = values.next().cloned().unwrap_or_default();
        (name, Tensor { shape: vec![values.len()], data: TensorData::F32(values) })
    })
}

/// Reads four tensors of these names and lengths.
pub(super) fn read_tensors(
    (names, lengths): ([String; 4], [usize; 4]),
    mut read: impl FnMut(&str, usize) -> Result<Vec<f32>, CheckpointError>,
) -> Result<[Vec<f32>; 4], CheckpointError> {
    let mut values: [Vec<f32>; 4] = Default::default();
    for ((name, length), value) in names.iter().zip(lengths).zip(&mut values) {
        *value = read(name, length)?;
    }
    Ok(values)
}

/// The degree of probes on a grid of this resolution, if both make sense.
pub(super) fn degree(stored: u8, resolution: [u32; 3]) -> Option<ShDegree> {
    ShDegree::new(stored).filter(|_| resolution.iter().all(|n| (2..=256).contains(n)))
}

//! Tensors of a checkpoint, taken by name, type and length.

use crate::checkpoint::{CheckpointError, Tensor, TensorData, TensorFile};
use half::f16;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use refraxel_core::{AlignedVec, ShDegree};
use std::borrow::Cow;
use std::path::PathBuf;

/// The nearest number of half precision; the largest where there is none so large. Finished runs have such colours.
pub fn nearest_half(value: f32) -> f16 {
    f16::from_f32(within_half(value))
}

/// A number as large as can be in half precision where it is too large for that.
fn within_half(value: f32) -> f32 {
    let most = f32::from(f16::MAX);
    value.clamp(-most, most)
}

/// Rows that a thread converts at once.
const ROWS: usize = 4096;
/// Values that a thread checks at once.
const VALUES: usize = 1 << 16;

/// The tensors of a checkpoint that are still to be read, and how it is called in messages.
pub(super) struct Tensors {
    file: TensorFile,
    path: PathBuf,
}

impl Tensors {
    pub(super) fn new(file: TensorFile, path: PathBuf) -> Self {
        Self { file, path }
    }

    /// The error of a checkpoint that is sound but makes no sense.
    pub(super) fn wrong(&self, found: &str) -> CheckpointError {
        CheckpointError::Foreign { path: self.path.clone(), found: found.to_owned() }
    }

    /// The caller's header.
    pub(super) fn header(&mut self) -> serde_json::Value {
        std::mem::take(&mut self.file.header)
    }

    fn take(&mut self, name: &str) -> Result<TensorData<'static>, CheckpointError> {
        let tensor = self.file.tensors.remove(name);
        tensor.map(|t| t.data).ok_or_else(|| self.wrong(&format!("tensor `{name}` is missing")))
    }

    /// `len` real numbers.
    pub(super) fn f32s(&mut self, name: &str, len: usize) -> Result<Vec<f32>, CheckpointError> {
        match self.take(name)? {
            TensorData::F32(v) if v.len() == len => Ok(v.into_owned()),
            TensorData::F32(v) => {
                Err(self.wrong(&format!("tensor `{name}` has {} values, expected {len}", v.len())))
            }
            _ => Err(self.wrong(&format!("tensor `{name}` is not of type F32"))),
        }
    }

    /// The same, aligned for SIMD.
    pub(super) fn aligned(&mut self, name: &str, len: usize) -> Result<AlignedVec<f32>, CheckpointError> {
        self.f32s(name, len).map(|v| AlignedVec::from_slice(&v))
    }

    /// `rows` rows of `kept` real numbers, padded with zeros to `stride`. Former files hold the padding too.
    pub(super) fn rows(
        &mut self,
        name: &str,
        rows: usize,
        kept: usize,
        stride: usize,
    ) -> Result<AlignedVec<f32>, CheckpointError> {
        let mut padded = AlignedVec::filled(rows * stride, 0.0);
        match self.take(name)? {
            TensorData::F32(v) if v.len() == rows * stride => padded.copy_from_slice(&v),
            TensorData::F32(v) if v.len() == rows * kept => {
                let parts = padded.par_chunks_mut(ROWS * stride).zip(v.par_chunks(ROWS * kept));
                parts.for_each(|(padded, v)| spread(v, kept, padded, stride));
            }
            TensorData::F16(v) if v.len() == rows * kept => {
                let parts = padded.par_chunks_mut(ROWS * stride).zip(v.par_chunks(ROWS * kept));
                parts.for_each_init(Vec::new, |wide, (padded, v)| {
                    wide.resize(v.len(), 0.0);
                    v.convert_to_f32_slice(wide);
                    wide.iter_mut().for_each(|v| *v = within_half(*v));
                    spread(wide, kept, padded, stride);
                });
            }
            _ => return Err(self.wrong(&format!("tensor `{name}` is not {rows} × {kept} of F32 or F16"))),
        }
        Ok(padded)
    }

    /// Real numbers, of which none may be infinite or no number at all.
    pub(super) fn finite<V: std::ops::Deref<Target = [f32]>>(
        &self,
        name: &str,
        values: V,
    ) -> Result<V, CheckpointError> {
        let wrong = || self.wrong(&format!("tensor `{name}` has values that are not finite"));
        // Without a branch for each value.
        let are_finite = |part: &[f32]| part.iter().fold(true, |are, v| are & v.is_finite());
        values.par_chunks(VALUES).all(are_finite).then_some(values).ok_or_else(wrong)
    }

    /// Mean squares of gradients, aligned for SIMD. One that has become infinite holds its voxel.
    pub(super) fn mean_squares(
        &mut self,
        name: &str,
        len: usize,
    ) -> Result<AlignedVec<f32>, CheckpointError> {
        let values = self.aligned(name, len)?;
        let wrong = || self.wrong(&format!("tensor `{name}` has values that are no squares"));
        values.iter().all(|v| *v >= 0.0).then_some(values).ok_or_else(wrong)
    }

    /// Triples of whole numbers.
    pub(super) fn triples(&mut self, name: &str) -> Result<Vec<[u32; 3]>, CheckpointError> {
        match self.take(name)? {
            TensorData::U32(v) if v.len().is_multiple_of(3) => Ok(v.as_chunks().0.to_vec()),
            _ => Err(self.wrong(&format!("tensor `{name}` is not a list of U32 triples"))),
        }
    }

    /// Bytes.
    pub(super) fn u8s(&mut self, name: &str) -> Result<Vec<u8>, CheckpointError> {
        match self.take(name)? {
            TensorData::U8(v) => Ok(v.into_owned()),
            _ => Err(self.wrong(&format!("tensor `{name}` is not of type U8"))),
        }
    }

    /// 64-bit words.
    pub(super) fn u64s(&mut self, name: &str) -> Result<Vec<u64>, CheckpointError> {
        match self.take(name)? {
            TensorData::U64(v) => Ok(v.into_owned()),
            _ => Err(self.wrong(&format!("tensor `{name}` is not of type U64"))),
        }
    }

    /// Whether there is a tensor of this name.
    pub(super) fn contains(&self, name: &str) -> bool {
        self.file.tensors.contains_key(name)
    }
}

/// Rows of `kept` values at the beginning of rows of `stride` values.
fn spread(values: &[f32], kept: usize, padded: &mut [f32], stride: usize) {
    padded.chunks_mut(stride).zip(values.chunks(kept)).for_each(|(p, v)| p[..kept].copy_from_slice(v));
}

/// A named tensor of real numbers in one row.
pub(super) fn row<'a>(name: String, values: impl Into<Cow<'a, [f32]>>) -> (String, Tensor<'a>) {
    let values = values.into();
    (name, Tensor::new(vec![values.len()], TensorData::F32(values)))
}

/// The degree of probes on a grid of this resolution, if both make sense.
pub(super) fn probe_degree(stored: u8, resolution: [u32; 3]) -> Option<ShDegree> {
    ShDegree::new(stored).filter(|_| resolution.iter().all(|n| (2..=256).contains(n)))
}

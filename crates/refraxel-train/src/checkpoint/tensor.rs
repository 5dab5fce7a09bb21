use std::borrow::Cow;
use std::collections::BTreeMap;

use half::f16;
use half::slice::HalfFloatSliceExt;
use safetensors::Dtype;

#[cfg(target_endian = "big")]
compile_error!("checkpoints are little-endian and are written straight from memory");

/// Values of a tensor, last axis fastest. What is saved is borrowed, so that nothing is copied; what was read is owned.
#[derive(Clone, Debug, PartialEq)]
pub enum TensorData<'a> {
    /// Real numbers: fields, optimiser moments.
    F32(Cow<'a, [f32]>),
    /// Real numbers in half precision: colour of a finished run.
    F16(Cow<'a, [f16]>),
    /// Padded rows, to be saved as [`TensorData::F32`] or, rounded, as [`TensorData::F16`].
    Rows(Rows<'a>),
    /// Small indices.
    U32(Cow<'a, [u32]>),
    /// Counters, random generator states.
    U64(Cow<'a, [u64]>),
    /// Bytes, flags.
    U8(Cow<'a, [u8]>),
}

/// Rows that lie `stride` values apart in memory. The first `kept` values of each are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rows<'a> {
    /// The rows with their padding.
    pub values: &'a [f32],
    /// Length of a row in memory.
    pub stride: usize,
    /// Length of a row in the file.
    pub kept: usize,
    /// Store them in half precision.
    pub half: bool,
}

/// A tensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor<'a> {
    /// Lengths of the axes, slowest first.
    pub shape: Vec<usize>,
    /// As many values as the product of `shape`.
    pub data: TensorData<'a>,
}

/// Everything a checkpoint file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct TensorFile {
    /// The caller's own description, any JSON. NaN and infinity cannot be stored as JSON numbers.
    pub header: serde_json::Value,
    /// Tensors by name.
    pub tensors: BTreeMap<String, Tensor<'static>>,
}

impl<'a> Tensor<'a> {
    /// An array of `shape`, slowest axis first.
    ///
    /// # Panics
    /// When `data` does not hold the product of `shape` values.
    pub fn new(shape: Vec<usize>, data: TensorData<'a>) -> Self {
        let values = match &data {
            TensorData::F32(v) => v.len(),
            TensorData::F16(v) => v.len(),
            TensorData::Rows(r) => r.values.len() / r.stride * r.kept,
            TensorData::U32(v) => v.len(),
            TensorData::U64(v) => v.len(),
            TensorData::U8(v) => v.len(),
        };
        assert_eq!(values, shape.iter().product::<usize>(), "a tensor of shape {shape:?}");
        Self { shape, data }
    }

    /// Gives the stored bytes to `f`, in order.
    pub(super) fn pieces<E>(&self, mut f: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        match &self.data {
            TensorData::F32(v) => f(bytemuck::cast_slice(v)),
            TensorData::F16(v) => f(bytemuck::cast_slice(v)),
            TensorData::Rows(rows) => rows.pieces(f),
            TensorData::U32(v) => f(bytemuck::cast_slice(v)),
            TensorData::U64(v) => f(bytemuck::cast_slice(v)),
            TensorData::U8(v) => f(v),
        }
    }

    /// How many bytes are stored.
    pub(super) fn size(&self) -> usize {
        self.dtype().bitsize() / 8 * self.shape.iter().product::<usize>()
    }

    pub(super) fn dtype(&self) -> Dtype {
        match self.data {
            TensorData::F32(_) | TensorData::Rows(Rows { half: false, .. }) => Dtype::F32,
            TensorData::F16(_) | TensorData::Rows(Rows { half: true, .. }) => Dtype::F16,
            TensorData::U32(_) => Dtype::U32,
            TensorData::U64(_) => Dtype::U64,
            TensorData::U8(_) => Dtype::U8,
        }
    }
}

/// Rows that are converted at once.
const ROWS: usize = 4096;

impl Rows<'_> {
    fn pieces<E>(&self, mut f: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        let mut kept = Vec::with_capacity(ROWS * self.kept);
        let mut rounded = vec![f16::ZERO; if self.half { ROWS * self.kept } else { 0 }];
        for rows in self.values.chunks(ROWS * self.stride) {
            kept.clear();
            rows.chunks(self.stride).for_each(|row| kept.extend_from_slice(&row[..self.kept]));
            if self.half {
                let rounded = &mut rounded[..kept.len()];
                rounded.convert_from_f32_slice(&kept);
                f(bytemuck::cast_slice(rounded))?;
            } else {
                f(bytemuck::cast_slice(&kept))?;
            }
        }
        Ok(())
    }
}

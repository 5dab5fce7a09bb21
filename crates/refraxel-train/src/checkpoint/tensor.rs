use std::collections::BTreeMap;

use half::f16;
use half::slice::HalfFloatSliceExt;
use safetensors::Dtype;

#[cfg(target_endian = "big")]
compile_error!("checkpoints are little-endian and are written straight from memory");

/// Values of a tensor, last axis fastest.
#[derive(Clone, Debug, PartialEq)]
pub enum TensorData {
    /// Real numbers: fields, optimiser moments.
    F32(Vec<f32>),
    /// Real numbers in half precision: colour of a finished run.
    F16(Vec<f16>),
    /// Small indices.
    U32(Vec<u32>),
    /// Counters, random generator states.
    U64(Vec<u64>),
    /// Bytes, flags.
    U8(Vec<u8>),
}

/// An owned tensor.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Lengths of the axes, slowest first.
    pub shape: Vec<usize>,
    /// As many values as the product of `shape`.
    pub data: TensorData,
}

/// Borrowed values of a tensor, last axis fastest.
#[derive(Clone, Copy, Debug)]
pub enum DataView<'a> {
    /// See [`TensorData::F32`].
    F32(&'a [f32]),
    /// See [`TensorData::F16`].
    F16(&'a [f16]),
    /// Padded rows of [`TensorData::F32`] or, rounded, of [`TensorData::F16`].
    Rows(Rows<'a>),
    /// See [`TensorData::U32`].
    U32(&'a [u32]),
    /// See [`TensorData::U64`].
    U64(&'a [u64]),
    /// See [`TensorData::U8`].
    U8(&'a [u8]),
}

/// Rows that lie `stride` values apart in memory. The first `kept` values of each are stored.
#[derive(Clone, Copy, Debug)]
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

/// A borrowed tensor: saving copies nothing.
#[derive(Clone, Copy, Debug)]
pub struct TensorView<'a> {
    pub(super) shape: &'a [usize],
    pub(super) data: DataView<'a>,
}

/// Everything a checkpoint file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct TensorFile {
    /// The caller's own description, any JSON. NaN and infinity cannot be stored as JSON numbers.
    pub header: serde_json::Value,
    /// Tensors by name.
    pub tensors: BTreeMap<String, Tensor>,
}

impl Tensor {
    /// The tensor without its values' ownership.
    pub fn view(&self) -> TensorView<'_> {
        let data = match &self.data {
            TensorData::F32(v) => DataView::F32(v),
            TensorData::F16(v) => DataView::F16(v),
            TensorData::U32(v) => DataView::U32(v),
            TensorData::U64(v) => DataView::U64(v),
            TensorData::U8(v) => DataView::U8(v),
        };
        TensorView::new(&self.shape, data)
    }
}

impl<'a> TensorView<'a> {
    /// Views `data` as an array of `shape`, slowest axis first.
    ///
    /// # Panics
    /// When `data` does not hold the product of `shape` values.
    pub fn new(shape: &'a [usize], data: DataView<'a>) -> Self {
        let values = match data {
            DataView::F32(v) => v.len(),
            DataView::F16(v) => v.len(),
            DataView::Rows(r) => r.values.len() / r.stride * r.kept,
            DataView::U32(v) => v.len(),
            DataView::U64(v) => v.len(),
            DataView::U8(v) => v.len(),
        };
        assert_eq!(values, shape.iter().product::<usize>(), "a tensor of shape {shape:?}");
        Self { shape, data }
    }

    /// Gives the stored bytes to `f`, in order.
    pub(super) fn pieces<E>(&self, mut f: impl FnMut(&[u8]) -> Result<(), E>) -> Result<(), E> {
        match self.data {
            DataView::F32(v) => f(bytemuck::cast_slice(v)),
            DataView::F16(v) => f(bytemuck::cast_slice(v)),
            DataView::Rows(rows) => rows.pieces(f),
            DataView::U32(v) => f(bytemuck::cast_slice(v)),
            DataView::U64(v) => f(bytemuck::cast_slice(v)),
            DataView::U8(v) => f(v),
        }
    }

    /// How many bytes are stored.
    pub(super) fn size(&self) -> usize {
        self.dtype().bitsize() / 8 * self.shape.iter().product::<usize>()
    }

    pub(super) fn dtype(&self) -> Dtype {
        match self.data {
            DataView::F32(_) | DataView::Rows(Rows { half: false, .. }) => Dtype::F32,
            DataView::F16(_) | DataView::Rows(Rows { half: true, .. }) => Dtype::F16,
            DataView::U32(_) => Dtype::U32,
            DataView::U64(_) => Dtype::U64,
            DataView::U8(_) => Dtype::U8,
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

impl TensorData {
    /// `values` zeros of the type, or `None` for a type that checkpoints do not use.
    pub(super) fn zeros(dtype: Dtype, values: usize) -> Option<Self> {
        Some(match dtype {
            Dtype::F32 => Self::F32(vec![0.0; values]),
            Dtype::F16 => Self::F16(vec![f16::ZERO; values]),
            Dtype::U32 => Self::U32(vec![0; values]),
            Dtype::U64 => Self::U64(vec![0; values]),
            Dtype::U8 => Self::U8(vec![0; values]),
            _ => return None,
        })
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::F32(v) => bytemuck::cast_slice_mut(v),
            Self::F16(v) => bytemuck::cast_slice_mut(v),
            Self::U32(v) => bytemuck::cast_slice_mut(v),
            Self::U64(v) => bytemuck::cast_slice_mut(v),
            Self::U8(v) => v,
        }
    }
}

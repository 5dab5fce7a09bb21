use std::collections::BTreeMap;

use safetensors::Dtype;

/// Values of a tensor, last axis fastest.
#[derive(Clone, Debug, PartialEq)]
pub enum TensorData {
    /// Real numbers: fields, optimiser moments.
    F32(Vec<f32>),
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
    /// See [`TensorData::U32`].
    U32(&'a [u32]),
    /// See [`TensorData::U64`].
    U64(&'a [u64]),
    /// See [`TensorData::U8`].
    U8(&'a [u8]),
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
            DataView::U32(v) => v.len(),
            DataView::U64(v) => v.len(),
            DataView::U8(v) => v.len(),
        };
        assert_eq!(values, shape.iter().product::<usize>(), "a tensor of shape {shape:?}");
        Self { shape, data }
    }

    pub(super) fn bytes(&self) -> &'a [u8] {
        match self.data {
            DataView::F32(v) => bytemuck::cast_slice(v),
            DataView::U32(v) => bytemuck::cast_slice(v),
            DataView::U64(v) => bytemuck::cast_slice(v),
            DataView::U8(v) => v,
        }
    }

    pub(super) fn dtype(&self) -> Dtype {
        match self.data {
            DataView::F32(_) => Dtype::F32,
            DataView::U32(_) => Dtype::U32,
            DataView::U64(_) => Dtype::U64,
            DataView::U8(_) => Dtype::U8,
        }
    }
}

impl TensorData {
    /// `values` zeros of the type, or `None` for a type that checkpoints do not use.
    pub(super) fn zeros(dtype: Dtype, values: usize) -> Option<Self> {
        Some(match dtype {
            Dtype::F32 => Self::F32(vec![0.0; values]),
            Dtype::U32 => Self::U32(vec![0; values]),
            Dtype::U64 => Self::U64(vec![0; values]),
            Dtype::U8 => Self::U8(vec![0; values]),
            _ => return None,
        })
    }

    pub(super) fn bytes_mut(&mut self) -> &mut [u8] {
        match self {
            Self::F32(v) => bytemuck::cast_slice_mut(v),
            Self::U32(v) => bytemuck::cast_slice_mut(v),
            Self::U64(v) => bytemuck::cast_slice_mut(v),
            Self::U8(v) => v,
        }
    }
}

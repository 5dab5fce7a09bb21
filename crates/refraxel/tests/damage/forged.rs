//! Checkpoints with right checksums and wrong content.

use crate::damage::{Kind, damage};
use half::f16;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use refraxel_train::checkpoint::{self, Tensor, TensorData, TensorFile};
use serde_json::Value;

/// One wrong thing in a checkpoint.
#[derive(Clone, Debug)]
pub enum Forgery {
    /// Another description.
    Header(Value),
    /// A tensor has another shape, type or name, or is gone.
    Layout(Index, &'static str),
    /// Every n-th number of a tensor from one on is of these bits.
    Numbers { tensor: Index, first: usize, step: usize, bits: u32 },
}

/// What happens to the layout of a tensor.
const LAYOUTS: [&str; 7] = ["gone", "renamed", "reversed", "flat", "deeper", "empty", "bytes"];
/// NaN, ∞, −∞, the largest number, all ones, 0, −0, the smallest number, 1.
const BITS: [u32; 9] =
    [0x7fc0_0000, 0x7f80_0000, 0xff80_0000, 0x7f7f_ffff, u32::MAX, 0, 0x8000_0000, 1, 0x3f80_0000];

/// Some wrong things in this checkpoint.
pub fn forgeries(valid: &TensorFile) -> impl Strategy<Value = Vec<Forgery>> + use<> {
    let header = serde_json::to_vec_pretty(&valid.header).unwrap();
    let header = damage(Kind::Text).prop_filter_map("this is no JSON", move |damage| {
        serde_json::from_slice(&damage.of(&header)).ok().map(Forgery::Header)
    });
    let layout =
        (any::<Index>(), select(&LAYOUTS[..])).prop_map(|(tensor, layout)| Forgery::Layout(tensor, layout));
    let numbers = (any::<Index>(), 0_usize..1009, select(&[1, 3, 97, 1009][..]), select(&BITS[..]))
        .prop_map(|(tensor, first, step, bits)| Forgery::Numbers { tensor, first: first % step, step, bits });
    vec(prop_oneof![2 => header, 1 => layout, 2 => numbers], 1..3)
}

/// The checkpoint with these, as a program would write it.
pub fn forged(valid: &TensorFile, forgeries: &[Forgery]) -> Vec<u8> {
    let mut file = valid.clone();
    forgeries.iter().for_each(|forgery| forgery.apply(&mut file));
    written(&file)
}

/// The bytes of a checkpoint.
pub fn written(file: &TensorFile) -> Vec<u8> {
    let views: Vec<_> = file.tensors.iter().map(|(name, tensor)| (name.as_str(), tensor)).collect();
    let mut bytes = Vec::new();
    checkpoint::write(&mut bytes, &file.header, &views).unwrap();
    bytes
}

impl Forgery {
    fn apply(&self, file: &mut TensorFile) {
        let name = |at: &Index| file.tensors.keys().nth(at.index(file.tensors.len())).unwrap().clone();
        match self {
            Self::Header(header) => file.header = header.clone(),
            Self::Layout(at, layout) => {
                let (name, tensor) = file.tensors.remove_entry(&name(at)).unwrap();
                file.tensors.extend(laid_out(layout, name, tensor));
            }
            Self::Numbers { tensor, first, step, bits } => {
                let name = name(tensor);
                let data = &mut file.tensors.get_mut(&name).unwrap().data;
                match data {
                    TensorData::F32(v) => set(v.to_mut(), *first, *step, f32::from_bits(*bits)),
                    TensorData::F16(v) => set(v.to_mut(), *first, *step, f16::from_bits((bits >> 16) as u16)),
                    TensorData::U32(v) => set(v.to_mut(), *first, *step, *bits),
                    TensorData::U64(v) => set(v.to_mut(), *first, *step, u64::from(*bits) << 32),
                    TensorData::U8(v) => set(v.to_mut(), *first, *step, *bits as u8),
                    TensorData::Rows(_) => unreachable!("they are only written"),
                }
            }
        }
    }
}

/// What a tensor becomes.
fn laid_out(layout: &str, name: String, mut tensor: Tensor<'static>) -> Option<(String, Tensor<'static>)> {
    let values = tensor.shape.iter().product();
    match layout {
        "gone" => return None,
        "renamed" => return Some((name + "_", tensor)),
        "reversed" => tensor.shape.reverse(),
        "flat" => tensor.shape = vec![values],
        "deeper" => tensor.shape.push(1),
        "empty" => tensor = Tensor::new(vec![0], TensorData::F32(Vec::new().into())),
        _ => tensor.data = TensorData::U8(vec![7; values].into()),
    }
    Some((name, tensor))
}

fn set<T: Copy>(values: &mut [T], first: usize, step: usize, value: T) {
    values.iter_mut().skip(first).step_by(step).for_each(|v| *v = value);
}

//! Checkpoints with right checksums and wrong content.

use super::Change;
use half::f16;
use refraxel_train::checkpoint::{self, CheckpointError, Tensor, TensorData, TensorFile};
use serde_json::{Value, json};
use std::path::Path;

/// Words of 32 bits: NaN, ∞, −∞, the largest number, all ones, 0, −0, the smallest number, 1.
const WORDS: [u32; 9] =
    [0x7fc0_0000, 0x7f80_0000, 0xff80_0000, 0x7f7f_ffff, u32::MAX, 0, 0x8000_0000, 1, 0x3f80_0000];
/// Factors on numbers of the description.
const FACTORS: [f64; 6] = [0.0, -1.0, 2.0, 0.5, 3.0, 1000.0];

/// A valid checkpoint with some changes, written with right checksums.
pub fn changed(valid: &[u8], changes: &[Change]) -> Vec<u8> {
    let name = Path::new("the valid checkpoint");
    let Ok(mut file) = TensorFile::read(valid, name) else { return valid.to_vec() };
    for change in changes {
        match change.kind % 5 {
            0 | 1 => change_value(&mut file.header, change),
            2 => change_layout(&mut file, change),
            _ => change_numbers(&mut file, change),
        }
    }
    written(&file).unwrap_or_else(|_| valid.to_vec())
}

/// A file of tensors, as a program would write it.
pub fn written(file: &TensorFile) -> Result<Vec<u8>, CheckpointError> {
    let views: Vec<_> = file.tensors.iter().map(|(name, t)| (name.as_str(), t.view())).collect();
    let mut bytes = Vec::new();
    checkpoint::write(&mut bytes, &file.header, &views)?;
    Ok(bytes)
}

fn values() -> [Value; 22] {
    [
        json!(0),
        json!(1),
        json!(-1),
        json!(2),
        json!(3),
        json!(1e30),
        json!(-1e30),
        json!(1e-30),
        json!(0.5),
        json!(2048),
        json!(4096),
        json!(1_u64 << 32),
        json!(1_u64 << 53),
        json!(u64::MAX),
        json!(1e308),
        Value::Null,
        json!("x"),
        json!([]),
        json!({}),
        json!(true),
        json!([0, 0, 0]),
        json!([1e38, 1e38, 1e38]),
    ]
}

/// One value of the description is scaled, replaced or removed.
fn change_value(header: &mut Value, change: &Change) {
    let mut paths = Vec::new();
    collect(header, &mut String::new(), &mut paths);
    let Some(k) = change.at.checked_rem(paths.len() as u64) else { return };
    let path = &paths[k as usize];
    let choice = change.value as usize;
    if choice % 12 == 11 {
        remove(header, path);
        return;
    }
    let Some(at) = header.pointer_mut(path) else { return };
    let factor = FACTORS[(choice >> 16) % FACTORS.len()];
    *at = match at.as_f64() {
        Some(v) if choice.is_multiple_of(2) && at.is_f64() => json!(v * factor),
        Some(v) if choice.is_multiple_of(2) => json!((v * factor) as i64),
        _ => values()[(choice >> 8) % values().len()].clone(),
    };
}

/// JSON pointers of all values but the whole, up to 40 of a list.
fn collect(value: &Value, here: &mut String, paths: &mut Vec<String>) {
    let length = here.len();
    let mut step = |key: &str, child: &Value| {
        here.push('/');
        here.push_str(&key.replace('~', "~0").replace('/', "~1"));
        paths.push(here.clone());
        collect(child, here, paths);
        here.truncate(length);
    };
    match value {
        Value::Object(all) => all.iter().for_each(|(key, child)| step(key, child)),
        Value::Array(all) => {
            all.iter().take(40).enumerate().for_each(|(k, child)| step(&k.to_string(), child))
        }
        _ => {}
    }
}

fn remove(header: &mut Value, path: &str) {
    let Some((parent, key)) = path.rsplit_once('/') else { return };
    match header.pointer_mut(parent) {
        Some(Value::Object(all)) => drop(all.remove(key)),
        Some(Value::Array(all)) => {
            drop(key.parse().ok().filter(|&k: &usize| k < all.len()).map(|k| all.remove(k)))
        }
        _ => {}
    }
}

/// A tensor gets another shape, another type or another name, or goes.
fn change_layout(file: &mut TensorFile, change: &Change) {
    let Some(name) = nth(file, change.at) else { return };
    let Some(mut tensor) = file.tensors.remove(&name) else { return };
    let values = tensor.shape.iter().product::<usize>();
    let choice = change.value as usize;
    match choice % 7 {
        0 => return,
        1 => tensor.shape.reverse(),
        2 => tensor.shape = vec![values],
        3 => tensor.shape.push(1),
        4 => tensor = Tensor { shape: vec![0], data: TensorData::F32(Vec::new()) },
        5 => {
            let shape = tensor.shape.clone();
            tensor = Tensor { shape, data: TensorData::U8(vec![choice as u8; values]) };
        }
        _ => {
            file.tensors.insert(format!("{name}_"), tensor);
            return;
        }
    }
    file.tensors.insert(name, tensor);
}

/// Some or all numbers of a tensor become numbers that arithmetic does not like.
fn change_numbers(file: &mut TensorFile, change: &Change) {
    let Some(name) = nth(file, change.at) else { return };
    let Some(tensor) = file.tensors.get_mut(&name) else { return };
    let choice = change.value as usize;
    let word = WORDS[choice % WORDS.len()];
    let stride = [1, 1, 3, 97, 1009][(choice >> 8) % 5];
    let first = (choice >> 16) % stride;
    match &mut tensor.data {
        TensorData::F32(v) => set(v, first, stride, f32::from_bits(word)),
        TensorData::F16(v) => {
            let bits = (word >> 16) as u16;
            set(v, first, stride, f16::from_bits(bits));
        }
        TensorData::U32(v) => set(v, first, stride, word),
        TensorData::U64(v) => set(v, first, stride, u64::from(word) << (choice >> 24 & 32)),
        TensorData::U8(v) => set(v, first, stride, word as u8),
    }
}

fn set<T: Copy>(values: &mut [T], first: usize, stride: usize, value: T) {
    values.iter_mut().skip(first).step_by(stride).for_each(|v| *v = value);
}

fn nth(file: &TensorFile, at: u64) -> Option<String> {
    let k = at.checked_rem(file.tensors.len() as u64)? as usize;
    file.tensors.keys().nth(k).cloned()
}

use std::collections::{BTreeMap, HashMap};
use std::io::Write;
use std::path::Path;

use refraxel_data::atomic::{WriteError, write_atomic_with};
use safetensors::tensor::{Metadata, TensorInfo};

use super::envelope::{BLANK_CRC, Envelope, KEY, MAGIC, SCHEMA, header_crc};
use super::error::CheckpointError;
use super::faults::reach;
use super::{Tensor, TensorFile};

/// Writes `header` and `tensors` to `path` atomically, straight from the caller's memory.
///
/// Equal content gives equal bytes, whatever the order of `tensors`. On an error an earlier file at `path` is unchanged.
///
/// # Panics
/// When two tensors have the same name, or one is named `__metadata__`.
pub fn save(
    path: &Path,
    header: &serde_json::Value,
    tensors: &[(&str, &Tensor<'_>)],
) -> Result<(), CheckpointError> {
    write_atomic_with(path, reach, |writer| fill(writer, header, tensors))?;
    Ok(())
}

/// Writes the same bytes anywhere.
///
/// # Panics
/// As [`save`].
pub fn write(
    to: &mut dyn Write,
    header: &serde_json::Value,
    tensors: &[(&str, &Tensor<'_>)],
) -> Result<(), CheckpointError> {
    let failed = |source| WriteError { path: "(a stream)".into(), action: "writing its content", source };
    Ok(fill(to, header, tensors).map_err(failed)?)
}

fn fill(
    to: &mut dyn Write,
    header: &serde_json::Value,
    tensors: &[(&str, &Tensor<'_>)],
) -> std::io::Result<()> {
    let mut ordered = tensors.to_vec();
    ordered.sort_by(|(a, x), (b, y)| y.dtype().cmp(&x.dtype()).then(a.cmp(b))); // widest first keeps all aligned
    let text = header_text(header, &ordered)?;
    to.write_all(&(text.len() as u64).to_le_bytes())?;
    to.write_all(&text)?;
    ordered.iter().try_for_each(|(_, tensor)| tensor.pieces(|bytes| to.write_all(bytes)))
}

impl TensorFile {
    /// Writes the file, see [`save`].
    pub fn save(&self, path: &Path) -> Result<(), CheckpointError> {
        let tensors: Vec<_> = self.tensors.iter().map(|(name, t)| (name.as_str(), t)).collect();
        save(path, &self.header, &tensors)
    }
}

/// The safetensors header, padded to 8 bytes, its checksum filled in.
fn header_text(
    header: &serde_json::Value,
    tensors: &[(&str, &Tensor<'_>)],
) -> Result<Vec<u8>, std::io::Error> {
    let sums: BTreeMap<_, _> = tensors.iter().map(|(name, t)| ((*name).to_owned(), sum_of(t))).collect();
    assert_eq!(sums.len(), tensors.len(), "each tensor has a name of its own");
    assert!(!sums.contains_key("__metadata__"), "safetensors reserves the name __metadata__");
    let envelope =
        Envelope { header_crc32: BLANK_CRC.to_owned(), schema: SCHEMA, tensors_crc32: sums, header };
    let entry = HashMap::from([(KEY.to_owned(), serde_json::to_string(&envelope)?)]);
    let mut end = 0;
    let infos = tensors.iter().map(|(name, t)| {
        let start = end;
        end += t.size();
        let info = TensorInfo { dtype: t.dtype(), shape: t.shape.to_vec(), data_offsets: (start, end) };
        ((*name).to_owned(), info)
    });
    let layout = Metadata::new(Some(entry), infos.collect()).map_err(std::io::Error::other)?;
    let mut text = serde_json::to_vec(&layout)?;
    text.resize(text.len().next_multiple_of(8), b' ');
    let sum = header_crc(&text);
    text[MAGIC.len()..MAGIC.len() + sum.len()].copy_from_slice(sum.as_bytes());
    Ok(text)
}

fn sum_of(tensor: &Tensor) -> u32 {
    let mut sum = crc32fast::Hasher::new();
    let Ok(()) = tensor.pieces(|bytes| {
        sum.update(bytes);
        Ok::<_, std::convert::Infallible>(())
    });
    sum.finalize()
}

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use bytemuck::Pod;
use rayon::prelude::*;
use safetensors::Dtype;
use safetensors::tensor::{Metadata, TensorInfo};

use super::envelope::{BLANK_CRC, Envelope, KEY, MAGIC, MAX_HEADER, SCHEMA, Version, header_crc};
use super::error::CheckpointError;
use super::{Tensor, TensorData, TensorFile};

/// Bytes that a thread reads and sums up at once.
const PART: usize = 4 << 20;

impl TensorFile {
    /// Reads and verifies the checkpoint at `path`: layout, length, schema and every checksum.
    ///
    /// Any file gives either exactly what was saved or an error; memory stays within a small multiple of the file's length.
    pub fn load(path: &Path) -> Result<Self, CheckpointError> {
        Self::load_without(path, &[])
    }

    /// The same without some tensors, which are neither read nor verified.
    pub fn load_without(path: &Path, left_out: &[&str]) -> Result<Self, CheckpointError> {
        open(path)?.file(left_out)
    }

    /// Reads and verifies the caller's header alone.
    pub fn load_header(path: &Path) -> Result<serde_json::Value, CheckpointError> {
        let reader = open(path)?;
        Ok(reader.parse(&reader.header()?)?.1.header)
    }

    /// Reads and verifies a checkpoint from anywhere, to the end of the stream; `name` stands for its path in messages.
    pub fn read(mut from: impl Read, name: &Path) -> Result<Self, CheckpointError> {
        let mut bytes = Vec::new();
        let failed = |source| CheckpointError::Read { path: name.to_owned(), source };
        from.read_to_end(&mut bytes).map_err(failed)?;
        Reader { path: name, length: bytes.len() as u64, from: Place::Memory(bytes) }.file(&[])
    }
}

/// Where a checkpoint is.
enum Place {
    File(File),
    Memory(Vec<u8>),
}

impl Place {
    /// Fills `bytes` with those from `at` on.
    fn read(&self, bytes: &mut [u8], at: u64) -> io::Result<()> {
        match self {
            Self::File(file) => read_at(file, bytes, at),
            Self::Memory(all) => {
                let from = all.get(at as usize..).and_then(|rest| rest.get(..bytes.len()));
                bytes.copy_from_slice(from.ok_or(io::ErrorKind::UnexpectedEof)?);
                Ok(())
            }
        }
    }
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], at: u64) -> io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, at)
}

#[cfg(not(unix))]
fn read_at(file: &File, mut bytes: &mut [u8], mut at: u64) -> io::Result<()> {
    while !bytes.is_empty() {
        let read = std::os::windows::fs::FileExt::seek_read(file, bytes, at)?;
        if read == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes = &mut bytes[read..];
        at += read as u64;
    }
    Ok(())
}

/// A checkpoint that is being read.
struct Reader<'a> {
    path: &'a Path,
    from: Place,
    /// Of all there is to read [byte].
    length: u64,
}

fn open(path: &Path) -> Result<Reader<'_>, CheckpointError> {
    let failed = |source| CheckpointError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if !metadata.is_file() {
        let found = "it is not a regular file".to_owned();
        return Err(CheckpointError::Foreign { path: path.to_owned(), found });
    }
    Ok(Reader { path, from: Place::File(file), length: metadata.len() })
}

impl Reader<'_> {
    /// All of it but some tensors.
    fn file(&self, left_out: &[&str]) -> Result<TensorFile, CheckpointError> {
        let text = self.header()?;
        let (layout, envelope) = self.parse(&text)?;
        let start = 8 + text.len() as u64;
        let end = start + layout.data_len() as u64;
        if self.length != end {
            let found = format!("it is {} bytes long instead of {end}", self.length);
            return Err(self.damaged(found));
        }
        let mut tensors = BTreeMap::new();
        for name in layout.offset_keys() {
            let (Some(info), Some(&sum)) = (layout.info(&name), envelope.tensors_crc32.get(&name)) else {
                return Err(self.damaged(format!("the tensor '{name}' has no checksum")));
            };
            if !left_out.contains(&name.as_str()) {
                let tensor = self.tensor(&name, info, start, sum)?;
                tensors.insert(name, tensor);
            }
        }
        Ok(TensorFile { header: envelope.header, tensors })
    }

    /// The safetensors header, its checksum verified.
    fn header(&self) -> Result<Vec<u8>, CheckpointError> {
        if self.length < 8 {
            return Err(self.foreign("it is too short"));
        }
        let mut prefix = [0; 8];
        self.fill(&mut prefix, 0)?;
        let announced = u64::from_le_bytes(prefix);
        let present = announced.min(MAX_HEADER).min(self.length - 8);
        let mut text = vec![0; present as usize];
        self.fill(&mut text, 8)?;
        if text.len() < MAGIC.len() + BLANK_CRC.len() || !text.starts_with(MAGIC) {
            return Err(self.foreign("it does not start like one"));
        }
        if present < announced {
            return Err(self.damaged(format!("its header of {announced} bytes is cut off or misstated")));
        }
        if text[MAGIC.len()..][..BLANK_CRC.len()] != *header_crc(&text).as_bytes() {
            return Err(self.damaged("its header does not match its checksum".to_owned()));
        }
        Ok(text)
    }

    fn parse(&self, text: &[u8]) -> Result<(Metadata, Envelope<serde_json::Value>), CheckpointError> {
        let layout: Metadata =
            serde_json::from_slice(text).map_err(|e| self.damaged(format!("its layout is invalid ({e})")))?;
        let entry = layout.metadata().as_ref().and_then(|m| m.get(KEY));
        let entry = entry.ok_or_else(|| self.foreign("it has no refraxel entry"))?;
        let invalid = |e| self.damaged(format!("its description is invalid ({e})"));
        let version: Version = serde_json::from_str(entry).map_err(invalid)?;
        if version.schema != SCHEMA {
            return Err(CheckpointError::Schema { path: self.path.to_owned(), found: version.schema });
        }
        let envelope = serde_json::from_str(entry).map_err(invalid)?;
        Ok((layout, envelope))
    }

    fn tensor(
        &self,
        name: &str,
        info: &TensorInfo,
        start: u64,
        sum: u32,
    ) -> Result<Tensor<'static>, CheckpointError> {
        let count = info.shape.iter().product(); // checked against the file's length by the layout
        let fill =
            |bytes: &mut [u8]| self.fill_verified(bytes, start + info.data_offsets.0 as u64, sum, name);
        let data = match info.dtype {
            Dtype::F32 => TensorData::F32(filled(count, fill)?),
            Dtype::F16 => TensorData::F16(filled(count, fill)?),
            Dtype::U32 => TensorData::U32(filled(count, fill)?),
            Dtype::U64 => TensorData::U64(filled(count, fill)?),
            Dtype::U8 => TensorData::U8(filled(count, fill)?),
            other => return Err(self.damaged(format!("the tensor '{name}' has the unknown type {other}"))),
        };
        Ok(Tensor { shape: info.shape.clone(), data })
    }

    /// Fills `bytes` with those of a tensor, which begins at `first`.
    fn fill_verified(
        &self,
        bytes: &mut [u8],
        first: u64,
        sum: u32,
        name: &str,
    ) -> Result<(), CheckpointError> {
        let parts = bytes.par_chunks_mut(PART).enumerate().map(|(k, part)| -> Result<_, CheckpointError> {
            self.fill(part, first + (k * PART) as u64)?;
            let mut sum = crc32fast::Hasher::new();
            sum.update(part);
            Ok(sum)
        });
        let parts: Vec<crc32fast::Hasher> = parts.collect::<Result<_, _>>()?;
        let mut found = crc32fast::Hasher::new();
        parts.iter().for_each(|part| found.combine(part));
        let is_whole = found.finalize() == sum;
        is_whole
            .then_some(())
            .ok_or_else(|| self.damaged(format!("the tensor '{name}' does not match its checksum")))
    }

    fn fill(&self, bytes: &mut [u8], at: u64) -> Result<(), CheckpointError> {
        let failed = |source| CheckpointError::Read { path: self.path.to_owned(), source };
        self.from.read(bytes, at).map_err(failed)
    }

    fn damaged(&self, found: String) -> CheckpointError {
        CheckpointError::Damaged { path: self.path.to_owned(), found }
    }

    fn foreign(&self, found: &'static str) -> CheckpointError {
        CheckpointError::Foreign { path: self.path.to_owned(), found: found.to_owned() }
    }
}

/// So many values, whose bytes somebody fills in.
fn filled<T: Pod>(
    count: usize,
    fill: impl FnOnce(&mut [u8]) -> Result<(), CheckpointError>,
) -> Result<Cow<'static, [T]>, CheckpointError> {
    let mut values = vec![T::zeroed(); count];
    fill(bytemuck::cast_slice_mut(&mut values))?;
    Ok(values.into())
}

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use safetensors::tensor::{Metadata, TensorInfo};

use super::envelope::{BLANK_CRC, Envelope, KEY, MAGIC, MAX_HEADER, SCHEMA, Version, header_crc};
use super::error::CheckpointError;
use super::{Tensor, TensorData, TensorFile};

impl TensorFile {
    /// Reads and verifies the checkpoint at `path`: layout, length, schema and every checksum.
    ///
    /// Any file gives either exactly what was saved or an error; memory stays within a small multiple of the file's length.
    pub fn load(path: &Path) -> Result<Self, CheckpointError> {
        Self::from_reader(open(path)?)
    }

    /// Reads and verifies a checkpoint from anywhere, to the end of the stream; `name` stands for its path in messages.
    pub fn read(mut from: impl Read, name: &Path) -> Result<Self, CheckpointError> {
        let mut bytes = Vec::new();
        let failed = |source| CheckpointError::Read { path: name.to_owned(), source };
        from.read_to_end(&mut bytes).map_err(failed)?;
        Self::from_reader(Reader { path: name, length: bytes.len() as u64, from: &bytes[..] })
    }

    fn from_reader(mut reader: Reader<impl Read>) -> Result<Self, CheckpointError> {
        let text = reader.header()?;
        let (layout, envelope) = reader.parse(&text)?;
        let end = 8 + text.len() as u64 + layout.data_len() as u64;
        if reader.length != end {
            let found = format!("it is {} bytes long instead of {end}", reader.length);
            return Err(reader.damaged(found));
        }
        let mut tensors = BTreeMap::new();
        for name in layout.offset_keys() {
            let (Some(info), Some(&sum)) = (layout.info(&name), envelope.tensors_crc32.get(&name)) else {
                return Err(reader.damaged(format!("the tensor '{name}' has no checksum")));
            };
            let tensor = reader.tensor(&name, info, sum)?;
            tensors.insert(name, tensor);
        }
        Ok(Self { header: envelope.header, tensors })
    }
}

/// A checkpoint that is being read front to back.
struct Reader<'a, R> {
    path: &'a Path,
    from: R,
    /// Of all there is to read [byte].
    length: u64,
}

fn open(path: &Path) -> Result<Reader<'_, File>, CheckpointError> {
    let failed = |source| CheckpointError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(failed)?;
    let metadata = file.metadata().map_err(failed)?;
    if !metadata.is_file() {
        let found = "it is not a regular file".to_owned();
        return Err(CheckpointError::Foreign { path: path.to_owned(), found });
    }
    Ok(Reader { path, from: file, length: metadata.len() })
}

impl<R: Read> Reader<'_, R> {
    /// The safetensors header, its checksum verified.
    fn header(&mut self) -> Result<Vec<u8>, CheckpointError> {
        if self.length < 8 {
            return Err(self.foreign("it is too short"));
        }
        let mut prefix = [0; 8];
        self.fill(&mut prefix)?;
        let announced = u64::from_le_bytes(prefix);
        let present = announced.min(MAX_HEADER).min(self.length - 8);
        let mut text = vec![0; present as usize];
        self.fill(&mut text)?;
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

    fn tensor(&mut self, name: &str, info: &TensorInfo, sum: u32) -> Result<Tensor, CheckpointError> {
        let values = info.shape.iter().product(); // checked against the file's length by the layout
        let Some(mut data) = TensorData::zeros(info.dtype, values) else {
            return Err(self.damaged(format!("the tensor '{name}' has the unknown type {}", info.dtype)));
        };
        self.fill(data.bytes_mut())?;
        if crc32fast::hash(data.bytes_mut()) != sum {
            return Err(self.damaged(format!("the tensor '{name}' does not match its checksum")));
        }
        Ok(Tensor { shape: info.shape.clone(), data })
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), CheckpointError> {
        let failed = |source| CheckpointError::Read { path: self.path.to_owned(), source };
        self.from.read_exact(bytes).map_err(failed)
    }

    fn damaged(&self, found: String) -> CheckpointError {
        CheckpointError::Damaged { path: self.path.to_owned(), found }
    }

    fn foreign(&self, found: &'static str) -> CheckpointError {
        CheckpointError::Foreign { path: self.path.to_owned(), found: found.to_owned() }
    }
}

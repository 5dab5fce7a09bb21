//! The metadata entry of the safetensors header, and the checksum of that header.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// Version of the file layout described in [its module](super).
pub const SCHEMA: u32 = 2;
/// The one metadata key.
pub const KEY: &str = "refraxel";
/// First bytes of the safetensors header; the eight hexadecimal digits of its CRC-32 follow.
pub const MAGIC: &[u8] = br#"{"__metadata__":{"refraxel":"{\"header_crc32\":\""#;
/// Stands where the CRC-32 goes while that is computed.
pub const BLANK_CRC: &str = "00000000";
/// Longest header [byte]; safetensors itself allows no more.
pub const MAX_HEADER: u64 = 100_000_000;

/// What the metadata entry holds, in this order; `header_crc32` must stay first for [`MAGIC`].
#[derive(Serialize, Deserialize)]
pub struct Envelope<H> {
    /// CRC-32 of the length field and the safetensors header with these digits zero.
    pub header_crc32: String,
    /// Layout version.
    pub schema: u32,
    /// CRC-32 of the bytes of each tensor.
    pub tensors_crc32: BTreeMap<String, u32>,
    /// The caller's header.
    pub header: H,
}

/// Only the version: readable whatever else a later schema changes.
#[derive(Deserialize)]
pub struct Version {
    /// Layout version.
    pub schema: u32,
}

/// Digits of the CRC-32 of `text`, a safetensors header that starts with [`MAGIC`], and of its length field.
pub fn header_crc(text: &[u8]) -> String {
    let digits = MAGIC.len()..MAGIC.len() + BLANK_CRC.len();
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&(text.len() as u64).to_le_bytes());
    hasher.update(&text[..digits.start]);
    hasher.update(BLANK_CRC.as_bytes());
    hasher.update(&text[digits.end..]);
    format!("{:08x}", hasher.finalize())
}

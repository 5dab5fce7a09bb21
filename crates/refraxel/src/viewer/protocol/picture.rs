//! The messages of pictures.

use serde::{Deserialize, Serialize};

/// The header of a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "picture", rename_all = "snake_case")]
pub enum Header {
    /// The scene.
    Frame {
        /// Of the [`Look`].
        id: u64,
        /// Number of the picture, counted for each page.
        frame: u64,
        /// Size [pixel].
        size: [u32; 2],
        /// Rays per pixel; 0 where the picture is coarser than what was asked for.
        rays: u32,
        /// No better picture follows.
        last: bool,
        /// Time of computation [ms].
        ms: f64,
        /// Smallest and largest value of the colours, where the picture shows numbers.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        range: Option<[f32; 2]>,
        /// Steps of the training that the picture shows.
        step: u64,
    },
    /// A photograph.
    Photo {
        /// Its number.
        view: usize,
        /// Size [pixel].
        size: [u32; 2],
    },
    /// The index in a plane.
    Slice {
        /// Number of the region.
        region: usize,
        /// The axis across.
        axis: usize,
        /// Corners of the picture in the world: top left, top right, bottom right, bottom left [scene unit].
        corners: [[f64; 3]; 4],
        /// The index of the first and of the last colour.
        range: [f32; 2],
    },
}

/// The bytes of a picture's message.
pub fn message(header: &Header, jpeg: &[u8]) -> Vec<u8> {
    let header = serde_json::to_vec(header).unwrap_or_default(); // numbers and names: cannot fail
    let mut bytes = (header.len() as u32).to_le_bytes().to_vec();
    bytes.extend(&header);
    bytes.extend(jpeg);
    bytes
}

//! Whether all pixels of a JPEG are there: decoders fill what is missing or overwritten with grey, and say nothing.
//!
//! A sequential JPEG is read code by code, without making pixels of the codes: its scans must hold exactly the blocks that
//! its size asks for. Of a progressive one the markers and the end are checked. Source: ITU-T T.81, annexes B, C and F.

mod check;
mod huffman;
mod marker;

pub use check::JpegFault;
pub(crate) use check::check;

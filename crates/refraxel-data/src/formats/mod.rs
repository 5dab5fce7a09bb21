//! Importers: one module per file format, each from its files to a [`ParsedDataset`](crate::parsed::ParsedDataset).

mod beside;
pub(crate) mod colmap;
pub(crate) mod gaussians;
mod gravity;
mod lens;
pub(crate) mod llff;
pub(crate) mod lzfse;
pub(crate) mod metashape;
pub(crate) mod npy;
pub(crate) mod npz;
pub(crate) mod nsvf;
pub(crate) mod opensfm;
mod others;
pub(crate) mod ply;
pub(crate) mod polycam;
pub(crate) mod realitycapture;
pub(crate) mod recognise;
pub(crate) mod record3d;
pub(crate) mod transforms;

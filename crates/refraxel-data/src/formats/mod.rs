//! Importers: one module per file format, each from its files to a [`ParsedDataset`](crate::parsed::ParsedDataset).

pub(crate) mod colmap;
mod folder;
pub(crate) mod llff;
pub(crate) mod npy;
pub(crate) mod npz;
pub(crate) mod nsvf;
pub(crate) mod ply;
pub(crate) mod transforms;

pub(crate) use folder::names;

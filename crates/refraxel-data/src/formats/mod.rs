//! Importers: one module per file format, each from its files to a [`Draft`](crate::draft::Draft).

pub(crate) mod colmap;
pub(crate) mod transforms;

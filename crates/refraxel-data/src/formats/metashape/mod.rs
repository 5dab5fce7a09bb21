//! Cameras of Agisoft Metashape (PhotoScan) as it exports them in XML.

mod chunk;
mod element;
mod read;
mod sensor;

pub(crate) use read::{find, is_cameras, read};

//! What a phone, the estimation of its poses and a segmenter do to exact pictures.
//!
//! Each imperfection can be left out, and draws its own random numbers: without it, the others stay as they are. All of
//! them depend on seed and view only, never on the order in which views are made.

mod imperfection;
mod lens;
mod pose;
mod sensor;
mod silhouette;

pub use imperfection::{Imperfection, Imperfections, UnknownImperfection};
pub use lens::LENS_RADIUS;
pub use pose::{POSITION_ERROR, TURN_ERROR};
pub use sensor::{EXPOSURE, JPEG_QUALITY, READ_NOISE, WHITE_ELECTRONS};
pub use silhouette::WANDER;

pub(super) use lens::lens_of;
pub(super) use pose::estimated;
pub(super) use sensor::{Sensor, developed};
pub(super) use silhouette::{MaskOf, drawn, mask_of, seen};

//! `transforms.json` in the dialects of NeRF-synthetic (Blender), nerfstudio and instant-ngp.
//!
//! `transform_matrix` is camera-to-world with OpenGL camera axes. Intrinsics may stand at the file or at a frame.

mod camera;
mod frame;
mod read;
mod region;
mod scannetpp;
mod unused;

pub(crate) use read::{find_other, read_blender, read_single, read_with_held_out};
pub(crate) use scannetpp::{read_scannetpp, scannetpp};

//! A dataset on disk, in the layout of NeRF-synthetic with ground truth beside it.
//!
//! ```text
//! transforms_{train,val,test}.json   camera-to-world, OpenGL axes; file_path without extension; background
//! transforms_test_bg.json            the same cameras as test for the twins
//! {train,val,test}/r_I.png           sRGB, 8 bits
//! test_bg/r_I.png                    the test views with everything refractive taken away
//! masks/SPLIT/r_I.png                coverage of the refractive object as first thing seen, 255 = all
//! depth/SPLIT/r_I.png                16 bits, 1e-4 scene units along the optical axis, 0 = background
//! normals/SPLIT/r_I.png              16 bits, 65535 (n + 1) / 2 in world axes, 0 = background
//! exr/SPLIT/r_I.exr                  linear 32-bit float, on request
//! scene.json                         shapes, indices, box, background, protocol
//! index.npz                          n[x, y, z] at cell centres (f32), with `min` and `max` of the grid
//! contact.png                        a few test views: picture, twin, mask, normals
//! manifest.json                      parameters and state of the run
//! ```
//!
//! Photographs of a room have the layout of nerfstudio:
//!
//! ```text
//! transforms{,_train,_test}.json     all, training and test photographs: intrinsics, file, mask, camera-to-world as estimated
//! {train,test}/r_I.jpg               sRGB, 8 bits; .png without the imperfection jpeg
//! masks/SPLIT/r_I.png                white where a refractive body is the first thing seen
//! photographs.json                   what is true of each photograph: pose, gains of the sensor, whose mask
//! scene.json, index.npz, contact.png, manifest.json   as above
//! ```

mod contact;
mod files;
mod manifest;
mod npz;
mod options;
mod pictures;
mod synthesize;

pub use contact::contact_sheet;
#[cfg(test)]
pub(crate) use npz::npz_of_index;
pub use options::SynthOptions;
pub use pictures::DEPTH_UNIT;
pub use synthesize::{Progress, Summary, synthesize};

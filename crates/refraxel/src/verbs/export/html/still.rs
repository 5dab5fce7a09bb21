//! The picture for browsers without WebGPU, and the camera that takes it.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::interrupts::cancel;
use crate::verbs::loaded::Loaded;
use crate::viewer::{UP, start};
use image::codecs::jpeg::JpegEncoder;
use refraxel_core::Camera;
use refraxel_data::{Dataset, scene_region};
use refraxel_train::evaluation::render;
use refraxel_train::schedule::rendering_marching;

/// Longest edge of the picture for browsers without WebGPU [pixel], and its quality, 1 to 100.
const PICTURE: (u32, u8) = (800, 88);

/// Where the page begins: at the first photograph that was kept aside, or before the box.
pub(super) fn first_camera(run: &Loaded, data: Option<&Dataset>) -> Camera {
    let view =
        data.and_then(|d| d.split.test.iter().chain(&d.split.train).next().map(|&i| d.views[i].camera));
    let up = data.map_or(UP, |d| scene_region(d).up);
    // The lens of the page has no distortion.
    let camera = start(view, run.plan.finest.bounds.cast(), up).camera();
    camera.unwrap_or_else(|_| unreachable!("a camera that was made here"))
}

/// A JPEG file of what a camera sees.
pub(super) fn still(run: &Loaded, camera: &Camera) -> Result<Vec<u8>, Failure> {
    let (longest, quality) = PICTURE;
    let factor = f64::from(longest) / f64::from(camera.width.max(camera.height));
    let edge = |n: u32| ((f64::from(n) * factor).round() as u32).max(1);
    let camera = camera.resized(edge(camera.width), edge(camera.height));
    let marching = rendering_marching(&run.options, run.plan.near);
    let picture = render(&run.backend, &camera, &marching, &cancel()).or_exit(Exit::Interrupted)?;
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, quality)
        .encode(picture.colour.as_flattened(), picture.width, picture.height, image::ExtendedColorType::Rgb8)
        .or_exit(Exit::Io)?;
    Ok(jpeg)
}

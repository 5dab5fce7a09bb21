//! A sheet of small pictures that shows a scene at a glance.

use super::pictures::{mask_picture, normal_picture, sheet};
use crate::image::Image;
use crate::synth::render::{Sampling, render_view};
use crate::synth::scene::Scene;
use refraxel_core::Camera;

/// A few views of a scene for people: pictures, twins without refraction, masks and normals, one row each.
pub fn contact_sheet(scene: &Scene, cameras: &[Camera], sampling: &Sampling) -> Image {
    const COLUMNS: usize = 5;
    const EDGE: u32 = 240; // pixel; no larger than the pictures
    let twin = scene.without_refraction();
    let mut rows = vec![Vec::new(); 4];
    for (i, camera) in cameras.iter().take(COLUMNS).enumerate() {
        let width = EDGE.min(camera.width);
        let camera = camera.resized(width, width * camera.height / camera.width);
        let frame = render_view(scene, &camera, i as u64, sampling);
        rows[0].push(frame.image());
        rows[1].push(render_view(&twin, &camera, i as u64, sampling).image());
        rows[2].push(mask_picture(&frame.mask()));
        rows[3].push(normal_picture(&frame));
    }
    sheet(&rows, 4)
}

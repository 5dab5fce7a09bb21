//! What was found, as masks of the views.

use super::photographs::coarse;
use crate::model::Gate;
use crate::rays::{RaySampler, cells, pixel_ray};
use rayon::prelude::*;
use refraxel_core::Camera;
use refraxel_data::Mask;

/// Rays that project what was found into a view, about.
const PROJECTED: f64 = 1e5;

/// What was found, as masks of the views that have none.
pub(crate) fn masks(found: &[Gate], sampler: &RaySampler) -> Vec<Option<Mask>> {
    let project = |camera: &Camera| {
        let pixels = f64::from(camera.width) * f64::from(camera.height);
        mask(found, camera, (pixels / PROJECTED).sqrt().max(1.0))
    };
    let views = sampler.pictures().zip(sampler.given_cameras());
    views.map(|(picture, given)| picture.mask().is_none().then(|| project(given))).collect()
}

/// The mask of what was found in a view, in squares of `edge` pixels. What stands before it is not left out.
pub fn mask(found: &[Gate], camera: &Camera, edge: f64) -> Mask {
    let (width, height) = (camera.width, camera.height);
    let coarse = coarse(camera, edge);
    let (across, down) = (coarse.width as usize, coarse.height as usize);
    let covers =
        |cell: usize| pixel_ray(&coarse, cell).is_some_and(|ray| found.iter().any(|gate| gate.admits(&ray)));
    let covered: Vec<u8> =
        (0..across * down).into_par_iter().map(|c| if covers(c) { 255 } else { 0 }).collect();
    let coverage = cells([width as usize, height as usize], [across, down]).map(|(cell, _)| covered[cell]);
    Mask { width, height, coverage: coverage.collect() }
}

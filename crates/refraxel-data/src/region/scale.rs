//! Whether a box is of the scale of a scene.

use refraxel_core::Aabb;

/// Boxes in a scene have longest edges from `1 / SCALE` to `SCALE` times that of the scene: smaller than a pixel, and far
/// beyond what photographs show.
const SCALE: f64 = 1000.0;

/// A box that is out of scale with the scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "{what} reaches {found}, out of scale with the scene's box {scene}; expected a longest edge from 1/{SCALE} to {SCALE} times \
     that of the scene, and a middle within as many of them; check its unit of length and its place",
    found = corners(found),
    scene = corners(scene)
)]
pub struct OutOfScale {
    what: &'static str,
    found: Aabb<f64>,
    scene: Aabb<f64>,
}

/// The corners of a box, to thousandths of its size, so that they differ where the box is far from the origin.
fn corners(bounds: &Aabb<f64>) -> String {
    let decimals = 3.0 - bounds.extent().map(f64::abs).max_element().log10().floor();
    let decimals = if decimals.is_finite() { decimals.clamp(0.0, 300.0) as usize } else { 3 };
    let rounded = |v: f64| format!("{v:.decimals$}").parse().unwrap_or(v);
    let [low, high] = [bounds.min, bounds.max].map(|c| c.to_array().map(rounded));
    format!("from {low:?} to {high:?}")
}

/// Refuses a box, called `what` in the message, that is out of scale with the box of the scene.
pub fn check_scale(what: &'static str, found: &Aabb<f64>, scene: &Aabb<f64>) -> Result<(), OutOfScale> {
    let unit = scene.extent().max_element();
    let is_sized = (unit / SCALE..=unit * SCALE).contains(&found.extent().max_element());
    let is_near = (found.center() - scene.center()).map(f64::abs).max_element() <= unit * SCALE;
    let fits = is_sized && is_near && found.extent().min_element() >= 0.0;
    fits.then_some(()).ok_or(OutOfScale { what, found: *found, scene: *scene })
}

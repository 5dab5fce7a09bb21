//! The index of refraction in a plane across an axis.

use super::error::SceneError;
use super::photographs::encode;
use super::protocol::Header;
use super::scene::Scene;
use crate::colour_map::ColourMap;
use rayon::prelude::*;
use refraxel_core::Vec3;
use refraxel_train::Backend;
use refraxel_train::model::index_edit::index_range;

/// Pixels of the longer edge.
const PIXELS: f64 = 240.0;
/// What the picture shows around a region's box, in its size.
const MARGIN: f64 = 0.05;
const QUALITY: u8 = 90;

/// The index in a plane across `axis`, `at` from the lower to the upper end of a region's box: header and JPEG file.
pub fn slice(scene: &Scene, region: usize, axis: usize, at: f64) -> Result<(Header, Vec<u8>), SceneError> {
    let regions = scene.learned().medium.regions();
    let found = regions.get(region).ok_or(SceneError::Region { found: region, count: regions.len() })?;
    if axis > 2 || !(0.0..=1.0).contains(&at) {
        let why = format!("slice: found axis {axis} at {at}; expected 0, 1 or 2 between 0 and 1");
        return Err(SceneError::Look(why));
    }
    let bounds = found.domain().bounds.cast::<f64>();
    let (right, up) = [(1, 2), (0, 2), (0, 1)][axis];
    let extent = bounds.extent() * (1.0 + 2.0 * MARGIN);
    let low = bounds.min - bounds.extent() * MARGIN;
    let unit = extent[right].max(extent[up]) / PIXELS;
    let size = [right, up].map(|a| (extent[a] / unit).round().clamp(1.0, PIXELS) as u32);
    let point = |u: f64, v: f64| {
        let mut x = Vec3::zero();
        x[axis] = bounds.min[axis] + at * bounds.extent()[axis];
        x[right] = low[right] + u * extent[right];
        x[up] = low[up] + (1.0 - v) * extent[up];
        x
    };
    let medium = scene.backend().medium();
    let [least, most] = index_range(medium);
    let range = [least, most.max(least + 1e-3)];
    let colour = |i: u32| {
        let [u, v] = [i % size[0], i / size[0]].map(|k| f64::from(k) + 0.5);
        let n = medium.index(point(u / f64::from(size[0]), v / f64::from(size[1])).cast());
        ColourMap::Viridis.at((n - range[0]) / (range[1] - range[0]))
    };
    let pixels: Vec<[u8; 3]> = (0..size[0] * size[1]).into_par_iter().map(colour).collect();
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        .map(|[u, v]| scene.origin().to_world(point(u, v)).to_array());
    Ok((Header::Slice { region, axis, corners, range }, encode(pixels.as_flattened(), size, QUALITY)))
}

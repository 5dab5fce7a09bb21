//! Where the scene is: a box from cameras, points and pictures, so that the user need not draw one.

mod axes;
mod content;
mod forward;

use crate::{Backdrop, Dataset};
use axes::Capture;
use refraxel_core::{Aabb, Camera, Projection, Ray, Vec3, vec3};

/// The part of the world that a reconstruction should fill with voxels, in the data's own coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    /// The box.
    pub bounds: Aabb<f64>,
    /// Unit vector: what the data or somebody says, or the mean of the cameras' upward directions.
    pub up: Vec3<f64>,
    /// True when photographs show things beyond the box too.
    pub unbounded: bool,
    /// The frame of the grid, where all cameras of an unbounded capture look one way.
    pub projection: Option<Projection>,
}

/// Half-size of the box of an unbounded scene in median camera distances: cameras on a ring stand well outside.
const UNBOUNDED_HALF_SIZE: f64 = 0.55;
/// What views see whole is larger than this, in camera distances: far above rounding.
const LEAST_RADIUS: f64 = 1e-6;
/// Points counted as the subject of an unbounded capture lie nearer to the centre than this many camera distances.
const SUBJECT_RADIUS: f64 = 1.0;
/// Fewest points that describe a subject.
const MIN_POINTS: usize = 100;
/// Added on each side of a box made of points, in its size.
const POINT_MARGIN: f64 = 0.1;

/// The region of a dataset from its cameras and, where present, points; a stated box is used as it is.
///
/// Bounded scenes (transparent or one-coloured backdrop): the cube around the largest sphere that half of the views see
/// whole. It contains everything that stands free in most pictures; [`Region::around_content`] shrinks it to what the
/// pictures really show. Unbounded scenes: the box of the subject's points, or a cube within the ring of cameras.
pub fn scene_region(data: &Dataset) -> Region {
    let cameras: Vec<&Camera> = data.views.iter().map(|view| &view.camera).collect();
    let capture = Capture::of(&cameras);
    let unbounded = data.backdrop == Backdrop::Surroundings;
    let bounds = data.stated_box.unwrap_or_else(|| match (unbounded, subject(&capture, &data.points)) {
        (true, Some(bounds)) => bounds,
        (true, None) => match data.depth_range {
            Some(range) if capture.kind == axes::Kind::Forward => frustum(capture.middle(&cameras), range),
            _ => cube(
                capture.center,
                (UNBOUNDED_HALF_SIZE * capture.distance).min(clear_half_size(&cameras, &capture)),
            ),
        },
        (false, _) => cube(capture.center, visible_radius(&cameras, &capture)),
    });
    let is_open = unbounded && data.stated_box.is_none();
    let projection =
        is_open.then(|| forward::projection(&cameras, capture.up, &data.points, data.depth_range)).flatten();
    Region { bounds, up: data.up.unwrap_or(capture.up), unbounded, projection }
}

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

/// The corners of a box, to four digits.
fn corners(bounds: &Aabb<f64>) -> String {
    let rounded = |v: f64| format!("{v:.3e}").parse().unwrap_or(v);
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

fn cube(center: Vec3<f64>, half: f64) -> Aabb<f64> {
    Aabb::new(center - Vec3::splat(half), center + Vec3::splat(half))
}

/// Half-size of the largest cube that nine in ten cameras stand outside of; without bound for outward captures.
fn clear_half_size(cameras: &[&Camera], capture: &Capture) -> f64 {
    let norm = |c: &&Camera| (c.world_from_camera.translation - capture.center).map(f64::abs).max_element();
    let inside = capture.kind == axes::Kind::Outward;
    if inside { f64::INFINITY } else { quantile(cameras.iter().map(norm), 0.1) }
}

/// The 2nd to 98th percentile of the points near the centre, with a margin.
fn subject(capture: &Capture, points: &[Vec3<f64>]) -> Option<Aabb<f64>> {
    let near = |p: &&Vec3<f64>| (**p - capture.center).length() < SUBJECT_RADIUS * capture.distance;
    let near: Vec<&Vec3<f64>> = points.iter().filter(near).collect();
    if near.len() < MIN_POINTS {
        return None;
    }
    let percentile = |axis: usize, q: f64| quantile(near.iter().map(|p| p[axis]), q);
    let min = vec3(percentile(0, 0.02), percentile(1, 0.02), percentile(2, 0.02));
    let max = vec3(percentile(0, 0.98), percentile(1, 0.98), percentile(2, 0.98));
    let margin = (max - min) * POINT_MARGIN;
    ((max - min).min_element() > 0.0).then(|| Aabb::new(min - margin, max + margin))
}

/// The box of what one camera of a forward-facing capture sees between two depths.
fn frustum(camera: &Camera, range: [f64; 2]) -> Aabb<f64> {
    let mut bounds = Aabb::empty();
    for ray in border(camera) {
        let cosine = ray.direction.dot(camera.forward()).max(0.1);
        range.into_iter().for_each(|depth| bounds.include(ray.at(depth / cosine)));
    }
    bounds
}

/// Median over the views of the radius around the centre up to which the view sees everything, kept clear of the
/// nearest cameras.
fn visible_radius(cameras: &[&Camera], capture: &Capture) -> f64 {
    let seen = cameras.iter().map(|camera| {
        let distance = |ray: Ray<f64>| {
            let along = (capture.center - ray.origin).dot(ray.direction).max(0.0);
            (ray.at(along) - capture.center).length()
        };
        border(camera).map(distance).fold(f64::INFINITY, f64::min)
    });
    let nearest =
        quantile(cameras.iter().map(|c| (c.world_from_camera.translation - capture.center).length()), 0.05);
    let radius = quantile(seen.filter(|r| r.is_finite()), 0.5).min(0.95 * nearest);
    // Cameras that look around from the centre see nothing there.
    if radius > LEAST_RADIUS * capture.distance { radius } else { capture.distance }
}

/// Rays through the border of the image, corners included.
fn border(camera: &Camera) -> impl Iterator<Item = Ray<f64>> + '_ {
    const STEPS: usize = 8; // per side
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    (0..STEPS).flat_map(move |i| {
        let t = i as f64 / STEPS as f64;
        let around = [[t * w, 0.0], [w, t * h], [w - t * w, h], [0.0, h - t * h]];
        around.into_iter().filter_map(|[u, v]| camera.ray(u, v))
    })
}

/// The q-quantile of some numbers (nearest rank); 0 for none.
pub(crate) fn quantile(values: impl Iterator<Item = f64>, q: f64) -> f64 {
    let mut sorted: Vec<f64> = values.collect();
    sorted.sort_by(f64::total_cmp);
    let rank = (q * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(rank).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_order_statistics() {
        let values = [5.0, 1.0, 3.0, 2.0, 4.0];
        assert_eq!([0.0, 0.5, 1.0].map(|q| quantile(values.into_iter(), q)), [1.0, 3.0, 5.0]);
        assert_eq!(quantile([].into_iter(), 0.5), 0.0);
    }

    #[test]
    fn the_visible_radius_is_the_distance_to_the_side_of_the_frustum() {
        let eye = vec3(4.0, 0.0, 0.0);
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [100, 100]);
        let cameras = [&camera; 3];
        let capture = Capture { center: Vec3::zero(), distance: 4.0, up: eye, kind: axes::Kind::Inward };
        let radius = visible_radius(&cameras, &capture);
        assert!((radius - 4.0 * 0.35_f64.sin()).abs() < 1e-9);
    }
}

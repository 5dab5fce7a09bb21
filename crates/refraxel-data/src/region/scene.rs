//! The region of a scene, from cameras, points and what the data states.

use super::axes::{Capture, Kind};
use super::border::border;
use super::forward::projection;
use super::quantile::quantile;
use crate::{Backdrop, Dataset, Problem, View};
use refraxel_core::{Aabb, Camera, Extent, Projection, Ray, Vec3, vec3};

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

impl Region {
    /// How far a grid reaches that fills it.
    pub fn extent(&self) -> Extent {
        match self.projection {
            Some(projection) => Extent::Projective(projection),
            None if self.unbounded => Extent::Contracted,
            None => Extent::Bounded,
        }
    }
}

/// Whether a camera stands in a box, or a point of a lattice in it is in the picture.
pub fn sees_box(camera: &Camera, bounds: &Aabb<f64>) -> bool {
    const SIDE: usize = 5;
    let at = |k: usize| {
        let share = [k % SIDE, k / SIDE % SIDE, k / SIDE / SIDE].map(|n| n as f64 / (SIDE - 1) as f64);
        bounds.min + bounds.extent().hadamard(Vec3::from(share))
    };
    bounds.contains(camera.world_from_camera.translation)
        || (0..SIDE.pow(3)).any(|k| camera.project_into(at(k)).is_some())
}

/// A warning about a stated box of which hardly any photograph shows anything, as one in other coordinates.
pub(crate) fn unseen(bounds: &Aabb<f64>, views: &[View]) -> Option<Problem> {
    /// A box around what is photographed is seen by more than one view in so many.
    const FEW: usize = 4;
    let seen = views.iter().filter(|view| sees_box(&view.camera, bounds)).count();
    let found = if seen == 0 {
        "no photograph shows".to_owned()
    } else {
        format!("only {seen} of {} photographs show", views.len())
    };
    (FEW * seen < views.len()).then(|| {
        Problem::warning(format!(
            "{found} anything of the box that the dataset states: it may be in other coordinates than the cameras; correct it, or take it \
             out of the file"
        ))
    })
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
            Some(range) if capture.kind == Kind::Forward => frustum(capture.middle(&cameras), range),
            _ => Aabb::cube_at(
                capture.center,
                (UNBOUNDED_HALF_SIZE * capture.distance).min(clear_half_size(&cameras, &capture)),
            ),
        },
        (false, _) => Aabb::cube_at(capture.center, visible_radius(&cameras, &capture)),
    });
    let is_open = unbounded && data.stated_box.is_none();
    let projection =
        is_open.then(|| projection(&cameras, capture.up, &data.points, data.depth_range)).flatten();
    Region { bounds, up: data.up.unwrap_or(capture.up), unbounded, projection }
}

/// Half-size of the largest cube that nine in ten cameras stand outside of; without bound for outward captures.
fn clear_half_size(cameras: &[&Camera], capture: &Capture) -> f64 {
    let norm = |c: &&Camera| (c.world_from_camera.translation - capture.center).map(f64::abs).max_element();
    let inside = capture.kind == Kind::Outward;
    if inside { f64::INFINITY } else { quantile(cameras.iter().map(norm), 0.1).unwrap_or(0.0) }
}

/// The 2nd to 98th percentile of the points near the centre, with a margin.
fn subject(capture: &Capture, points: &[Vec3<f64>]) -> Option<Aabb<f64>> {
    let near = |p: &&Vec3<f64>| (**p - capture.center).length() < SUBJECT_RADIUS * capture.distance;
    let near: Vec<&Vec3<f64>> = points.iter().filter(near).collect();
    if near.len() < MIN_POINTS {
        return None;
    }
    let percentile = |axis: usize, q: f64| quantile(near.iter().map(|p| p[axis]), q).unwrap_or(0.0);
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
    let away = cameras.iter().map(|c| (c.world_from_camera.translation - capture.center).length());
    let nearest = quantile(away, 0.05).unwrap_or(0.0);
    let radius = quantile(seen.filter(|r| r.is_finite()), 0.5).unwrap_or(0.0).min(0.95 * nearest);
    // Cameras that look around from the centre see nothing there.
    if radius > LEAST_RADIUS * capture.distance { radius } else { capture.distance }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_visible_radius_is_the_distance_to_the_side_of_the_frustum() {
        let eye = vec3(4.0, 0.0, 0.0);
        let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [100, 100]);
        let cameras = [&camera; 3];
        let capture = Capture { center: Vec3::zero(), distance: 4.0, up: eye, kind: Kind::Inward };
        let radius = visible_radius(&cameras, &capture);
        assert!((radius - 4.0 * 0.35_f64.sin()).abs() < 1e-9);
    }
}

//! What refractive things stand on.
//!
//! No silhouette shows the underside of a thing: below it every view still looks through its mask, and the visual hull
//! grows a root into the ground. The ground is known, though, from around the thing.

use super::silhouettes::occluders;
use crate::backend::{Backend, Marching};
use crate::model::polyhedron::Plane;
use crate::random::Random;
use crate::rays::pixel_ray;
use crate::silhouettes::Silhouette;
use refraxel_core::{Aabb, Camera, LevelSet, Ray, Vec3};
use refraxel_data::is_white;

/// Rays that look for it, of all views, about.
const RAYS: usize = 40_000;
/// How far around a body its ground is sought, in sizes of its box.
const AROUND: f32 = 1.4;
/// Planes tried.
const TRIALS: u64 = 400;
/// Least share of the points around that a plane must explain; 0.25 to 0.57 lie on the ground where there is one.
const EXPLAINED: f64 = 0.2;
/// Largest share of them that may lie below it: cameras above the ground see nothing there.
const BELOW: f64 = 0.05;
/// They lie below it from this distance on [voxel].
const CLEARLY: f32 = 3.0;
/// Least share of the hull that must stand above it. The root of a flat thing is larger than the thing.
const ABOVE: f64 = 0.1;
/// How far points may lie off it [voxel of the field]: further where haze blurs what stands behind it.
const HAZY: [f32; 2] = [1.0, 2.0];
/// Points that decide; more are thinned.
const POINTS: usize = 4000;

/// The opaque surfaces that straight rays have learned.
pub(crate) struct Ground {
    points: Vec<Vec3<f32>>,
    /// Mean of the cameras.
    eye: Vec3<f32>,
    voxel: f32,
}

impl Ground {
    /// What rays beside masks meet: all that they meet, since haze hangs before nearly everything at first.
    pub(super) fn new(backend: &dyn Backend, silhouettes: &[Silhouette], marching: &Marching) -> Self {
        let mut points = Vec::new();
        let pixels: usize = silhouettes.iter().map(|s| s.mask.coverage.len()).sum();
        let stride = pixels.div_ceil(RAYS) | 1; // odd: other columns in each row
        for s in silhouettes {
            let pixels = (0..s.mask.coverage.len()).step_by(stride);
            let beside: Vec<usize> = pixels.filter(|p| !is_white(s.mask.coverage[*p])).collect();
            let met = occluders(backend, &s.camera, &beside, marching);
            points.extend(beside.iter().zip(met).filter(|(_, d)| d.is_finite()).filter_map(|(pixel, d)| {
                let ray: Ray<f32> = pixel_ray(&s.camera, *pixel)?;
                Some(ray.at(d))
            }));
        }
        Self::of(points, silhouettes.iter().map(|s| &s.camera), backend.domain().voxel())
    }

    /// Opaque surfaces at these points, which some cameras see; they err by a voxel.
    pub(crate) fn of<'a>(
        points: Vec<Vec3<f32>>,
        cameras: impl ExactSizeIterator<Item = &'a Camera>,
        voxel: f32,
    ) -> Self {
        let count = cameras.len() as f32;
        let eye = cameras.fold(Vec3::zero(), |eye, c| eye + c.world_from_camera.translation.cast() / count);
        Self { points, eye, voxel }
    }

    /// What a body stands on.
    pub(crate) fn under(&self, surface: &LevelSet<f32>) -> Option<Plane> {
        let nodes = surface.coefficients();
        let positions = (0..nodes.len()).filter(|&j| nodes[j] < 0.0).map(|j| surface.position(j));
        let inside: Vec<Vec3<f32>> = positions.collect();
        let near = widened(&surface.domain().bounds, AROUND);
        let around: Vec<Vec3<f32>> = self.points.iter().filter(|x| near.contains(**x)).copied().collect();
        HAZY.iter().find_map(|hazy| plane(&around, &inside, self.eye, hazy * self.voxel))
    }
}

/// The plane that most of the opaque points around a hull lie on and that the hull stands on: random samples of three
/// points (Fischler & Bolles 1981), `tolerance` [scene unit]. `eye` is the mean of the cameras, which look from above;
/// `inside` are points of the hull. `None` where no plane explains enough.
fn plane(around: &[Vec3<f32>], inside: &[Vec3<f32>], eye: Vec3<f32>, tolerance: f32) -> Option<Plane> {
    let thinned: Vec<Vec3<f32>> =
        around.iter().step_by(around.len().div_ceil(POINTS).max(1)).copied().collect();
    if thinned.len() < 30 || inside.is_empty() {
        return None;
    }
    let random = Random::new(0);
    let explained = |p: &Plane| thinned.iter().filter(|x| p.height(**x).abs() < tolerance).count();
    let point = |trial: u64, k: u64| thinned[random.below(thinned.len() as u64, trial, k) as usize];
    let candidates = (0..TRIALS).filter_map(|t| Plane::through(point(t, 0), point(t, 1), point(t, 2), eye));
    let (count, plane) = candidates.map(|p| (explained(&p), p)).max_by_key(|(count, _)| *count)?;
    let above = inside.iter().filter(|x| plane.height(**x) > -tolerance).count();
    let below = thinned.iter().filter(|x| plane.height(**x) < -CLEARLY * tolerance).count();
    let part = |count: usize, all: &[Vec3<f32>]| count as f64 / all.len() as f64;
    let is_ground = part(count, &thinned) >= EXPLAINED && part(below, &thinned) <= BELOW;
    (is_ground && part(above, inside) >= ABOVE).then_some(plane)
}

/// A box, `by` times as wide about its centre.
fn widened(bounds: &Aabb<f32>, by: f32) -> Aabb<f32> {
    let (center, half) = (bounds.center(), bounds.extent() * (0.5 * by));
    Aabb::new(center - half, center + half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    /// Points on a table at z = 0.3 with things on it, a thing that stands there with its root, and cameras above.
    fn table() -> (Vec<Vec3<f32>>, Vec<Vec3<f32>>) {
        let random = Random::new(3);
        let u = |i: u64, k: u64| random.uniform(i, k) as f32;
        let around = (0..900).map(|i| {
            let z = if i % 4 == 0 { 0.3 + u(i, 2) } else { 0.3 + 0.01 * (u(i, 2) - 0.5) };
            vec3(u(i, 0), u(i, 1), z)
        });
        let inside = (0..500).map(|i| vec3(u(i, 5), u(i, 6), 0.1 + u(i, 7)));
        (around.collect(), inside.collect())
    }

    #[test]
    fn the_table_is_found_among_the_things_on_it() {
        let (around, inside) = table();
        let found = plane(&around, &inside, vec3(0.0, 0.0, 3.0), 0.02).unwrap();
        assert!((found.height(vec3(0.5, 0.5, 1.3)) - 1.0).abs() < 0.02, "{found:?}");
    }

    #[test]
    fn a_flat_thing_stands_on_its_ground_though_most_of_its_hull_is_a_root() {
        let (around, inside) = table();
        let flat: Vec<_> = inside.iter().map(|x| vec3(x.x, x.y, 0.4 - (x.z - 0.1))).collect();
        let eye = vec3(0.0, 0.0, 3.0);
        let found = plane(&around, &flat, eye, 0.02).unwrap();
        assert!((found.height(vec3(0.5, 0.5, 1.3)) - 1.0).abs() < 0.02, "{found:?}");
        // The same plane half way up a room is a shelf.
        let room: Vec<_> = around.iter().chain(&inside).map(|x| vec3(x.x, x.y, x.z)).collect();
        let floor = inside.iter().map(|x| vec3(x.y, x.x, 0.0));
        let room: Vec<_> = room.into_iter().chain(floor.take(150)).collect();
        let found = plane(&room, &flat, eye, 0.02);
        assert!(found.is_none_or(|p| p.height(vec3(0.5, 0.5, 0.0)).abs() < 0.02), "{found:?}");
    }

    #[test]
    fn without_a_plane_or_with_the_hull_below_it_there_is_no_ground_plane() {
        let (around, inside) = table();
        let random = Random::new(4);
        let u = |i: u64, k: u64| random.uniform(i, k) as f32;
        let scattered: Vec<_> = (0..900).map(|i| vec3(u(i, 0), u(i, 1), u(i, 2))).collect();
        assert_eq!(plane(&scattered, &inside, vec3(0.0, 0.0, 3.0), 0.02), None);
        let hanging: Vec<_> = inside.iter().map(|x| *x - vec3(0.0, 0.0, 1.5)).collect();
        assert_eq!(plane(&around, &hanging, vec3(0.0, 0.0, 3.0), 0.02), None);
        assert_eq!(plane(&[], &inside, vec3(0.0, 0.0, 3.0), 0.02), None);
    }
}

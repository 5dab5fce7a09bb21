//! What stands around the glass in a glTF file: opaque things as points, and the cameras of the photographs.

use super::eyes::{fitted, turns};
use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::interrupts::cancel;
use crate::verbs::loaded::Loaded;
use rayon::prelude::*;
use refraxel_core::{Camera, Ray, Vec3};
use refraxel_data::Dataset;
use refraxel_train::Backend;
use refraxel_train::backend::Layers;
use refraxel_train::rays::pixel_ray;
use refraxel_train::schedule::rendering_marching;
use std::collections::HashSet;

/// Views from which points are seen, evenly spread over the photographs.
const VIEWS: usize = 32;
/// Pixels less opaque than this give no point.
const OPAQUE: f32 = 0.9;
/// Where the depth of a neighbouring pixel differs by more than this share, an edge lies between: its depth means nothing.
const EDGE: f32 = 0.03;
/// Points nearer than this to another one are left out [voxel].
const SPACING: f64 = 0.5;

/// What stands around the glass.
#[derive(Debug, Default)]
pub struct Surroundings {
    /// Points of opaque things.
    pub points: Vec<Point>,
    /// The cameras of the photographs in the world, by name.
    pub cameras: Vec<(String, Camera)>,
}

/// A point that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// World position [scene unit].
    pub place: Vec3<f64>,
    /// sRGB-encoded, 1 = white.
    pub colour: [f32; 3],
}

impl Surroundings {
    /// Those of a run, with at most so many points. Rays that turn are left out: what they see lies elsewhere.
    pub fn of(run: &Loaded, data: &Dataset, most: usize) -> Result<Self, Failure> {
        let names = data.views.iter().map(|v| v.name.clone());
        let cameras: Vec<(String, Camera)> = names.zip(run.alignment.cameras(data)).collect();
        let each = cameras.len().div_ceil(VIEWS).max(1);
        let shown: Vec<Camera> = cameras.iter().step_by(each).map(|(_, camera)| *camera).collect();
        let spacing = SPACING * f64::from(run.backend.domain().voxel());
        let (mut points, mut taken) = (Vec::new(), HashSet::new());
        if most > 0 {
            for camera in &shown {
                cancel().check().or_exit(Exit::Interrupted)?;
                points.extend(seen(run, &fitted(camera, 4 * most / shown.len())).into_iter().filter(|p| {
                    let cell = p.place.to_array().map(|x| (x / spacing).floor() as i64);
                    taken.insert(cell)
                }));
            }
        }
        // Evenly over all views, where there are too many.
        let every = points.len().div_ceil(most.max(1)).max(1);
        let origin = run.plan.origin;
        let points = points.into_iter().step_by(every);
        Ok(Self {
            points: points.map(|p| Point { place: origin.to_world(p.place), ..p }).collect(),
            cameras: cameras.into_iter().map(|(name, camera)| (name, origin.to_world(camera))).collect(),
        })
    }
}

/// The opaque points that a camera sees along straight rays.
fn seen(run: &Loaded, camera: &Camera) -> Vec<Point> {
    let backend = &run.backend;
    let (width, count) = (camera.width as usize, camera.width as usize * camera.height as usize);
    let rays: Vec<Option<Ray<f32>>> = (0..count)
        .into_par_iter()
        .map(|pixel| pixel_ray(camera, pixel).filter(|ray| !turns(run, ray)))
        .collect();
    let straight: Vec<Ray<f32>> = rays.iter().copied().flatten().collect();
    let marching = rendering_marching(&run.options, run.plan.near);
    let mut pixels = backend.render(&straight, &marching, Layers::All).into_iter();
    let shown: Vec<_> = rays.iter().map(|ray| ray.and_then(|ray| Some((ray, pixels.next()?)))).collect();
    let depth = |pixel: usize| {
        let (_, shown) = shown.get(pixel)?.as_ref()?;
        let opacity = 1.0 - shown.transmittance;
        (opacity > OPAQUE).then(|| shown.depth / opacity)
    };
    let point = |pixel: usize| {
        let (column, own) = (pixel % width, depth(pixel)?);
        let is_inside = column > 0 && column + 1 < width && pixel >= width && pixel + width < count;
        let is_near = |other| depth(other).is_some_and(|d| (d - own).abs() < EDGE * own);
        let is_whole =
            is_inside && [pixel - 1, pixel + 1, pixel - width, pixel + width].into_iter().all(is_near);
        let (ray, shown) = shown[pixel].filter(|_| is_whole)?;
        let place = ray.origin + ray.direction * own;
        Some(Point { place: place.cast(), colour: shown.colour })
    };
    (0..count).filter_map(point).collect()
}

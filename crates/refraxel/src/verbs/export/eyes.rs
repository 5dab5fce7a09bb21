//! The training photographs' cameras, asked what they see of a field: which voxels, how far away, in which colours.

use crate::exit::{Exit, Failure, OrExit};
use crate::verbs::interrupts::cancel;
use crate::verbs::loaded::Loaded;
use rayon::prelude::*;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Camera, Path, Ray, Vec3};
use refraxel_data::Dataset;
use refraxel_train::Backend;
use refraxel_train::backend::{Layers, Marching};
use refraxel_train::rays::pixel_ray;
use refraxel_train::schedule::rendering_marching;
use std::ops::Range;

/// Cameras that are asked, evenly spread over the photographs.
const MOST: usize = 64;
/// Rays of all of them together that find out what is seen.
const RAYS: usize = 600_000;
/// Rays of all of them together that find out how opaque surfaces are.
const FEW: usize = 10_000;
/// Cameras that are asked for the colour of a point, the ones that look at its surface most directly; where none of them sees it, the
/// next ones.
const ASKED: [Range<usize>; 2] = [0..2, 2..6];
/// Those that see a surface at a flatter angle are not asked: the sine of that angle [1].
const FLAT: f64 = 0.15;
/// A ray that is less opaque does not see a surface.
const OPAQUE: f32 = 0.5;
/// A ray that ends farther from a point than this does not see it [voxel].
const NEAR_BY: f64 = 3.0;
/// Points whose colours are asked for at a time.
const PORTION: usize = 1 << 16;

/// The cameras of a run's photographs.
pub(super) struct Eyes<'a> {
    run: &'a Loaded,
    marching: Marching,
    cameras: Vec<Camera>,
}

impl<'a> Eyes<'a> {
    /// Those of the training photographs.
    pub(super) fn of(run: &'a Loaded, data: &Dataset) -> Self {
        let all = run.alignment.cameras(data);
        let train = &data.split.train;
        let each = train.len().div_ceil(MOST).max(1);
        let cameras = train.iter().step_by(each).map(|&view| all[view]).collect();
        Self { run, marching: rendering_marching(&run.options, run.plan.near), cameras }
    }

    /// Largest share of a pixel's light that the samples around each voxel give to any camera, theory (4.11).
    pub(super) fn weights(&self) -> Result<Vec<f32>, Failure> {
        let rays: Vec<Ray<f32>> = self.cameras.iter().flat_map(|c| self.rays(c, RAYS)).collect();
        self.run.backend.peak_weights(&rays, &self.marching, &cancel()).or_exit(Exit::Interrupted)
    }

    /// A few rays that nothing bends.
    pub(super) fn straight_rays(&self) -> Vec<Ray<f32>> {
        let rays = self.cameras.par_iter().flat_map_iter(|camera| self.rays(camera, FEW));
        rays.filter(|ray| !turns(self.run, ray)).collect()
    }

    /// The colour (sRGB-encoded, 1 = white) of points of a surface, with their normals, towards the cameras that see them most
    /// directly; `None` where no camera does.
    pub(super) fn colours(
        &self,
        points: &[(Vec3<f64>, Vec3<f64>)],
    ) -> Result<Vec<Option<[f32; 3]>>, Failure> {
        let mut colours = Vec::with_capacity(points.len());
        for portion in points.chunks(PORTION) {
            cancel().check().or_exit(Exit::Interrupted)?;
            colours.extend(self.portion(portion));
        }
        Ok(colours)
    }

    fn portion(&self, points: &[(Vec3<f64>, Vec3<f64>)]) -> Vec<Option<[f32; 3]>> {
        let mut colours = vec![None; points.len()];
        for ranks in ASKED {
            let missing: Vec<usize> = (0..points.len()).filter(|&p| colours[p].is_none()).collect();
            let asked: Vec<Look> = missing
                .par_iter()
                .flat_map_iter(|&p| self.looks(p, points[p], ranks.clone()))
                .filter(|look| !turns(self.run, &look.ray))
                .collect();
            let rays: Vec<Ray<f32>> = asked.iter().map(|look| look.ray).collect();
            let shown = self.run.backend.render(&rays, &self.marching, Layers::All);
            let mut sums = vec![([0.0; 3], 0.0); points.len()];
            for (look, pixel) in asked.iter().zip(&shown) {
                if let Some(colour) = self.colour(look, pixel) {
                    let (sum, weights) = &mut sums[look.point];
                    (0..3).for_each(|c| sum[c] += look.weight * colour[c]);
                    *weights += look.weight;
                }
            }
            for (colour, (sum, weights)) in colours.iter_mut().zip(sums) {
                *colour = colour.or((weights > 0.0).then(|| sum.map(|c| c / weights)));
            }
        }
        colours
    }

    /// The rays of the cameras that may see a point, those of these ranks, the most direct one first.
    fn looks(&self, point: usize, (x, normal): (Vec3<f64>, Vec3<f64>), ranks: Range<usize>) -> Vec<Look> {
        let look = |camera: &Camera| {
            let origin = camera.world_from_camera.translation;
            let way = x - origin;
            let direction = way.normalized();
            let weight = -direction.dot(normal);
            let is_shown = weight > FLAT && camera.project_into(x).is_some();
            let distance = way.length();
            let ray = Ray { origin, direction }.cast();
            is_shown.then_some(Look { point, ray, distance, weight: weight as f32 })
        };
        let mut all: Vec<Look> = self.cameras.iter().filter_map(look).collect();
        all.sort_by(|a, b| b.weight.total_cmp(&a.weight));
        all.into_iter().take(ranks.end).skip(ranks.start).collect()
    }

    /// The colour that a ray shows, without the background, if it ends at the point that it was sent to.
    fn colour(&self, look: &Look, pixel: &Pixel<f32>) -> Option<[f32; 3]> {
        let Look { ray, distance, .. } = look;
        let (opacity, domain) = (1.0 - pixel.transmittance, self.run.backend.domain());
        let voxel = domain.node_jvp(ray.at(*distance as f32), ray.direction).length().recip();
        let off = (f64::from(pixel.depth / opacity) - distance).abs();
        let behind = self.run.backend.snapshot().model.background.radiance(ray.origin, ray.direction);
        let own = |c: usize| ((pixel.colour[c] - pixel.transmittance * behind[c]) / opacity).clamp(0.0, 1.0);
        (opacity > OPAQUE && off < NEAR_BY * f64::from(voxel)).then(|| [0, 1, 2].map(own))
    }

    /// Rays of a camera, its share of about so many.
    fn rays(&self, camera: &Camera, all: usize) -> Vec<Ray<f32>> {
        let camera = fitted(camera, all / self.cameras.len().max(1));
        let pixels = camera.width as usize * camera.height as usize;
        (0..pixels).filter_map(|pixel| pixel_ray(&camera, pixel)).collect()
    }
}

/// A ray that is sent to a point.
struct Look {
    point: usize,
    ray: Ray<f32>,
    /// From the camera to the point [scene unit].
    distance: f64,
    /// How directly it meets the surface [1].
    weight: f32,
}

/// Whether the medium of a run turns a ray.
pub(super) fn turns(run: &Loaded, ray: &Ray<f32>) -> bool {
    run.backend.medium().turns(ray, run.backend.domain(), &mut Path::default())
}

/// The camera with about so many pixels, but not more than it has.
pub(super) fn fitted(camera: &Camera, pixels: usize) -> Camera {
    let all = f64::from(camera.width) * f64::from(camera.height);
    let factor = (pixels as f64 / all).sqrt().min(1.0);
    let edge = |n: u32| ((f64::from(n) * factor) as u32).max(3);
    camera.resized(edge(camera.width), edge(camera.height))
}

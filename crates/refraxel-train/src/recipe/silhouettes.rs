//! Silhouettes of refractive things, with what hides them, and how many views must agree.

use super::{Known, RecipeError};
use crate::backend::{Backend, Layers, Marching};
use crate::events::{Task, Watch};
use crate::initial::{Outlines, Silhouette, Vote};
use crate::model::Gate;
use crate::options::Options;
use crate::rays::pixel_ray;
use crate::schedule::training_marching;
use refraxel_core::{Aabb, Camera, Domain, Extent, Ray};

/// Rays that look for what hides refractive things, at most about.
const OCCLUDER_RAYS: f64 = 5e5;
/// A ray is hidden from where it has lost this share of its light.
const OPAQUE: f32 = 0.5;
/// Shares of the views that must not find a place hidden, tried from the strictest on.
const LEAST: [f32; 6] = [0.9, 0.7, 0.5, 0.35, 0.2, 0.1];
/// A stricter share will do when its hull meets this part of the rays inside masks that the loosest one meets.
const COVERED: f64 = 0.98;

/// Cameras and masks, with what hides refractive things: the opaque surfaces that straight rays have learned.
pub(super) fn silhouettes(
    backend: &impl Backend,
    known: &Known,
    watch: &mut Watch,
) -> Result<Vec<Silhouette>, RecipeError> {
    // A ray that ends there tells the depth of what stands in front, however blurred, not of a wall far behind it.
    let marching =
        Marching { min_transmittance: 1.0 - OPAQUE, ..training_marching(known.options, known.near) };
    let pixels: usize = known.sampler.silhouettes().map(|(c, _)| (c.width * c.height) as usize).sum();
    let stride = (pixels as f64 / OCCLUDER_RAYS).sqrt().ceil().max(1.0) as u32;
    let views: Vec<_> = known.sampler.silhouettes().collect();
    let mut found = Vec::with_capacity(views.len());
    for (camera, mask) in &views {
        watch.progress(Task::FindingOccluders, found.len() as u64, views.len() as u64)?;
        let occluded_beyond = Some(occluders(backend, camera, stride, &marching));
        found.push(Silhouette { camera: **camera, mask: (*mask).clone(), occluded_beyond });
    }
    Ok(found)
}

/// Per pixel the distance beyond which something opaque hides everything, from the rays of every `stride`-th pixel.
fn occluders(backend: &impl Backend, camera: &Camera, stride: u32, marching: &Marching) -> Vec<f32> {
    let small = [camera.width.div_ceil(stride), camera.height.div_ceil(stride)];
    let sample = |k: u32, n: u32| (k * stride + stride / 2).min(n - 1);
    let at = |x: u32, y: u32| sample(y, camera.height) * camera.width + sample(x, camera.width);
    let places = (0..small[1]).flat_map(|y| (0..small[0]).map(move |x| (x, y)));
    let rays: Vec<Option<Ray<f32>>> = places.map(|(x, y)| pixel_ray(camera, at(x, y) as usize)).collect();
    let asked: Vec<Ray<f32>> = rays.iter().flatten().copied().collect();
    let mut pixels = backend.render(&asked, marching, Layers::All).into_iter();
    let hidden = rays.iter().map(|ray| {
        let seen = ray.and_then(|_| pixels.next())?;
        let opacity = 1.0 - seen.transmittance;
        (opacity > OPAQUE).then(|| seen.depth / opacity)
    });
    let hidden: Vec<f32> = hidden.map(|d| d.unwrap_or(f32::INFINITY)).collect();
    let all = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
    all.map(|(x, y)| hidden[(y / stride * small[0] + x / stride) as usize]).collect()
}

/// The strictest share of views that must not find a place hidden whose hull still covers what the masks show.
pub(super) fn vote(outlines: &Outlines, rays: &[Ray<f32>], bounds: &Aabb<f32>, options: &Options) -> Vote {
    let vote = |least: f32| Vote { share: options.shape.vote, least, ..Vote::default() };
    let domain = Domain::with_longest(*bounds, Extent::Bounded, 64);
    let covered = |least: f32| {
        let gate = Gate::new(domain, &outlines.hull(&domain, &vote(least)).fraction);
        rays.iter().filter(|r| gate.admits(r)).count()
    };
    let enough = COVERED * covered(LEAST[LEAST.len() - 1]) as f64;
    let strictest = LEAST.into_iter().find(|&least| covered(least) as f64 >= enough);
    vote(strictest.unwrap_or(LEAST[0]))
}

//! Where refractive things are.

use super::context::{Context, SearchError};
use super::ground::Ground;
use super::hull::Views;
use super::known::bodies;
use super::region::Region;
use super::silhouettes::{silhouettes, vote, without_gaps};
use crate::backend::Backend;
use crate::events::{Observer, Task};
use crate::level_set::half_full;
use crate::model::Gate;
use crate::options::StartShape;
use crate::rays::Selection;
use crate::schedule::training_marching;
use crate::silhouettes::{Outlines, Search, Site, Spacing};
use crate::verdict::StayReason;
use rayon::prelude::*;
use refraxel_core::{Aabb, LevelSet, Ray, Vec3};

/// Rays inside masks that say what a hull covers.
const RAYS: usize = 16_384;

/// Rays of a view that touch what its mask shows, at most about.
const TANGENTS: usize = 400;

/// Voxels of the index grid per pixel at a refractive region.
const VOXELS_PER_PIXEL: f32 = 0.7;

/// What regions are made of, and how finely.
impl Context<'_> {
    /// Grids of about [`VOXELS_PER_PIXEL`], or of `shape.resolution` nodes.
    fn spacing(&self, bounds: &Aabb<f32>) -> Spacing {
        let (shape, longest) = (&self.options.shape, bounds.extent().max_element());
        if shape.resolution > 0 {
            return Spacing::Voxel(longest / shape.resolution as f32);
        }
        let pixel = self.sampler.pixel_size(bounds.center());
        Spacing::Voxel((pixel / VOXELS_PER_PIXEL).max(longest / 160.0))
    }

    /// The grid around a box.
    fn site(&self, bounds: &Aabb<f32>) -> Site {
        Site::around(bounds, self.spacing(bounds), self.options.index.interpolation.into())
    }

    /// The ellipsoid in a box.
    fn ball(&self, b: &Aabb<f32>) -> Region {
        Region::body(self.site(b), |x| ball_distance(b, x))
    }

    /// The box itself.
    fn block(&self, b: &Aabb<f32>) -> Region {
        Region::body(self.site(b), |x| block_distance(b, x))
    }
}

/// What views say.
pub(super) struct Found {
    /// The regions and their shapes.
    pub regions: Vec<Region>,
    /// Rays that touch what is refractive, where masks show it.
    pub tangents: Vec<Ray<f32>>,
}

impl Found {
    fn of(regions: Vec<Region>) -> Self {
        Self { regions, tangents: Vec::new() }
    }
}

/// The regions and their shapes.
pub(super) fn find(
    backend: &dyn Backend,
    known: &Context,
    observer: &mut Observer,
) -> Result<Found, SearchError> {
    let (options, scene) = (known.options, backend.domain().bounds);
    let stated = options.refraction.local_box(known.origin);
    if let Some(source) = known.index {
        if let (None, Some(found)) = (stated, bodies(source, |b| known.site(b), options)) {
            return Ok(Found::of(found));
        }
        let site = known.site(&stated.unwrap_or_else(|| source.bounds().cast()));
        return Ok(Found::of(vec![Region::of_known(site, source)]));
    }
    match (options.shape.start, stated) {
        (StartShape::Uniform, bounds) => {
            Ok(Found::of(vec![Region::uniform(known.site(&bounds.unwrap_or(scene)))]))
        }
        (StartShape::Block, Some(b)) => Ok(Found::of(vec![known.block(&b)])),
        (StartShape::Ball, Some(b)) => Ok(Found::of(vec![known.ball(&b)])),
        (_, stated) => from_masks(backend, known, stated, observer),
    }
}

/// Regions where masks, and a box if there is one, say that something is.
fn from_masks(
    backend: &dyn Backend,
    known: &Context,
    stated: Option<Aabb<f32>>,
    observer: &mut Observer,
) -> Result<Found, SearchError> {
    let Context { sampler, options, .. } = *known;
    if sampler.is_one_place() {
        return Err(StayReason::OnePlace.into());
    }
    let scene = backend.domain().bounds;
    let silhouettes = silhouettes(backend, known, observer)?;
    observer.progress(Task::Carving, 0, 3)?;
    let outlines = Outlines::new(&silhouettes).cancelled_by(observer.cancel());
    let ground = Ground::new(backend, &silhouettes, &training_marching(options, known.near));
    if outlines.is_empty() {
        return Err(stated.map_or(SearchError::Nowhere, |_| StayReason::OnlyABox.into()));
    }
    let rays = sampler.batch(u64::MAX / 2, RAYS, Selection::Inside(1.0)).rays;
    let with_gaps = outlines;
    let outlines = without_gaps(&with_gaps, &stated.unwrap_or(scene));
    let vote = vote(&outlines, &stated.unwrap_or(scene), options);
    observer.progress(Task::Carving, 1, 3)?;
    let boxes = match stated {
        Some(bounds) => Ok(vec![bounds]),
        None => {
            let search = Search { vote, spacing: known.spacing(&scene), ..Search::default() };
            outlines.locate(&scene, &search)
        }
    };
    observer.progress(Task::Carving, 2, 3)?;
    let found = known.found.filter(|_| sampler.traces_found()).map(within);
    let found = found.as_ref();
    let views = Views { outlines: &outlines, with_gaps: &with_gaps, vote, rays: &rays, found };
    let region = |bounds: &Aabb<f32>| match options.shape.start {
        StartShape::Block => Ok(vec![known.block(bounds)]),
        StartShape::Ball => Ok(vec![known.ball(bounds)]),
        _ => Region::hulls(bounds, |b| known.site(b), &views, |s| ground.under(s), options),
    };
    let boxes = boxes.map_err(|e| StayReason::from(e.in_world(known.origin)))?;
    let regions = boxes.iter().map(region).collect::<Result<Vec<_>, _>>()?;
    observer.progress(Task::Carving, 3, 3)?;
    let tangents = outlines.tangents(TANGENTS).into_iter().flatten().map(|t| t.ray.cast()).collect();
    Ok(Found { regions: seen_by(&rays, regions.into_iter().flatten().collect()), tangents })
}

/// A region that less than this share of the rays inside masks meets is a crumb that the borders of rough masks have left.
const SEEN: f64 = 0.003;

/// The regions that rays inside masks meet: of others nothing can be learned, neither their index nor whether they bend rays.
fn seen_by(rays: &[Ray<f32>], regions: Vec<Region>) -> Vec<Region> {
    let met = |region: &Region| rays.par_iter().filter(|ray| region.meets(ray)).count();
    let least = SEEN * rays.len() as f64;
    let (seen, crumbs): (Vec<_>, Vec<_>) = regions.into_iter().partition(|r| met(r) as f64 >= least);
    if seen.is_empty() { crumbs } else { seen }
}

/// Signed distance from what was found, which lies within it: views from few sides leave a hull wider than the places on which they agree.
fn within(found: &Gate) -> LevelSet<f32> {
    let mut surface = half_full(found.domain(), |j| f32::from(found.values()[j]) / 255.0);
    surface.redistance();
    surface
}

/// Signed distance from the ellipsoid in a box, exact on its surface.
fn ball_distance(bounds: &Aabb<f32>, x: Vec3<f32>) -> f32 {
    let half = bounds.extent() * 0.5;
    ((x - bounds.center()).zip(half, |x, h| x / h).length() - 1.0) * half.min_element()
}

/// Signed distance from a box.
fn block_distance(bounds: &Aabb<f32>, x: Vec3<f32>) -> f32 {
    let q = (x - bounds.center()).map(f32::abs) - bounds.extent() * 0.5;
    q.map(|v| v.max(0.0)).length() + q.max_element().min(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Options;
    use refraxel_core::vec3;

    #[test]
    fn a_crumb_that_no_ray_inside_masks_meets_is_no_region() {
        let options = Options::default();
        let body = |middle: Vec3<f32>, radius: f32| {
            let bounds = Aabb::cube_at(middle, 0.5);
            let site =
                Site { bounds, resolution: [21; 3], interpolation: options.index.interpolation.into() };
            Region::body(site, |x| (x - middle).length() - radius)
        };
        let (glass, crumb) = (Vec3::zero(), vec3(0.0, 0.0, -2.0));
        let regions = || vec![body(glass, 0.3), body(crumb, 0.2)];
        let towards = |to: Vec3<f32>| {
            let from = vec3(4.0, 0.0, 0.0);
            Ray { origin: from, direction: (to - from).normalized() }
        };
        let seen = vec![towards(glass); 1000];
        assert_eq!(seen_by(&seen, regions()).len(), 1);
        let some = [seen.clone(), vec![towards(crumb); 10]].concat();
        assert_eq!(seen_by(&some, regions()).len(), 2);
        let none = vec![towards(vec3(0.0, 3.0, 0.0)); 10];
        assert_eq!(seen_by(&none, regions()).len(), 2, "nothing is known of any of them");
    }
}

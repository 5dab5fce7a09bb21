//! Where refractive things are, and their shapes.

use super::facets::{Face, faces, fills};
use super::ground::{plane, widened};
use super::{Profile, RecipeError, Start};
use crate::backend::{Backend, Marching};
use crate::cpu::CpuBackend;
use crate::initial::{Gate, Outlines, Search, Silhouette, Site, Spacing, Vote, gaussian_blur, region_grid};
use crate::options::{IndexIntegrator, Options, StartShape, Switch};
use crate::polyhedron::{Plane, Polyhedron};
use crate::rays::{RaySampler, Selection, pixel_ray};
use crate::refraction::RegionState;
use crate::schedule::training_marching;
use refraxel_core::{Aabb, Camera, Domain, Extent, IndexGrid, LevelSet, Ray, Vec3};
use refraxel_data::synth::{IndexTruth, Shape};
use refraxel_data::{IndexVolume, Mask, read_mesh};
use std::path::Path;

/// Every so many pixels are looked at for the ground.
const GROUND_STRIDE: usize = 7;
/// How far around a body its ground is sought, in sizes of its box.
const AROUND: f32 = 1.4;
/// Rays that look for what hides refractive things, at most about.
const OCCLUDER_RAYS: f64 = 5e5;
/// A ray is hidden from where it has lost this share of its light.
const OPAQUE: f32 = 0.5;
/// Steps and strength of the smoothing of a hull's surface, theory (2.32).
const SMOOTHING: (u32, f32) = (10, 0.6);
/// How far a body reaches into the ground that it stands on [voxel]: what lies there is not seen, but a gap above the
/// ground would be another surface.
const SUNK: f32 = 2.0;
/// Rays inside masks that say what a hull covers.
const RAYS: usize = 16_384;
/// Shares of the views that must not find a place hidden, tried from the strictest on.
const LEAST: [f32; 6] = [0.9, 0.7, 0.5, 0.35, 0.2, 0.1];
/// A stricter share will do when its hull meets this part of the rays inside masks that the loosest one meets.
const COVERED: f64 = 0.98;

/// A refractive region before it has an index.
pub(super) struct Region {
    site: Site,
    /// Signed distance from the surface, negative inside; absent where the shape is not a body.
    surface: Option<LevelSet<f32>>,
    /// n at the nodes where a file gives it.
    known: Option<Vec<f32>>,
    /// Share of each node's voxel inside, 0 to 1, blurred.
    occupancy: Vec<f32>,
    /// φ of the surface at the nodes; empty without one.
    distance: Vec<f32>,
    free: Vec<bool>,
    gate: Option<Gate>,
    /// The planes of its surface, where they are all of it.
    solid: Option<Polyhedron>,
}

/// What `index_from` names.
pub(super) enum IndexSource {
    Truth(IndexTruth),
    Volume(IndexVolume),
    Mesh(Shape),
}

/// The regions and their shapes.
pub(super) fn find(
    backend: &CpuBackend,
    sampler: &RaySampler,
    options: &Options,
    near: f32,
) -> Result<Vec<Region>, RecipeError> {
    let scene = backend.field().domain.bounds;
    let index_source = index_source(options)?;
    let spacing = |bounds: &Aabb<f32>| Spacing::Voxel(voxel(sampler, options, bounds));
    let site = |bounds: &Aabb<f32>| {
        let (bounds, resolution) = region_grid(bounds, spacing(bounds));
        Site { bounds, resolution, interpolation: options.index.interpolation.into() }
    };
    let stated = options.refraction.aabb().or_else(|| index_source.as_ref().map(IndexSource::bounds));
    if let Some(index_source) = &index_source {
        let bounds = stated.unwrap_or(scene);
        return Ok(vec![Region::index_source(site(&bounds), index_source, options)]);
    }
    match (options.shape.start, stated) {
        (StartShape::Uniform, bounds) => Ok(vec![Region::uniform(site(&bounds.unwrap_or(scene)))]),
        (StartShape::Block, Some(b)) => Ok(vec![Region::body(site(&b), |x| block_distance(&b, x), options)]),
        (StartShape::Ball, Some(b)) => Ok(vec![Region::body(site(&b), |x| ball_distance(&b, x), options)]),
        (shape, stated) => {
            let silhouettes = silhouettes(backend, sampler, options, near);
            let outlines = Outlines::new(&silhouettes);
            let ground = Ground::new(&silhouettes, backend.field().domain.voxel());
            if outlines.is_empty() {
                let bounds = stated.ok_or(RecipeError::Nowhere)?;
                return Ok(vec![Region::body(site(&bounds), |x| ball_distance(&bounds, x), options)]);
            }
            let rays = sampler.batch(u64::MAX / 2, RAYS, Selection::Inside(1.0)).rays;
            let vote = vote(&outlines, &rays, &stated.unwrap_or(scene), options);
            let boxes = match stated {
                Some(bounds) => vec![bounds],
                None => {
                    let search = Search { vote, spacing: spacing(&scene), ..Search::default() };
                    outlines.locate(&scene, &search)?
                }
            };
            let region = |bounds: &Aabb<f32>| match shape {
                StartShape::Block => Region::body(site(bounds), |x| block_distance(bounds, x), options),
                StartShape::Ball => Region::body(site(bounds), |x| ball_distance(bounds, x), options),
                _ => Region::hull(site(bounds), (&outlines, &vote, &rays), |s| ground.under(s), options),
            };
            Ok(boxes.iter().map(region).collect())
        }
    }
}

/// Edge length of a region's voxels [scene unit].
fn voxel(sampler: &RaySampler, options: &Options, bounds: &Aabb<f32>) -> f32 {
    let longest = bounds.extent().max_element();
    if options.shape.resolution > 0 {
        return longest / options.shape.resolution as f32;
    }
    let pixel = sampler.pixel_size(bounds.center());
    (pixel / options.shape.voxels_per_pixel as f32).max(longest / 160.0)
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

/// The strictest share of views that must not find a place hidden whose hull still covers what the masks show.
fn vote(outlines: &Outlines, rays: &[Ray<f32>], bounds: &Aabb<f32>, options: &Options) -> Vote {
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

/// Cameras and masks, with what hides refractive things: the opaque surfaces that straight rays have learned.
fn silhouettes(backend: &CpuBackend, sampler: &RaySampler, options: &Options, near: f32) -> Vec<Silhouette> {
    // A ray that ends there tells the depth of what stands in front, however blurred, not of a wall far behind it.
    let marching = Marching { min_transmittance: 1.0 - OPAQUE, ..training_marching(options, near) };
    let pixels: usize = sampler.silhouettes().map(|(c, _)| (c.width * c.height) as usize).sum();
    let stride = (pixels as f64 / OCCLUDER_RAYS).sqrt().ceil().max(1.0) as u32;
    let opaque = |camera: &Camera| {
        let small = [camera.width.div_ceil(stride), camera.height.div_ceil(stride)];
        let sample = |k: u32, n: u32| (k * stride + stride / 2).min(n - 1);
        let at = |x: u32, y: u32| sample(y, camera.height) * camera.width + sample(x, camera.width);
        let places = (0..small[1]).flat_map(|y| (0..small[0]).map(move |x| (x, y)));
        let rays: Vec<Option<Ray<f32>>> = places.map(|(x, y)| pixel_ray(camera, at(x, y) as usize)).collect();
        let asked: Vec<Ray<f32>> = rays.iter().flatten().copied().collect();
        let mut pixels = backend.render(&asked, &marching).into_iter();
        let hidden = rays.iter().map(|ray| {
            let seen = ray.and_then(|_| pixels.next())?;
            let opacity = 1.0 - seen.transmittance;
            (opacity > OPAQUE).then(|| seen.depth / opacity)
        });
        let hidden: Vec<f32> = hidden.map(|d| d.unwrap_or(f32::INFINITY)).collect();
        let all = (0..camera.height).flat_map(|y| (0..camera.width).map(move |x| (x, y)));
        all.map(|(x, y)| hidden[(y / stride * small[0] + x / stride) as usize]).collect()
    };
    let silhouette = |(camera, mask): (&Camera, &Mask)| Silhouette {
        camera: *camera,
        mask: mask.clone(),
        occluded_beyond: Some(opaque(camera)),
    };
    sampler.silhouettes().map(silhouette).collect()
}

/// The opaque surfaces that straight rays have learned.
struct Ground {
    points: Vec<Vec3<f32>>,
    /// Mean of the cameras.
    eye: Vec3<f32>,
    voxel: f32,
}

impl Ground {
    fn new(silhouettes: &[Silhouette], voxel: f32) -> Self {
        let mut points = Vec::new();
        let mut eye = Vec3::zero();
        for s in silhouettes {
            eye += s.camera.world_from_camera.translation.cast() / silhouettes.len() as f32;
            let hidden = s.occluded_beyond.iter().flatten().enumerate();
            points.extend(hidden.step_by(GROUND_STRIDE).filter(|(_, d)| d.is_finite()).filter_map(
                |(pixel, &d)| {
                    let ray: Ray<f32> = pixel_ray(&s.camera, pixel)?;
                    Some(ray.at(d))
                },
            ));
        }
        Self { points, eye, voxel }
    }

    /// What a body stands on.
    fn under(&self, surface: &LevelSet<f32>) -> Option<Plane> {
        let nodes = surface.coefficients();
        let positions = (0..nodes.len()).filter(|&j| nodes[j] < 0.0).map(|j| surface.position(j));
        let inside: Vec<Vec3<f32>> = positions.collect();
        let near = widened(&surface.domain().bounds, AROUND);
        let around: Vec<Vec3<f32>> = self.points.iter().filter(|x| near.contains(**x)).copied().collect();
        plane(&around, &inside, self.eye, self.voxel)
    }
}

/// What `index_from` names, if the shape comes from there.
pub(super) fn index_source(options: &Options) -> Result<Option<IndexSource>, RecipeError> {
    let from_file = options.shape.start == StartShape::File;
    from_file.then(|| read(Path::new(&options.shape.file), options)).transpose()
}

/// A region as a file tells it, with about this many nodes along its longest edge, and its start.
pub(super) fn stated(path: &Path, nodes: u32, options: &Options) -> Result<(Region, Start), RecipeError> {
    let index_source = read(path, options)?;
    let (bounds, resolution) = region_grid(&index_source.bounds(), Spacing::Longest(nodes));
    let site = Site { bounds, resolution, interpolation: options.index.interpolation.into() };
    // It need not learn: nothing is blurred, and all that is not vacuum bends.
    let mut options = options.clone();
    (options.shape.smooth, options.shape.gate) = (0.0, Switch::Off);
    let region = Region { free: Vec::new(), ..Region::index_source(site, &index_source, &options) };
    let is_sharp = region.has_one_index() && options.index.integrator == IndexIntegrator::Leapfrog;
    let profile = if is_sharp { Profile::Sharp } else { Profile::Smooth };
    Ok((region, Start { profile, index: options.search.guess, wall: 1.0, searched: false }))
}

fn read(path: &Path, options: &Options) -> Result<IndexSource, RecipeError> {
    let wrong = |problem: String| RecipeError::File { path: path.display().to_string(), problem };
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
    Ok(match extension.as_str() {
        "json" => {
            let truth = IndexTruth::read(path).map_err(|e| wrong(e.to_string()))?;
            let none = || wrong("it has no list `refractive` of known shapes".to_owned());
            IndexSource::Truth(truth.ok_or_else(none)?)
        }
        "npz" | "npy" => {
            let bounds = options.refraction.aabb().map(|b| b.cast());
            IndexSource::Volume(IndexVolume::read(path, bounds).map_err(|e| wrong(e.to_string()))?)
        }
        "ply" | "obj" => IndexSource::Mesh(Shape::Mesh(read_mesh(path).map_err(|e| wrong(e.to_string()))?)),
        _ => {
            return Err(wrong(
                "expected a scene.json, an index volume (.npz, .npy) or a mesh (.ply, .obj)".to_owned(),
            ));
        }
    })
}

impl IndexSource {
    fn bounds(&self) -> Aabb<f32> {
        match self {
            Self::Truth(truth) => truth.bounding_box().cast(),
            Self::Volume(volume) => volume.bounds().cast(),
            Self::Mesh(mesh) => mesh.bounds().cast(),
        }
    }
}

/// The surface of a body by the share of each node's voxel that it fills.
fn half_full(site: &Site, occupancy: impl Fn(usize) -> f32) -> LevelSet<f32> {
    let domain = site.domain();
    let nodes = site.resolution.map(|n| n as usize).iter().product::<usize>();
    let phi = (0..nodes).map(|j| (0.5 - occupancy(j)) * domain.voxel()).collect();
    let surface = LevelSet::from_coefficients(site.bounds, site.resolution, phi);
    let mut surface = surface.unwrap_or_else(|| unreachable!("shares are finite"));
    surface.redistance();
    surface
}

impl Region {
    /// Nothing refractive yet.
    fn uniform(site: Site) -> Self {
        let nodes = site.domain().resolution.map(|n| n as usize).iter().product();
        let (occupancy, free) = (vec![0.0; nodes], Vec::new());
        Self {
            site,
            surface: None,
            known: Some(vec![1.0; nodes]),
            occupancy,
            distance: Vec::new(),
            free,
            gate: None,
            solid: None,
        }
    }

    /// A body by its signed distance.
    fn body(site: Site, distance: impl Fn(Vec3<f32>) -> f32, options: &Options) -> Self {
        let surface = LevelSet::from_samples(site.bounds, site.resolution, distance);
        Self::new(site, surface, options)
    }

    /// The visual hull down to what it stands on, with flat faces where it may have some, its surface smoothed.
    fn hull(
        site: Site,
        (outlines, vote, rays): (&Outlines, &Vote, &[Ray<f32>]),
        ground: impl Fn(&LevelSet<f32>) -> Option<Plane>,
        options: &Options,
    ) -> Self {
        let distance = outlines.hull(&site.domain(), vote).distance;
        // Far from the surface the estimate is rough; only its sign counts there.
        let reach = 4.0 * site.domain().voxel();
        let near = distance.iter().map(|d| d.clamp(-reach, reach)).collect();
        let surface = LevelSet::from_coefficients(site.bounds, site.resolution, near);
        let mut surface = surface.unwrap_or_else(|| unreachable!("distances are finite"));
        surface.redistance();
        let ground = ground(&surface);
        let base = ground.map(|p| Plane::facing(-p.normal(), SUNK * surface.voxel() - p.offset()));
        let faces = if options.shape.faces.is_on() {
            // Without what it has grown into the ground.
            faces(&Polyhedron { faces: Vec::new(), base }.cut(&surface), rays, base.as_ref())
        } else {
            Vec::new()
        };
        for _ in 0..SMOOTHING.0 {
            surface.smooth(SMOOTHING.1);
        }
        // After the smoothing: edges stay as sharp as the grid.
        let body = |chosen: &dyn Fn(&Face) -> bool| {
            let faces = faces.iter().filter(|f| chosen(f)).map(|f| f.plane).collect();
            Polyhedron { faces, base }
        };
        let solid = body(&|_| true);
        if fills(&solid.cut(&surface), &solid) {
            let surface = solid.level_set(site.bounds, site.resolution);
            return Self { solid: Some(solid), ..Self::new(site, surface, options) };
        }
        let bounds = body(&|f| f.large);
        if bounds.planes().next().is_some() {
            surface = bounds.cut(&surface);
        }
        surface.redistance();
        Self::new(site, surface, options)
    }

    /// What a file says.
    fn index_source(site: Site, index_source: &IndexSource, options: &Options) -> Self {
        let known = |grid: &IndexGrid<f32>| grid.coefficients().iter().map(|c| (2.0 * c).sqrt()).collect();
        match index_source {
            IndexSource::Truth(truth) => {
                let distance = |x: Vec3<f32>| truth.signed_distance_like(x.cast()) as f32;
                let mut region = Self::body(site, distance, options);
                region.known = Some(known(&site.truth(truth)));
                region
            }
            IndexSource::Volume(volume) => {
                let n: Vec<f32> = known(&site.volume(volume));
                let most = n.iter().copied().fold(1.0, f32::max);
                let surface = half_full(&site, |j| (n[j] - 1.0) / (most - 1.0).max(1e-6));
                let mut region = Self::new(site, surface, options);
                // A lens bends rays beyond the surface at which it has half its contrast.
                let bends: Vec<bool> = n.iter().map(|n| (n - 1.0).abs() > 0.01 * (most - 1.0)).collect();
                let share: Vec<f32> = bends.iter().map(|b| f32::from(u8::from(*b))).collect();
                region.gate = region.gate.map(|_| Gate::new(site.domain(), &share));
                region.free.iter_mut().zip(&bends).for_each(|(free, bends)| *free |= bends);
                region.known = Some(n);
                region
            }
            IndexSource::Mesh(shape) => {
                let solid = known(&site.shape(shape, 2.0));
                let surface = site.distance(shape, &half_full(&site, |j| solid[j] - 1.0));
                Self::new(site, surface, options)
            }
        }
    }

    fn new(site: Site, surface: LevelSet<f32>, options: &Options) -> Self {
        let nodes = surface.coefficients().len();
        let distance: Vec<f32> = (0..nodes).map(|j| surface.value(surface.position(j))).collect();
        let voxel = site.domain().voxel();
        let mut occupancy: Vec<f32> = distance.iter().map(|d| (0.5 - d / voxel).clamp(0.0, 1.0)).collect();
        let gate = options.shape.gate.is_on().then(|| Gate::new(site.domain(), &occupancy));
        gaussian_blur(&mut occupancy, site.resolution, options.shape.smooth);
        let free = if options.shape.interior.is_on() {
            distance.iter().map(|&d| d < 2.0 * voxel).collect()
        } else {
            Vec::new()
        };
        Self { site, surface: Some(surface), known: None, occupancy, distance, free, gate, solid: None }
    }

    /// Its index is known from a file.
    pub(super) fn is_known(&self) -> bool {
        self.known.is_some()
    }

    /// What a file says of its inside is one number, but at its surface.
    fn has_one_index(&self) -> bool {
        let Some(known) = &self.known else { return true };
        let deep = -2.0 * self.site.domain().voxel();
        let inside = self.distance.iter().zip(known).filter(|(d, _)| **d < deep).map(|(_, n)| *n);
        let (least, most) = inside.fold((f32::MAX, 1.0_f32), |(a, b), n| (a.min(n), b.max(n)));
        most - least < 1e-3
    }

    /// Inside, or within a voxel of it.
    pub(super) fn is_inside(&self, x: Vec3<f32>) -> bool {
        let surface = self.surface.as_ref().filter(|_| self.site.bounds.contains(x));
        surface.is_some_and(|s| s.value(x) < s.voxel())
    }

    pub(super) fn describe(&self, k: usize) -> String {
        let (e, c, n) = (self.site.bounds.extent(), self.site.bounds.center(), self.site.resolution);
        let faces = self
            .solid
            .as_ref()
            .map_or(String::new(), |s| format!(", bounded by {} flat faces", s.faces.len()));
        format!(
            "refractive region {}: {:.3} x {:.3} x {:.3} around ({:.3}, {:.3}, {:.3}), {} x {} x {} nodes{faces}",
            k + 1,
            e.x,
            e.y,
            e.z,
            c.x,
            c.y,
            c.z,
            n[0],
            n[1],
            n[2]
        )
    }

    /// The grid to start from. A known index stays as it is.
    pub(super) fn grid(&self, start: &Start, options: &Options) -> IndexGrid<f32> {
        let Start { profile, index, wall, .. } = *start;
        match (profile, &self.surface, &self.known) {
            (Profile::Sharp, Some(surface), None) if wall < 1.0 => {
                let thickness = wall * self.depth();
                let hollow = surface.coefficients().iter().map(|c| c.max(-c - thickness)).collect();
                let level = LevelSet::from_coefficients(self.site.bounds, self.site.resolution, hollow);
                IndexGrid::sharp(level.unwrap_or_else(|| surface.clone()), index)
            }
            (Profile::Sharp, Some(surface), None) => IndexGrid::sharp(surface.clone(), index),
            (Profile::Sharp, Some(surface), Some(known)) => {
                let most = known.iter().copied().fold(1.0, f32::max);
                IndexGrid::sharp(surface.clone(), most)
            }
            (_, _, Some(known)) => {
                let mut n = known.clone();
                gaussian_blur(&mut n, self.site.resolution, options.shape.smooth);
                self.site.from_nodes(&n)
            }
            (Profile::Graded, Some(_), None) => {
                let rise = 0.5 * (index * index - 1.0);
                let depth = self.depth();
                let n = self.distance.iter().map(|d| {
                    let s = (-d / depth).clamp(0.0, 1.0);
                    (1.0 + 2.0 * rise * (1.0 - (1.0 - s) * (1.0 - s))).sqrt()
                });
                self.site.from_nodes(&n.collect::<Vec<_>>())
            }
            _ => self.site.from_occupancy(&self.occupancy, index),
        }
    }

    /// The same body on the coarser grid where its nodes learn: pictures say less of a surface than a search needs. `None`
    /// where planes learn, where a wall is thin, where a file gives the shape, and where it is held.
    pub(super) fn for_learning(
        &self,
        start: &Start,
        grid: &IndexGrid<f32>,
        options: &Options,
    ) -> Option<IndexGrid<f32>> {
        let (level, index) = (grid.level_set()?, grid.interior_index()?);
        let held = options.surface.rate == 0.0 || options.shape.start == StartShape::File;
        if start.wall < 1.0 || self.solid.is_some() || held {
            return None;
        }
        let Domain { bounds, resolution, .. } = *level.domain();
        let coarser = resolution.map(|n| ((n - 1) as f32 / options.surface.coarsening).round() as u32 + 1);
        let body = || IndexGrid::sharp(LevelSet::from_samples(bounds, coarser, |x| level.value(x)), index);
        (coarser != resolution).then(body)
    }

    /// Depth of its deepest point [scene unit].
    fn depth(&self) -> f32 {
        -self.distance.iter().copied().fold(0.0, f32::min)
    }

    /// What goes with the start.
    pub(super) fn states(&self, start: &Start) -> RegionState {
        let searched = start.searched.then_some(start.index);
        match start.profile {
            // Rays that miss a sharp surface do not bend: no gate is needed, and the surface may move.
            Profile::Sharp => {
                // A hollow body has surfaces inside.
                let solid = self.solid.clone().filter(|_| start.wall >= 1.0);
                RegionState { searched, solid, ..RegionState::default() }
            }
            _ => RegionState {
                free: self.free.clone(),
                gate: self.gate.clone(),
                searched,
                ..RegionState::default()
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_body_learns_on_a_coarser_grid_unless_it_is_told_or_held() {
        let bounds = Aabb::new(Vec3::splat(-1.0), Vec3::splat(1.0));
        let site = Site {
            bounds,
            resolution: [57; 3],
            interpolation: Options::default().index.interpolation.into(),
        };
        let region = |options: &Options| Region::body(site, |x| x.length() - 0.6, options);
        let start = |wall| Start { profile: Profile::Sharp, index: 1.5, wall, searched: true };
        let learning = |options: &Options, wall: f32| {
            let (region, start) = (region(options), start(wall));
            region.for_learning(&start, &region.grid(&start, options), options)
        };
        let usual = Options::default();
        let coarser = learning(&usual, 1.0).unwrap();
        let level = coarser.level_set().unwrap();
        assert_eq!((level.domain().resolution, coarser.interior_index()), ([41; 3], Some(1.5)));
        for x in [Vec3 { x: 0.6, y: 0.0, z: 0.0 }, Vec3 { x: 0.36, y: -0.48, z: 0.0 }] {
            assert!(level.value(x).abs() < 0.01 * level.voxel(), "{}", level.value(x));
        }
        assert!(learning(&usual, 0.2).is_none(), "a thin wall");
        let (mut held, mut said) = (usual.clone(), usual);
        held.surface.rate = 0.0;
        said.shape.start = StartShape::File;
        assert!(learning(&held, 1.0).is_none() && learning(&said, 1.0).is_none());
    }
}

//! How a model comes to bend its rays: find what is refractive, search its index, and clear what straight rays left
//! inside.
//!
//! At this point straight rays have learned everything that is seen beside the refractive things. Then:
//! 1. Views say where refractive things can be: the visual hull of the masks, or a box.
//! 2. One index per region is searched by the error of the rays inside the masks: the scene around is known by now, so
//!    the right index shows it in the right places. The error has one minimum, which a gradient from n = 1 never finds.
//! 3. Haze that straight rays left inside is cleared.
//!
//! From there the index learns by its gradient, first alone and then together with everything else.

use crate::backend::{Backend, Batch, Objective};
use crate::config::{Config, IndexShape};
use crate::cpu::CpuBackend;
use crate::initial::{
    Edge, Gate, Hull, LocateError, Outlines, Search, Silhouette, Spacing, Vote, gaussian_blur, region_grid,
};
use crate::rays::{Selection, Shots, pixel_ray};
use crate::refraction::{Extras, Optics, Refraction};
use crate::schedule::{Progress, objective, training_marching};
use refraxel_core::{Aabb, Camera, Domain, Extent, IndexGrid, Medium, Ray, Vec3};
use refraxel_data::Mask;
use refraxel_data::synth::IndexTruth;

/// Rays that judge an index.
const SCAN_RAYS: usize = 8192;
/// A pixel this opaque hides what is behind its depth.
const OPAQUE: f32 = 0.9;
/// Occupancy from which a place counts as inside when haze is cleared.
const INSIDE: f32 = 0.1;
/// Candidates of the first pass.
const SCAN: std::ops::RangeInclusive<u32> = 0..=31;

/// Why nothing can bend.
#[derive(Debug, thiserror::Error)]
pub enum RecipeError {
    /// Neither masks nor a box.
    #[error(
        "nothing says what is refractive: the dataset has no masks of refractive things; give masks, or a box with \
         --refraction-box x0,y0,z0,x1,y1,z1, or train with --refraction off"
    )]
    Nowhere,
    /// Masks that lead nowhere.
    #[error(transparent)]
    Locate(#[from] LocateError),
    /// A file that gives no index.
    #[error("cannot start from {path}: {problem}")]
    File {
        /// The file.
        path: String,
        /// What is wrong.
        problem: String,
    },
}

/// A refractive region before it has an index.
struct Region {
    domain: Domain<f32>,
    /// Share of each node's voxel that is refractive, 0 to 1.
    occupancy: Vec<f32>,
    /// n at the nodes where a file gives it; otherwise one index is multiplied with the occupancy.
    known: Option<Vec<f32>>,
    extras: Extras,
}

/// Let rays bend from now on; says what was found.
pub fn begin(
    backend: &mut CpuBackend,
    shots: &Shots,
    config: &Config,
    near: f32,
) -> Result<Vec<String>, RecipeError> {
    let mut news = Vec::new();
    let regions = find_regions(backend, shots, config, near)?;
    for (k, r) in regions.iter().enumerate() {
        let e = r.domain.bounds.extent();
        let (n, c) = (r.domain.resolution, r.domain.bounds.center());
        news.push(format!(
            "refractive region {}: {:.3} x {:.3} x {:.3} around ({:.3}, {:.3}, {:.3}), {} x {} x {} nodes",
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
        ));
    }
    clear_inside(backend, &regions, config.contents_density);
    backend.refresh_occupancy(&training_marching(config, near));
    let mut indices = vec![config.index_guess; regions.len()];
    if config.index_scan.is_on() && regions.iter().any(|r| r.known.is_none()) {
        let judge = Judge::new(shots, config, near);
        scan(backend, &regions, &judge, config, &mut indices);
        for (k, n) in indices.iter().enumerate() {
            news.push(format!("refractive region {}: index {n:.3} fits best", k + 1));
        }
    }
    let mut found = refraction(&regions, &indices, config);
    found.find_flat_cells();
    backend.set_refraction(found);
    Ok(news)
}

/// The refraction of regions with one index each.
fn refraction(regions: &[Region], indices: &[f32], config: &Config) -> Refraction {
    let grids = regions.iter().zip(indices).map(|(r, &n)| r.grid(n, config)).collect();
    let medium = Medium::new(grids).unwrap_or_else(|e| unreachable!("regions were made apart: {e}"));
    let optics = Optics { integrator: config.index_stepping.into(), step: config.index_step };
    let extras = regions.iter().map(|r| r.extras.clone()).collect();
    Refraction { medium, optics, extras }
}

impl Region {
    fn grid(&self, index: f32, config: &Config) -> IndexGrid<f32> {
        let Domain { bounds, resolution, .. } = self.domain;
        let mut grid = IndexGrid::vacuum(bounds, resolution, config.index_interpolation.into());
        let nodes: Vec<usize> = grid.parameters().collect();
        for j in nodes {
            let n = self.known.as_ref().map_or(1.0 + (index - 1.0) * self.occupancy[j], |known| known[j]);
            grid.coefficients_mut()[j] = 0.5 * n * n;
        }
        grid.find_flat_cells(None);
        grid
    }
}

/// The regions and their shapes.
fn find_regions(
    backend: &CpuBackend,
    shots: &Shots,
    config: &Config,
    near: f32,
) -> Result<Vec<Region>, RecipeError> {
    let silhouettes = silhouettes(backend, shots, config, near);
    let scene = backend.field().domain.bounds;
    let outlines = Outlines::new(&silhouettes);
    let vote = Vote { share: config.index_vote, ..Vote::default() };
    let truth = truth(config)?;
    let given = config.bounds_of_box().or_else(|| truth.as_ref().map(|t| t.bounding_box().cast()));
    let boxes = match given {
        Some(bounds) => vec![bounds],
        None if silhouettes.is_empty() => return Err(RecipeError::Nowhere),
        None => {
            let spacing = Spacing::Voxel(voxel(shots, config, scene.center(), scene.extent().max_element()));
            outlines.locate(&scene, &Search { vote, spacing, ..Search::default() })?
        }
    };
    let region = |bounds: &Aabb<f32>| {
        let voxel = voxel(shots, config, bounds.center(), bounds.extent().max_element());
        let (grid, resolution) = region_grid(bounds, Spacing::Voxel(voxel));
        let domain = Domain { bounds: grid, extent: Extent::Bounded, resolution };
        shaped(domain, bounds, config, truth.as_ref(), || outlines.hull(&domain, &vote))
    };
    Ok(boxes.iter().map(region).collect())
}

fn truth(config: &Config) -> Result<Option<IndexTruth>, RecipeError> {
    if config.index_shape != IndexShape::File {
        return Ok(None);
    }
    let wrong = |problem: String| RecipeError::File { path: config.index_from.clone(), problem };
    let text = std::fs::read_to_string(&config.index_from).map_err(|e| wrong(e.to_string()))?;
    let json = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
    let truth = IndexTruth::from_scene_json(&json);
    truth.map(Some).ok_or_else(|| wrong("it has no list `refractive` of known shapes".to_owned()))
}

/// Edge length of a region's voxels [scene unit].
fn voxel(shots: &Shots, config: &Config, center: Vec3<f32>, longest: f32) -> f32 {
    if config.index_resolution > 0 {
        return longest / config.index_resolution as f32;
    }
    let pixel = shots.pixel_size(center);
    (pixel / config.index_voxels_per_pixel as f32).max(longest / 256.0)
}

/// A region of the shape that the configuration asks for.
fn shaped(
    domain: Domain<f32>,
    inner: &Aabb<f32>,
    config: &Config,
    truth: Option<&IndexTruth>,
    hull: impl Fn() -> Hull,
) -> Region {
    let nodes = domain.resolution.iter().product::<u32>() as usize;
    let [nx, ny, _] = domain.resolution.map(|n| n as usize);
    let position = |j: usize| {
        let node = [j % nx, j / nx % ny, j / (nx * ny)];
        domain.position(Vec3::from(node.map(|i| i as f32)))
    };
    let mut known = None;
    let mut occupancy: Vec<f32> = match config.index_shape {
        IndexShape::Uniform => vec![0.0; nodes],
        IndexShape::Block => (0..nodes).map(|j| f32::from(u8::from(inner.contains(position(j))))).collect(),
        IndexShape::Ball => {
            let (c, half) = (inner.center(), inner.extent() * 0.5);
            let soft = half.min_element() / domain.voxel();
            let r = |x: Vec3<f32>| (x - c).zip(half, |a, b| a / b).length();
            (0..nodes).map(|j| (0.5 + (1.0 - r(position(j))) * soft).clamp(0.0, 1.0)).collect()
        }
        IndexShape::Hull => hull().occupancy(Edge::Distance { width: 1.0 }),
        IndexShape::File => {
            use rayon::prelude::*;
            let truth = truth.expect("a file was read");
            let step = 0.25 * f64::from(domain.voxel());
            let mean = |j: usize| {
                let x = position(j).cast::<f64>();
                let sum: f64 = (0..8)
                    .map(|k| {
                        let side = |bit: u32| if k >> bit & 1 == 1 { step } else { -step };
                        truth.n(x + Vec3::new(side(0), side(1), side(2)))
                    })
                    .sum();
                (sum / 8.0) as f32
            };
            let n: Vec<f32> = (0..nodes).into_par_iter().map(mean).collect();
            let most = n.iter().copied().fold(1.0, f32::max);
            let occupancy = n.iter().map(|n| (n - 1.0) / (most - 1.0).max(1e-6)).collect();
            known = Some(n);
            occupancy
        }
    };
    let gate = (config.index_gate.is_on() && config.index_shape != IndexShape::Uniform)
        .then(|| Gate::new(domain, &occupancy));
    gaussian_blur(&mut occupancy, domain.resolution, config.index_smooth);
    if let Some(known) = &mut known {
        gaussian_blur(known, domain.resolution, config.index_smooth);
    }
    let extras = Extras { free: free(&occupancy, domain.resolution, config), gate };
    Region { domain, occupancy, known, extras }
}

/// Where the index may be learned: in the shape and two voxels around it.
fn free(occupancy: &[f32], resolution: [u32; 3], config: &Config) -> Vec<bool> {
    if !config.index_interior.is_on() || config.index_shape == IndexShape::Uniform {
        return Vec::new();
    }
    let mut near: Vec<f32> = occupancy.iter().map(|&f| if f > 0.01 { 1.0 } else { 0.0 }).collect();
    gaussian_blur(&mut near, resolution, 1.0);
    near.iter().map(|&f| f > 0.02).collect()
}

/// Cameras and masks, with what hides refractive things: the opaque surfaces that straight rays have learned.
fn silhouettes(backend: &CpuBackend, shots: &Shots, config: &Config, near: f32) -> Vec<Silhouette> {
    let marching = training_marching(config, near);
    let opaque = |camera: &Camera| {
        let count = (camera.width * camera.height) as usize;
        let rays: Vec<Option<Ray<f32>>> = (0..count).map(|p| pixel_ray(camera, p)).collect();
        let asked: Vec<Ray<f32>> = rays.iter().flatten().copied().collect();
        let mut pixels = backend.render(&asked, &marching).into_iter();
        let hidden = rays.iter().map(|ray| {
            let seen = ray.and_then(|_| pixels.next())?;
            let opacity = 1.0 - seen.transmittance;
            (opacity > OPAQUE).then(|| seen.depth / opacity)
        });
        hidden.map(|d| d.unwrap_or(f32::INFINITY)).collect()
    };
    let silhouette = |(camera, mask): (&Camera, &Mask)| Silhouette {
        camera: *camera,
        mask: mask.clone(),
        occluded_beyond: std::env::var_os("OCC").map(|_| opaque(camera)),
    };
    shots.silhouettes().map(silhouette).collect()
}

/// Clear the haze that straight rays left inside.
fn clear_inside(backend: &mut CpuBackend, regions: &[Region], density: f32) {
    backend.set_density(density, |x| {
        regions.iter().any(|r| {
            let g = r.domain.node(x);
            let n = r.domain.resolution;
            (0..3).all(|a| g[a] >= 0.0 && g[a] <= (n[a] - 1) as f32) && {
                let at = [0, 1, 2].map(|a| g[a].round() as usize);
                r.occupancy[at[0] + n[0] as usize * (at[1] + n[1] as usize * at[2])] > INSIDE
            }
        })
    });
}

/// Loss of rays inside the masks.
struct Judge {
    batch: Batch,
    objective: Objective,
}

impl Judge {
    fn new(shots: &Shots, config: &Config, near: f32) -> Self {
        // Steps of a run never reach this number: rays of their own.
        let batch = shots.batch(u64::MAX / 2, SCAN_RAYS, Selection::Inside(1.0));
        let objective = objective(config, near, Progress(1.0));
        Self { batch, objective }
    }

    /// Mean squared error per channel.
    fn error(&self, backend: &CpuBackend) -> f64 {
        backend.squared_error(&self.batch, &self.objective) / (3.0 * self.batch.rays.len().max(1) as f64)
    }
}

/// The index of each region with the least error: all regions together over the whole range, then each by itself, finer.
fn scan(
    backend: &mut CpuBackend,
    regions: &[Region],
    judge: &Judge,
    config: &Config,
    indices: &mut [f32],
) -> Vec<(f32, f64)> {
    let mut error = |indices: &[f32]| {
        backend.set_refraction(refraction(regions, indices, config));
        judge.error(backend)
    };
    let curve: Vec<(f32, f64)> = SCAN
        .map(|k| {
            let n = 1.0 + 0.05 * k as f32;
            (n, error(&vec![n; regions.len()]))
        })
        .collect();
    let best = curve.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(config.index_guess, |b| b.0);
    indices.fill(best);
    for step in [0.02, 0.01, 0.005] {
        for region in 0..indices.len() {
            let center = indices[region];
            let mut at = |offset: f32, indices: &mut [f32]| {
                indices[region] = (center + offset).max(1.0);
                (error(indices), indices[region])
            };
            let tried = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| at(k * step, indices));
            indices[region] = tried.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(center, |b| b.1);
        }
    }
    curve
}

//! From a dataset to the model that a run starts with: box, resolution, background, memory.

use crate::model::Model;
use crate::options::Options;
use crate::rays::{WHITE, pixel_size};
use crate::schedule::{Progress, stage_domain};
use refraxel_core::sh::ShDegree;
use refraxel_core::{
    Aabb, Background, BrickMap, Domain, EnvironmentMap, Extent, Projection, Vec3, VoxelField,
};
use refraxel_data::{Backdrop, Dataset, LocalOrigin, Photo, Region, View};

/// What does not change during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The grid of the last stage.
    pub finest: Domain<f32>,
    /// Nothing nearer to a camera than this is seen [scene unit].
    pub near: f32,
    /// Where the coordinates begin, of the grid and of everything that is trained.
    pub origin: LocalOrigin,
    /// What lies behind.
    pub backdrop: Backdrop,
}

/// Why a scene has no place in single precision.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// The box has no size, one that cannot be computed with, or is small beside its distance from the origin.
    #[error(
        "the scene's box reaches from {:?} to {:?}; expected edges from {least:e} to {most:e} scene units, with voxels that single \
         precision tells apart so far from the origin: choose another unit of length, or subtract the mean position of the \
         cameras from all of them",
        bounds.min.to_array(), bounds.max.to_array(), least = EDGES[0], most = EDGES[1]
    )]
    Box {
        /// The box in the user's world.
        bounds: Aabb<f64>,
    },
    /// The limit below which nothing is seen is no distance.
    #[error("nothing is seen nearer than {found}; expected a distance from 0 to {most:e} scene units", most = EDGES[1])]
    Near {
        /// The limit [scene unit].
        found: f32,
    },
}

/// Edges of a scene's box [scene unit]: their cubes are normal numbers in single precision.
const EDGES: [f32; 2] = [1e-12, 1e12];

/// Bytes per stored voxel, in f32: density, its moment, padded SH coefficients and the one moment they share.
pub fn bytes_per_voxel(degree: ShDegree) -> u64 {
    4 * (3 + degree.stride() as u64)
}

/// Share of a grid's voxels that survives pruning, for forecasts, where no backdrop shows where surfaces are. Measured: 31–55 % of
/// photographs with surroundings.
pub const TYPICAL_OCCUPANCY: f64 = 0.5;

/// Surfaces behind each other in a forward-facing capture, for forecasts. Measured: *fern*, 46, 36, 27, 22 and 15 % stored of grids with
/// 74, 98, 123, 148 and 188 nodes in depth, where 4 surfaces make 45, 36, 30, 26 and 21 %.
const LAYERS: f64 = 4.0;

/// Thickness of what survives pruning around a surface [voxel]: what a coarser grid saw of it, a voxel of that grid on either
/// side, and the rest of their bricks.
const SHELL: f64 = 11.0;

/// So many rays teach so many nodes along the longest edge of a box [node], and fewer of them fewer, as the cube root. Measured,
/// docs/experiments.md.
const TAUGHT_RAYS: f64 = 4e7;
const TAUGHT: f64 = 384.0;
const LEAST_TAUGHT: f64 = 256.0;
/// Rays per second and thread in a box, where a clock ends the run.
const SPEED: f64 = 90e3;
/// Nodes along the edges of surroundings, and of a cube with as many nodes as a projective grid.
const CONTRACTED: u32 = 320;
const PROJECTIVE: u32 = 384;

/// Raw density everywhere at the start: a haze through which every photograph is seen.
const INITIAL_DENSITY: f32 = -5.0;
/// Rows of the learned panorama behind an unbounded scene.
const BACKGROUND_ROWS: usize = 64;
/// Voxels per pixel at the centre of a scene, and of one without bounds, of which photographs are fewer.
const VOXELS_PER_PIXEL: [f64; 2] = [1.35, 1.0];

/// Haze that straight rays have not cleared when a run of so many steps prunes makes shells thicker by this times √nodes / steps
/// [voxel]. Total variation is stronger where rays bend, and leaves none. Measured, docs/growth.md.
const HAZE: f64 = 380.0;

/// Share of the voxels that survives pruning of a grid. Where surfaces of this density (see [`Region::surface_density`]) are placed at
/// random, a shell around them takes 1 − e^(−thickness · density).
pub fn stored_share(options: &Options, surface: Option<f64>, domain: &Domain<f32>) -> f64 {
    let [x, y, z] = domain.resolution.map(f64::from);
    let longest = x.max(y).max(z);
    let shells = match domain.extent {
        Extent::Projective(_) => Some(SHELL * LAYERS / z),
        Extent::Bounded | Extent::Contracted => {
            surface.map(|density| (SHELL + haze(options, longest)) * density / longest)
        }
    };
    shells.map_or(TYPICAL_OCCUPANCY, |shells| 1.0 - (-shells).exp())
}

/// How much thicker haze makes the shells of a grid with so many nodes along its longest edge [voxel].
fn haze(options: &Options, longest: f64) -> f64 {
    let is_short = !options.refraction.bend.is_on() && options.run.minutes == 0.0;
    if is_short { HAZE * longest.sqrt() / options.run.steps as f64 } else { 0.0 }
}

/// Nodes along the longest edge for about one voxel per pixel at the centre of the scene, theory (4.10).
///
/// A pixel covers distance / focal there; the median over the views counts.
fn matching_resolution(region: &Region, views: &[&View]) -> f64 {
    let footprint = pixel_size(views.iter().map(|view| &view.camera), region.bounds.center());
    region.bounds.extent().max_element() / footprint
}

/// Nodes along the longest edge that a run can teach, theory (4.10). More of them gain nothing, and take longer.
fn taught(options: &Options, extent: Extent) -> u32 {
    match extent {
        Extent::Bounded => {
            let run = &options.run;
            let rays = if run.minutes > 0.0 {
                60.0 * run.minutes * SPEED * rayon::current_num_threads() as f64
            } else {
                run.steps as f64 * f64::from(run.batch)
            };
            (TAUGHT * (rays / TAUGHT_RAYS).cbrt()).clamp(LEAST_TAUGHT, TAUGHT) as u32
        }
        Extent::Contracted => CONTRACTED,
        Extent::Projective(_) => PROJECTIVE,
    }
}

/// Nodes along the longest edge of a projective grid: one per pixel, and no more of them in all than a cube with `most` along each
/// edge has.
fn projective_resolution(
    projection: &Projection,
    views: &[&View],
    most: u32,
    of: impl Fn(u32) -> Domain<f32>,
) -> u32 {
    let edge = projection.edges.map(|[low, high]| high - low).into_iter().fold(0.0, f32::max);
    let focal = views.iter().map(|v| v.camera.focal[0].max(v.camera.focal[1])).fold(0.0, f64::max);
    let mut longest = (f64::from(edge) * focal).clamp(8.0, 1024.0) as u32;
    let nodes = |longest| of(longest).resolution.iter().map(|&n| u64::from(n)).product::<u64>();
    while longest > 8 && nodes(longest) > u64::from(most).pow(3) {
        longest -= 1;
    }
    longest
}

/// The largest grid that options and a dataset ask for within the memory allowed. `surface` is asked for the
/// [density of surfaces](Region::surface_density) where a dense grid would not fit.
pub fn finest_domain(
    options: &Options,
    region: &Region,
    views: &[&View],
    surface: impl FnOnce() -> Option<f64>,
) -> Domain<f32> {
    let extent = region.extent();
    // A contracted grid gives half its nodes to the box.
    let (share, each) =
        if region.unbounded { (2.0, VOXELS_PER_PIXEL[1]) } else { (1.0, VOXELS_PER_PIXEL[0]) };
    let bounds = region.bounds.cast::<f32>();
    let of = |longest| Domain::with_longest(bounds, extent, longest);
    let most = match options.grid.max_resolution {
        0 => taught(options, extent),
        most => most,
    };
    let wanted = match (options.grid.resolution, region.projection) {
        (0, Some(projection)) => f64::from(projective_resolution(&projection, views, most, of)),
        (0, None) => (share * each * matching_resolution(region, views)).min(f64::from(most)),
        (n, _) => f64::from(n),
    };
    let fits = |longest: u32, stored: f64| {
        longest <= 16
            || model_bytes(options, &of(longest), stored) <= options.run.memory * (1_u64 << 30) as f64
    };
    let mut longest = (wanted.round() as u32).clamp(8, 1024);
    if fits(longest, 1.0) {
        return of(longest);
    }
    // The last stage is pruned by then, and dense if it is also the first.
    let surface = if options.grid.stages > 1 { Some(surface()) } else { None };
    while !fits(longest, surface.map_or(1.0, |s| stored_share(options, s, &of(longest)))) {
        longest -= 1;
    }
    of(longest)
}

/// Bytes of parameters and moments of a grid of which this share is stored.
fn model_bytes(options: &Options, domain: &Domain<f32>, stored: f64) -> f64 {
    let degree = ShDegree::new(options.field.sh_degree).unwrap_or_default();
    let nodes: f64 = domain.resolution.iter().map(|&n| f64::from(n)).product();
    nodes * stored * bytes_per_voxel(degree) as f64
}

/// Distance below which a view sees nothing: a share of the camera's distance to the middle of the scene, the smallest
/// over the views.
fn near_limit(views: &[&View], middle: Vec3<f64>, share: f32) -> f32 {
    let distances = views.iter().map(|v| (v.camera.world_from_camera.translation - middle).length());
    let nearest = distances.fold(f64::INFINITY, f64::min);
    if nearest.is_finite() { share * nearest as f32 } else { 0.0 }
}

impl Plan {
    /// The plan for a dataset, whose training photographs are `photos`.
    pub fn new(options: &Options, data: &Dataset, photos: &[Photo]) -> Self {
        let region = refraxel_data::scene_region(data);
        if region.unbounded {
            return Self::of_region(options, data, &region);
        }
        let train = &data.split.train;
        let region = region.around_content(data, train, photos);
        Self::within(options, data, &region, || region.surface_density(data, train, photos))
    }

    /// The plan for a dataset whose scene lies in this region.
    pub fn of_region(options: &Options, data: &Dataset, region: &Region) -> Self {
        Self::within(options, data, region, || None)
    }

    fn within(
        options: &Options,
        data: &Dataset,
        region: &Region,
        surface: impl FnOnce() -> Option<f64>,
    ) -> Self {
        let views: Vec<&View> = data.split.train.iter().map(|&i| &data.views[i]).collect();
        let finest = finest_domain(options, region, &views, surface);
        let near = near_limit(&views, region.bounds.center(), options.march.near);
        Self { finest, near, origin: data.origin, backdrop: data.backdrop }
    }

    /// Refuses a plan that no checkpoint could hold, or that no arithmetic could follow: for runs that begin and for those
    /// that are read back.
    pub fn check(&self) -> Result<(), PlanError> {
        let bounds = self.finest.bounds;
        let is_edge = |e: f32| (EDGES[0]..=EDGES[1]).contains(&e);
        let farthest = bounds.min.map(f32::abs).max(bounds.max.map(f32::abs)).max_element();
        let is_told_apart = self.finest.voxel() >= f32::EPSILON * farthest;
        if !bounds.extent().to_array().into_iter().all(is_edge) || !is_told_apart {
            return Err(PlanError::Box { bounds: self.origin.to_world(bounds.cast()) });
        }
        let is_distance = (0.0..=EDGES[1]).contains(&self.near);
        if is_distance { Ok(()) } else { Err(PlanError::Near { found: self.near }) }
    }

    /// The untrained model.
    pub fn start(&self, options: &Options) -> Model {
        let domain = stage_domain(options, &self.finest, Progress(0.0).stage(options));
        let map = BrickMap::dense(domain.resolution);
        let degree = ShDegree::new(options.field.sh_degree).unwrap_or_default();
        let field = VoxelField::uniform(domain, map, degree, INITIAL_DENSITY);
        let background = match self.backdrop {
            Backdrop::Transparent => Background::Constant(WHITE),
            Backdrop::Color(c) => Background::Constant(c),
            Backdrop::Surroundings => {
                Background::Environment(EnvironmentMap::uniform(BACKGROUND_ROWS, [0.5; 3]))
            }
        };
        Model::straight(field, background)
    }
}

/// The bricks of a finer domain over the same box that are worth keeping, theory (4.11): those within one old voxel
/// of a voxel whose peak rendering weight is above `threshold`.
pub fn kept_bricks(map: &BrickMap, peak: &[f32], threshold: f32, finer: &Domain<f32>) -> BrickMap {
    use refraxel_core::grid::bricks::{BRICK, coordinates};
    let (old, new) = (map.resolution(), finer.resolution);
    let bricks = new.map(|n| n.div_ceil(BRICK));
    let mut keep = vec![false; bricks.iter().map(|&b| b as usize).product()];
    let scale: [f32; 3] = std::array::from_fn(|a| (new[a] - 1) as f32 / (old[a] - 1) as f32);
    for node in coordinates(old) {
        let voxel = map.voxel(node);
        if peak[voxel] <= threshold || voxel < refraxel_core::grid::BRICK_VOXELS {
            continue;
        }
        let range = |a: usize| {
            let low = ((node[a] as f32 - DILATION) * scale[a]).floor().max(0.0) as u32 / BRICK;
            let high = ((node[a] as f32 + DILATION) * scale[a]).ceil() as u32 / BRICK;
            low..=high.min(bricks[a] - 1)
        };
        for (z, y, x) in range(2).flat_map(|z| range(1).flat_map(move |y| range(0).map(move |x| (z, y, x)))) {
            keep[(x + bricks[0] * (y + bricks[1] * z)) as usize] = true;
        }
    }
    BrickMap::new(new, |[x, y, z]| keep[(x + bricks[0] * (y + bricks[1] * z)) as usize])
}

/// Voxels around a visible one that are kept, in voxels of the old grid.
const DILATION: f32 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn a_box_without_size_or_far_from_the_origin_is_refused() {
        let plan = |low: f32, high: f32, near: f32| {
            let bounds = Aabb::new(Vec3::splat(low), Vec3::splat(high));
            let finest = Domain { bounds, extent: Extent::Bounded, resolution: [64; 3] };
            let (origin, backdrop) = (LocalOrigin::default(), Backdrop::Surroundings);
            Plan { finest, near, origin, backdrop }.check()
        };
        assert_eq!((plan(-1.0, 1.0, 0.1), plan(1e4, 1e4 + 2.0, 0.0)), (Ok(()), Ok(())));
        let nothing =
            [(1.0, 1.0), (1.0, -1.0), (-1e-13, 0.0), (-1e13, 1e13), (f32::NAN, 1.0), (0.0, f32::INFINITY)];
        for (low, high) in nothing.into_iter().chain([(1e8, 1e8 + 16.0), (1e5, 1e5 + 0.1)]) {
            assert!(matches!(plan(low, high, 0.1), Err(PlanError::Box { .. })), "{low} {high}");
        }
        for near in [f32::NAN, f32::INFINITY, -1.0] {
            assert!(matches!(plan(-1.0, 1.0, near), Err(PlanError::Near { .. })), "{near}");
        }
    }

    #[test]
    fn bricks_near_visible_voxels_are_kept_and_others_dropped() {
        let bounds = Aabb::cube(1.0);
        let coarse = Domain::with_longest(bounds, Extent::Bounded, 33);
        let fine = Domain::with_longest(bounds, Extent::Bounded, 65);
        let field =
            VoxelField::uniform(coarse, BrickMap::dense(coarse.resolution), ShDegree::default(), -5.0);
        let mut peak = vec![0.0; field.map.voxels()];
        peak[field.map.voxel([16, 16, 16])] = 1.0;
        let map = kept_bricks(&field.map, &peak, 0.5, &fine);
        // Node 16 ± 1 of the old grid is node 30 to 34 of the new one: bricks 7 and 8.
        assert_eq!(map.bricks().len(), 8);
        assert!(map.bricks().iter().flatten().all(|&b| b == 7 || b == 8));
    }

    /// A grid before cameras that look ahead, as wide as it is deep at infinity.
    fn forward_facing() -> Extent {
        let axes = [vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0)];
        let edges = [[-0.25, 0.25]; 2];
        Extent::Projective(Projection { eye: Vec3::zero(), axes, near: 1.0, edges, baseline: 1.0 })
    }

    #[test]
    fn a_finer_forward_facing_grid_stores_a_smaller_share() {
        let share = |longest| {
            let domain = Domain::with_longest(Aabb::cube(1.0), forward_facing(), longest);
            stored_share(&Options::default(), None, &domain)
        };
        let [coarse, fine] = [74, 148].map(share);
        assert!((coarse - 0.448).abs() < 0.001 && (fine - 0.257).abs() < 0.001, "{coarse} {fine}");
    }

    #[test]
    fn more_rays_teach_more_nodes_of_a_box_within_limits() {
        let nodes = |steps: u64, extent| {
            let mut options = Options::default();
            options.run.steps = steps;
            taught(&options, extent)
        };
        let in_box = [10, 1_400, 2_930, 4_883, 1_000_000].map(|steps| nodes(steps, Extent::Bounded));
        assert_eq!(in_box, [256, 256, 323, 384, 384]);
        assert_eq!([10, 1_000_000].map(|steps| nodes(steps, Extent::Contracted)), [CONTRACTED; 2]);
    }

    #[test]
    fn resolution_matches_the_pixels_and_the_memory() {
        let camera = refraxel_core::Camera::look_at(
            vec3(4.0, 0.0, 0.0),
            Vec3::zero(),
            vec3(0.0, 0.0, 1.0),
            0.69,
            [200, 200],
        );
        let view = View::of_file("a", camera);
        let bounds = Aabb::new(vec3(-1.0, -1.0, -1.0), vec3(1.0, 1.0, 1.0));
        let region = Region { bounds, up: vec3(0.0, 0.0, 1.0), unbounded: false, projection: None };
        let full = finest_domain(&Options::default(), &region, &[&view], || None);
        // 200 pixels see 2 × 4 tan(0.345) = 2.87 units: 139 pixels across the box.
        let expected = (139.0 * VOXELS_PER_PIXEL[0]) as u32;
        assert!(full.resolution[0].abs_diff(expected) <= 1, "{:?}", full.resolution);
        let tight = |surface: Option<f64>| {
            let mut tight = Options::default();
            tight.run.memory = 0.01;
            let domain = finest_domain(&tight, &region, &[&view], || surface);
            let bytes = model_bytes(&tight, &domain, stored_share(&tight, surface, &domain));
            assert!((0.95..=1.0).contains(&(bytes / (0.01 * (1_u64 << 30) as f64))), "{bytes}");
            domain.resolution[0]
        };
        assert!(tight(None) < 80);
        assert!(tight(Some(1.0)) > 80, "a grid with little surface may be finer");
    }
}

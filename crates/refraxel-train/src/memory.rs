//! How much memory training will take, before it starts.

use crate::options::{Options, StartShape};
use crate::plan::{bytes_per_voxel, stored_share};
use crate::refraction_search::OCCLUDER_RAYS;
use crate::schedule::{VARIATION_PERIOD, stage_domain};
use crate::silhouettes::{Occluders, Outlines};
use crate::trainer::PRUNING_RAYS;
use refraxel_core::{Domain, ShDegree};
use refraxel_data::{Backdrop, Dataset, MaskMeaning, Part, View};
use serde::Serialize;

/// The program itself [byte]. Measured, docs/growth.md.
const PROGRAM_BYTES: u64 = 20 << 20;
/// A ray that decides what is pruned, and its share of the samples [byte]. Measured, docs/growth.md.
const PRUNING_BYTES_PER_RAY: u64 = 36;
/// Rays, records and tapes of one training step [byte per ray]. Measured, docs/growth.md.
const STEP_BYTES_PER_RAY: u64 = 1300;
/// Tables of a stored voxel: a brick of 64 has its coordinates, its forward row and its occupied cells [byte].
const TABLE_BYTES_PER_VOXEL: f64 = (12 + 32 + 8) as f64 / 64.0;
/// The brick table has an entry per brick, stored or not [byte per node].
const TABLE_BYTES_PER_NODE: f64 = 4.0 / 64.0;
/// Scoring a view: its truth, the order of its rays, its colour, opacity and depth, and both pictures in floating point for SSIM
/// [byte per pixel]. Measured, docs/growth.md.
const SCORING_BYTES_PER_PIXEL: u64 = 40;
/// Finding the box of a scene before a backdrop: sums over rectangles of so many views [byte per pixel].
const BOX_BYTES_PER_PIXEL: u64 = 4;
const BOX_VIEWS: usize = 32;

/// What a run will take. Sizes in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Nodes of the final grid.
    pub resolution: [u32; 3],
    /// How far the grid reaches: bounded, contracted or projective.
    pub extent: &'static str,
    /// Parameters and moments of one stored voxel.
    pub bytes_per_voxel: u64,
    /// Voxels stored at the end, from the surface that the photographs show, or else the typical share that survives pruning.
    pub voxels: u64,
    /// Parameters and moments at the end.
    pub model: u64,
    /// Decoded training photographs and masks.
    pub photos: u64,
    /// Maps of the silhouettes, while refractive things are sought among masks.
    pub silhouettes: u64,
    /// Rays, records and gradients of one step.
    pub step: u64,
    /// The largest sum of what is held at the same time: the program and the photographs, and either what finds the box, or model, its
    /// copy to return to after an overflow, what validation takes, and one step's records or the maps of the silhouettes; or scoring.
    pub peak: u64,
}

/// Forecasts a run with `options` that ends on the grid `finest`; decodes no pixels. `surface` is the
/// [density of surfaces](refraxel_data::Region::surface_density) that the photographs show, where that is known.
pub fn forecast(options: &Options, finest: &Domain<f32>, data: &Dataset, surface: Option<f64>) -> Forecast {
    let degree = ShDegree::new(options.field.sh_degree).unwrap_or_default();
    let per_voxel = bytes_per_voxel(degree) as f64;
    let stages: Vec<Stage> =
        (0..options.grid.stages).map(|stage| Stage::of(options, finest, surface, stage)).collect();
    let last = stages.last().copied().unwrap_or_default();
    let held = |s: &Stage| s.voxels * (per_voxel + TABLE_BYTES_PER_VOXEL) + s.nodes * TABLE_BYTES_PER_NODE;
    let steady = stages.iter().map(|s| 2.0 * held(s));
    let changing = stages.windows(2).map(|w| held(&w[0]) + held(&w[1]));
    let models = steady.chain(changing).fold(0.0, f64::max) as u64;
    let step = u64::from(options.run.batch) * STEP_BYTES_PER_RAY + variation_bytes(options, last.voxels);
    let is_searched = options.refraction.bend.is_on() && options.shape.start != StartShape::File;
    let silhouettes = if is_searched { silhouette_bytes(data) } else { 0 };
    let photos = photo_bytes(data);
    let training = photos + scoring_bytes(data, Part::Val) + models + step.max(silhouettes);
    let scoring = held(&last) as u64 + scoring_bytes(data, Part::Test);
    Forecast {
        resolution: finest.resolution,
        extent: finest.extent.name(),
        bytes_per_voxel: per_voxel as u64,
        voxels: last.voxels as u64,
        model: (last.voxels * per_voxel) as u64,
        photos,
        silhouettes,
        step,
        peak: PROGRAM_BYTES + pruning_bytes(data) + training.max(scoring).max(photos + opening_bytes(data)),
    }
}

/// The grid of a stage.
#[derive(Clone, Copy, Debug, Default)]
struct Stage {
    nodes: f64,
    /// Those that are stored.
    voxels: f64,
}

impl Stage {
    fn of(options: &Options, finest: &Domain<f32>, surface: Option<f64>, stage: u32) -> Self {
        let domain = stage_domain(options, finest, stage);
        let nodes = domain.resolution.iter().map(|&n| f64::from(n)).product();
        // The first grid is dense, later ones keep what was seen.
        let kept = if stage == 0 { 1.0 } else { stored_share(options, surface, &domain) };
        Self { nodes, voxels: nodes * kept }
    }
}

/// Voxels that the largest grid of a run is expected to store, where nobody knows the surface yet.
pub fn most_voxels(options: &Options, finest: &Domain<f32>) -> u64 {
    let voxels = |stage| Stage::of(options, finest, None, stage).voxels as u64;
    (0..options.grid.stages).map(voxels).max().unwrap_or(0)
}

/// Gradients of the buckets whose turn of total variation it is: those of density and colour, and a byte, per voxel.
fn variation_bytes(options: &Options, voxels: f64) -> u64 {
    let field = &options.field;
    let degree = ShDegree::new(field.sh_degree).unwrap_or_default();
    let is_on = field.tv_density > 0.0 || field.tv_colour > 0.0;
    let share = if is_on { 1.0 / f64::from(VARIATION_PERIOD) } else { 0.0 };
    (voxels * share * (4 * (1 + degree.stride()) + 1) as f64) as u64
}

/// Pixels of a view.
fn pixels(view: &View) -> u64 {
    u64::from(view.camera.width) * u64::from(view.camera.height)
}

/// The rays that decide what is pruned: one through each pixel, if there are not too many.
fn pruning_bytes(data: &Dataset) -> u64 {
    let all: u64 = data.split.train.iter().map(|&i| pixels(&data.views[i])).sum();
    PRUNING_BYTES_PER_RAY * all.min(PRUNING_RAYS)
}

/// What opening the data takes beside the training photographs: the box of a scene before a backdrop, or photographs that are
/// to be scored and are looked at.
fn opening_bytes(data: &Dataset) -> u64 {
    let at_once = 2 * rayon::current_num_threads();
    let tests = data.split.test.iter().take(at_once).map(|&i| decoded_bytes(data, i)).sum();
    box_sums(data).sum::<u64>().max(tests)
}

/// The sums of each view that finds the box.
fn box_sums(data: &Dataset) -> impl Iterator<Item = u64> {
    let train = &data.split.train;
    let is_boxed = data.backdrop != Backdrop::Surroundings;
    let shown = train.iter().step_by(train.len().div_ceil(BOX_VIEWS).max(1)).filter(move |_| is_boxed);
    shown.map(|&i| BOX_BYTES_PER_PIXEL * pixels(&data.views[i]))
}

/// What scoring the first view of a part takes, with its photograph.
fn scoring_bytes(data: &Dataset, part: Part) -> u64 {
    let first = part.views(data).first();
    first.map_or(0, |&i| SCORING_BYTES_PER_PIXEL * pixels(&data.views[i]) + decoded_bytes(data, i))
}

/// The pixels of a view with 8 bits per channel, and its mask: alpha is there where that says what is behind.
fn decoded_bytes(data: &Dataset, view: usize) -> u64 {
    let channels = if data.backdrop == Backdrop::Transparent { 4 } else { 3 };
    let view = &data.views[view];
    pixels(view) * (channels + u64::from(view.has_mask()))
}

/// The training photographs and their masks.
fn photo_bytes(data: &Dataset) -> u64 {
    data.split.train.iter().map(|&i| decoded_bytes(data, i)).sum()
}

/// Most that the maps of the silhouettes of the training views need: distances to contours and occluders, as
/// [`Outlines::bytes_for`] and [`Occluders::most_bytes`] say.
fn silhouette_bytes(data: &Dataset) -> u64 {
    let views = data.split.train.iter().map(|&i| &data.views[i]);
    let masked = views.filter(|v| v.has_mask() && v.mask_meaning == MaskMeaning::Refractive);
    let sizes: Vec<[u32; 2]> = masked.map(|v| [v.camera.width, v.camera.height]).collect();
    let pixels = sizes.iter().map(|&[w, h]| u64::from(w) * u64::from(h)).sum();
    let cell = Occluders::cell_for(pixels, OCCLUDER_RAYS);
    let occluders: u64 = sizes.iter().map(|&size| Occluders::most_bytes(size, cell)).sum();
    Outlines::bytes_for(&sizes) + occluders
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Switch;
    use crate::plan::TYPICAL_OCCUPANCY;
    use crate::silhouettes::MAP_BYTES;
    use refraxel_core::{Aabb, Camera, Extent, Vec3, vec3};
    use refraxel_data::{AlphaUse, Format, LocalOrigin, Orientation, PhotoSource, Split};

    fn dataset(views: Vec<View>) -> Dataset {
        let split = Split { train: (0..views.len()).collect(), ..Split::default() };
        Dataset {
            root: None,
            format: Format::Memory,
            origin: LocalOrigin::default(),
            views,
            split,
            backdrop: Backdrop::Transparent,
            stated_box: None,
            up: None,
            points: Vec::new(),
            depth_range: None,
            truth: None,
            problems: Vec::new(),
        }
    }

    /// A view of this size with a mask of what is refractive.
    fn masked(size: [u32; 2]) -> View {
        let camera = Camera::look_at(vec3(4.0, 0.0, 0.0), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, size);
        let source = PhotoSource::Files {
            image: "a.png".into(),
            mask: Some("m.png".into()),
            stored: None,
            orientation: Orientation::Upright,
            alpha: AlphaUse::Kept,
        };
        View { source, mask_meaning: MaskMeaning::Refractive, ..View::of_file("a.png", camera) }
    }

    #[test]
    fn silhouettes_of_a_hundred_photographs_of_12_megapixels_stay_within_their_budget() {
        const OCCLUDER_BYTES: u64 = 24 * 600_000; // cells are whole pixels, and some stick out of the image
        for count in [1, 100, 1000] {
            let bytes = silhouette_bytes(&dataset(vec![masked([4000, 3000]); count]));
            assert!(bytes > 1 << 20 && bytes < MAP_BYTES + OCCLUDER_BYTES, "{count} views: {bytes} bytes");
        }
        let without = View { mask_meaning: MaskMeaning::Keep, ..masked([4000, 3000]) };
        assert_eq!(silhouette_bytes(&dataset(vec![without])), 0);
    }

    #[test]
    fn the_peak_holds_the_silhouettes_where_they_need_more_than_a_step() {
        let finest = Domain::with_longest(Aabb::new(Vec3::zero(), Vec3::splat(1.0)), Extent::Bounded, 65);
        let (mut options, mut data) = (Options::default(), dataset(vec![masked([4000, 3000]); 40]));
        data.backdrop = Backdrop::Surroundings;
        (options.run.batch, options.refraction.bend) = (1, Switch::On);
        let bent = forecast(&options, &finest, &data, None);
        options.refraction.bend = Switch::Off;
        let straight = forecast(&options, &finest, &data, None);
        assert_eq!((straight.silhouettes, bent.silhouettes), (0, silhouette_bytes(&data)));
        assert_eq!(bent.peak - straight.peak, bent.silhouettes - straight.step);
    }

    #[test]
    fn a_deep_coarse_to_fine_run_peaks_at_its_last_stage_and_a_shallow_one_at_its_dense_grid() {
        let data = dataset(Vec::new());
        let finest = Domain::with_longest(Aabb::new(Vec3::zero(), Vec3::splat(1.0)), Extent::Bounded, 65);
        let of = |stages, surface| {
            let mut options = Options::default();
            (options.grid.stages, options.run.batch) = (stages, 1);
            forecast(&options, &finest, &data, surface)
        };
        let (deep, shallow) = (of(3, None), of(1, None));
        let nodes = 65_u64.pow(3);
        assert_eq!(shallow.model, nodes * shallow.bytes_per_voxel);
        let tables = |voxels: f64| voxels * TABLE_BYTES_PER_VOXEL + nodes as f64 * TABLE_BYTES_PER_NODE;
        let beside = |f: Forecast| PROGRAM_BYTES + f.step + (2.0 * tables(f.voxels as f64)) as u64;
        assert!(shallow.peak.abs_diff(2 * shallow.model + beside(shallow)) <= 2);
        assert_eq!(deep.voxels, (nodes as f64 * TYPICAL_OCCUPANCY) as u64);
        assert!(deep.peak.abs_diff(2 * deep.model + beside(deep)) <= 2);
        let flat = of(3, Some(1.0));
        assert!(flat.voxels < deep.voxels / 2, "a single plane across the box: {flat:?}");
    }

    #[test]
    fn large_photographs_of_few_voxels_peak_while_they_are_opened_or_scored() {
        let finest = Domain::with_longest(Aabb::new(Vec3::zero(), Vec3::splat(1.0)), Extent::Bounded, 16);
        let options = Options::default();
        let pixels = 4000 * 3000;
        let (mut data, few) = (dataset(vec![masked([4000, 3000]); 5]), 1 << 20);
        data.backdrop = Backdrop::Surroundings;
        let step = forecast(&options, &finest, &data, None).step;
        let rest = PROGRAM_BYTES + PRUNING_BYTES_PER_RAY * PRUNING_RAYS;
        let peak = |data: &Dataset| forecast(&options, &finest, data, None).peak - rest;
        assert!(peak(&data) < 5 * 4 * pixels + step + few);
        data.backdrop = Backdrop::Transparent;
        assert_eq!(peak(&data), 5 * 5 * pixels + 5 * BOX_BYTES_PER_PIXEL * pixels);
        (data.split.train, data.split.test) = (vec![0], vec![1]);
        assert!(peak(&data).abs_diff((SCORING_BYTES_PER_PIXEL + 5) * pixels) < few);
    }
}

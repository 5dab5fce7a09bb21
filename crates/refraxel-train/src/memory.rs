//! How much memory training will take, before it starts.

use crate::initial::{Occluders, Outlines};
use crate::options::Options;
use crate::plan::{TYPICAL_OCCUPANCY, bytes_per_voxel};
use crate::recipe::OCCLUDER_RAYS;
use crate::schedule::stage_domain;
use refraxel_core::{Domain, Extent, ShDegree};
use refraxel_data::{Dataset, MaskMeaning};
use serde::Serialize;

/// Records, tapes and scratch of one training step: samples kept per ray times their size [byte per ray].
const STEP_BYTES_PER_RAY: f64 = 4096.0;

/// What a run will take. Sizes in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Forecast {
    /// Nodes of the final grid.
    pub resolution: [u32; 3],
    /// Whether the grid reaches to infinity.
    pub contracted: bool,
    /// Parameters and moments of one stored voxel.
    pub bytes_per_voxel: u64,
    /// Voxels stored at the end, from the typical share that survives pruning.
    pub voxels: u64,
    /// Parameters and moments at the end.
    pub model: u64,
    /// Decoded training photographs and masks.
    pub photos: u64,
    /// Maps of the silhouettes, while refractive things are sought among masks.
    pub silhouettes: u64,
    /// The largest sum of photographs, model, its copy to return to after an overflow, and either one step's records or
    /// the maps of the silhouettes.
    pub peak: u64,
}

/// Forecasts a run with `options` that ends on the grid `finest`; decodes no pixels.
pub fn forecast(options: &Options, finest: &Domain<f32>, data: &Dataset) -> Forecast {
    let degree = ShDegree::new(options.field.sh_degree).unwrap_or_default();
    let per_voxel = bytes_per_voxel(degree);
    let stages: Vec<f64> = (0..options.grid.stages)
        .map(|stage| {
            let domain = stage_domain(options, finest, stage);
            let nodes: f64 = domain.resolution.iter().map(|&n| f64::from(n)).product();
            // The first grid is dense, later ones keep what was seen.
            let kept = if stage == 0 { 1.0 } else { TYPICAL_OCCUPANCY };
            nodes * kept * per_voxel as f64
        })
        .collect();
    let model = stages.last().copied().unwrap_or(0.0);
    let steady = stages.iter().map(|s| 2.0 * s);
    let changing = stages.windows(2).map(|w| w[0] + w[1]);
    let photos = photo_bytes(data);
    let step = f64::from(options.run.batch) * STEP_BYTES_PER_RAY;
    let silhouettes = if options.refraction.bend.is_on() { silhouette_bytes(data) } else { 0 };
    let beside = step.max(silhouettes as f64);
    Forecast {
        resolution: finest.resolution,
        contracted: finest.extent == Extent::Contracted,
        bytes_per_voxel: per_voxel,
        voxels: (model / per_voxel as f64) as u64,
        model: model as u64,
        photos,
        silhouettes,
        peak: photos + (steady.chain(changing).fold(0.0, f64::max) + beside) as u64,
    }
}

/// Pixels of the training views with four channels of 8 bits, and their masks.
fn photo_bytes(data: &Dataset) -> u64 {
    let views = data.split.train.iter().map(|&i| &data.views[i]);
    let bytes = views.map(|v| {
        let pixels = u64::from(v.camera.width) * u64::from(v.camera.height);
        pixels * (4 + u64::from(v.has_mask()))
    });
    bytes.sum()
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
    use crate::initial::MAP_BYTES;
    use crate::options::Switch;
    use refraxel_core::{Aabb, Camera, Vec3, vec3};
    use refraxel_data::{Backdrop, Format, PhotoSource, Split, View};

    fn dataset(views: Vec<View>) -> Dataset {
        let split = Split { train: (0..views.len()).collect(), ..Split::default() };
        Dataset {
            root: None,
            format: Format::Memory,
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
        let source = PhotoSource::Files { image: "a.png".into(), mask: Some("m.png".into()), stored: None };
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
        let (mut options, data) = (Options::default(), dataset(vec![masked([4000, 3000]); 40]));
        (options.run.batch, options.refraction.bend) = (1, Switch::On);
        let bent = forecast(&options, &finest, &data);
        options.refraction.bend = Switch::Off;
        let straight = forecast(&options, &finest, &data);
        assert_eq!((straight.silhouettes, bent.silhouettes), (0, silhouette_bytes(&data)));
        assert_eq!(bent.peak - straight.peak, bent.silhouettes - 4096);
    }

    #[test]
    fn a_deep_coarse_to_fine_run_peaks_at_its_last_stage_and_a_shallow_one_at_its_dense_grid() {
        let data = dataset(Vec::new());
        let finest = Domain::with_longest(Aabb::new(Vec3::zero(), Vec3::splat(1.0)), Extent::Bounded, 65);
        let of = |stages| {
            let mut options = Options::default();
            (options.grid.stages, options.run.batch) = (stages, 1);
            forecast(&options, &finest, &data)
        };
        let (deep, shallow) = (of(3), of(1));
        let nodes = 65_u64.pow(3);
        assert_eq!(shallow.model, nodes * shallow.bytes_per_voxel);
        assert_eq!(shallow.peak, 2 * shallow.model + 4096);
        assert_eq!(deep.voxels, (nodes as f64 * TYPICAL_OCCUPANCY) as u64);
        assert!(deep.peak.abs_diff(2 * deep.model + 4096) <= 1);
    }
}

//! How much memory training will take, before it starts.

use crate::model::{TYPICAL_OCCUPANCY, bytes_per_voxel};
use crate::options::Options;
use crate::schedule::stage_domain;
use refraxel_core::{Domain, Extent, ShDegree};
use refraxel_data::Dataset;
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
    /// The largest sum of photographs, model, its copy to return to after an overflow, and one step's records.
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
    Forecast {
        resolution: finest.resolution,
        contracted: finest.extent == Extent::Contracted,
        bytes_per_voxel: per_voxel,
        voxels: (model / per_voxel as f64) as u64,
        model: model as u64,
        photos,
        peak: photos + (steady.chain(changing).fold(0.0, f64::max) + step) as u64,
    }
}

/// Pixels of the training views with four channels of 8 bits, and their masks.
fn photo_bytes(data: &Dataset) -> u64 {
    let views = data.split.train.iter().map(|&i| &data.views[i]);
    let bytes = views.map(|v| {
        let pixels = u64::from(v.camera.width) * u64::from(v.camera.height);
        pixels * (4 + u64::from(v.mask.is_some()))
    });
    bytes.sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::bounds_of;
    use refraxel_data::{Backdrop, Format, Split};

    #[test]
    fn a_deep_coarse_to_fine_run_peaks_at_its_last_stage_and_a_shallow_one_at_its_dense_grid() {
        let data = Dataset {
            root: "x".into(),
            format: Format::Transforms,
            views: Vec::new(),
            split: Split::default(),
            backdrop: Backdrop::Transparent,
            stated_box: None,
            points: Vec::new(),
            depth_range: None,
            truth: None,
            problems: Vec::new(),
        };
        let finest = Domain::with_longest(bounds_of([[0.0; 3], [1.0; 3]]), Extent::Bounded, 65);
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

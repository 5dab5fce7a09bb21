//! Regions whose index or shape is known before training.

use super::region::Region;
use super::{Start, refraction};
use crate::initial::{Profile, Site, Spacing, region_grid};
use crate::model::{Gate, Refraction};
use crate::options::{IndexIntegrator, Options, Switch};
use refraxel_core::{IndexGrid, LevelSet, Vec3};
use refraxel_data::IndexSource;

/// A known index on a grid with about this many nodes along its longest edge. A body of one index has a sharp surface. The
/// index of a mesh is `search.guess`.
pub fn known_refraction(source: &IndexSource, nodes: u32, options: &Options) -> Refraction {
    let (bounds, resolution) = region_grid(&source.bounds().cast(), Spacing::Longest(nodes));
    let site = Site { bounds, resolution, interpolation: options.index.interpolation.into() };
    // It need not learn: nothing is blurred, and all that is not vacuum bends.
    let mut options = options.clone();
    (options.shape.smooth, options.shape.gate) = (0.0, Switch::Off);
    let region = Region { trainable: Vec::new(), ..Region::of_known(site, source, &options) };
    let is_sharp = region.has_one_index() && options.index.integrator == IndexIntegrator::Leapfrog;
    let profile = if is_sharp { Profile::Sharp } else { Profile::Smooth };
    let start = Start { profile, index: options.search.guess, wall: 1.0, searched: false };
    let mut known = refraction(&[region], &[start], &options);
    known.find_flat_cells();
    known
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
    /// The region of a known index.
    pub(super) fn of_known(site: Site, source: &IndexSource, options: &Options) -> Self {
        let known = |grid: &IndexGrid<f32>| grid.coefficients().iter().map(|c| (2.0 * c).sqrt()).collect();
        match source {
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
                region.trainable.iter_mut().zip(&bends).for_each(|(trainable, bends)| *trainable |= bends);
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
}

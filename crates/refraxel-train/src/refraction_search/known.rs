//! Regions whose index or shape is known before training: one field, or bodies in bodies.

use super::hypotheses::{refraction, simplest};
use super::region::{Region, Shape};
use super::surface::{Form, Surface};
use crate::level_set::half_full;
use crate::model::{Gate, Refraction, RegionState};
use crate::options::{IndexIntegrator, Options, SurfaceProfile};
use crate::silhouettes::{Site, Spacing};
use refraxel_core::{Aabb, IndexGrid, LevelSet, Vec3};
use refraxel_data::IndexSource;
use refraxel_data::synth::{self, ConstantBody};

/// A known index on grids with about this many nodes along their longest edges: bodies of one index each where a truth has
/// several, with sharp surfaces and in their order; otherwise [`known_field`].
pub fn known_refraction(source: &IndexSource, nodes: u32, options: &Options) -> Refraction {
    let interpolation = options.index.interpolation.into();
    let site = |bounds: &Aabb<f32>| Site::around(bounds, Spacing::Longest(nodes), interpolation);
    match bodies(source, site, options) {
        None => known_field(source, nodes, options),
        Some(regions) => held(&regions, options),
    }
}

/// A known index on one grid with about this many nodes along its longest edge. A body of one index has a sharp surface.
/// The index of a mesh is `search.guess`.
pub fn known_field(source: &IndexSource, nodes: u32, options: &Options) -> Refraction {
    let interpolation = options.index.interpolation.into();
    let site = Site::around(&source.bounds().cast(), Spacing::Longest(nodes), interpolation);
    // It need not learn: nothing is blurred, and all that is not vacuum bends.
    let mut options = options.clone();
    let region = Region { state: RegionState::default(), ..Region::of_known(site, source) };
    if options.index.integrator != IndexIntegrator::Leapfrog {
        options.search.profile = SurfaceProfile::Smooth;
    }
    let mut known = held(&[region], &options);
    known.find_flat_cells();
    known
}

/// What regions say without a search.
fn held(regions: &[Region], options: &Options) -> Refraction {
    let bodies = regions.iter().flat_map(|r| simplest(r, options).bodies(r, options));
    refraction(bodies.collect(), options)
}

/// The bodies of a truth that has several of one index each, in the order in which they rule, each on a grid of its own.
/// `None` where one field has to hold all of it: where there is one body or an index varies, and where options ask for other
/// than sharp surfaces.
pub(super) fn bodies(
    source: &IndexSource,
    site: impl Fn(&Aabb<f32>) -> Site,
    options: &Options,
) -> Option<Vec<Region>> {
    let IndexSource::Truth(truth) = source else { return None };
    let may_be_sharp = matches!(options.search.profile, SurfaceProfile::Auto | SurfaceProfile::Sharp)
        && options.index.integrator == IndexIntegrator::Leapfrog;
    let bodies = truth.constant_bodies().filter(|bodies| may_be_sharp && bodies.len() > 1)?;
    Some(bodies.iter().map(|b| Region::of_body(site(&b.shape.bounds().cast()), b)).collect())
}

/// Signed distance from a body that fills these shares of the nodes' voxels.
fn filled(site: &Site, share: impl Fn(usize) -> f32) -> LevelSet<f32> {
    let mut level = half_full(&site.domain(), share);
    level.redistance();
    level
}

impl Region {
    /// The region of one body of a truth.
    fn of_body(site: Site, body: &ConstantBody) -> Self {
        let distance = |x: Vec3<f32>| body.shape.surface(x.cast()).0 as f32;
        // Flat faces are exact either way. A spline through the distances rings beside their edges, over some voxels; one of
        // control values rounds the edges alone.
        let level = match body.shape {
            synth::Shape::Box(_) | synth::Shape::Polyhedron(_) => {
                LevelSet::from_control_values(site.bounds, site.resolution, distance)
            }
            _ => LevelSet::from_samples(site.bounds, site.resolution, distance),
        };
        let surface = Surface::new(Form::Free, level);
        let n = vec![body.index as f32; surface.distance.len()];
        Self::new(site, vec![Shape::Surface(surface), Shape::Known(n)])
    }

    /// True for one of the bodies of a truth, which may overlap and need sharp surfaces.
    pub(super) fn is_body_of_truth(&self) -> bool {
        let known = self.known().filter(|_| self.surface().is_some());
        known.is_some_and(|n| n.iter().all(|v| *v == n[0]))
    }

    /// Whether its index does not learn: that of a bubble.
    pub(super) fn holds_index(&self) -> bool {
        self.is_body_of_truth() && self.known().is_some_and(|n| n[0] == 1.0)
    }

    /// The region of a known index.
    pub(super) fn of_known(site: Site, source: &IndexSource) -> Self {
        let known = |grid: &IndexGrid<f32>| -> Vec<f32> {
            grid.coefficients().iter().map(|c| (2.0 * c).sqrt()).collect()
        };
        let surface = |level| Shape::Surface(Surface::new(Form::Free, level));
        match source {
            IndexSource::Truth(truth) => {
                let distance = |x: Vec3<f32>| truth.signed_distance_like(x.cast()) as f32;
                let mut region = Self::body(site, distance);
                region.shapes.push(Shape::Known(known(&site.truth(truth))));
                region
            }
            IndexSource::Volume(volume) => {
                let n = known(&site.volume(volume));
                let most = n.iter().copied().fold(1.0, f32::max);
                let level = filled(&site, |j| (n[j] - 1.0) / (most - 1.0).max(1e-6));
                let mut region = Self::new(site, vec![surface(level)]);
                // A lens bends rays beyond the surface at which it has half its contrast.
                let bends: Vec<bool> = n.iter().map(|n| (n - 1.0).abs() > 0.01 * (most - 1.0)).collect();
                let share: Vec<f32> = bends.iter().map(|b| f32::from(u8::from(*b))).collect();
                region.state.gate = Some(Gate::new(site.domain(), &share));
                let trainable = region.state.trainable.iter_mut();
                trainable.zip(&bends).for_each(|(trainable, bends)| *trainable |= bends);
                region.shapes.push(Shape::Known(n));
                region
            }
            IndexSource::Mesh(shape) => {
                let solid = known(&site.shape(shape, 2.0));
                let level = site.distance(shape, &filled(&site, |j| solid[j] - 1.0));
                Self::new(site, vec![surface(level)])
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_data::synth::{IndexTruth, SceneOptions, scene};

    fn truth(name: &str) -> IndexSource {
        IndexTruth::of_scene(&scene(name, &SceneOptions::default()).unwrap()).unwrap().into()
    }

    #[test]
    fn a_truth_of_several_bodies_becomes_one_sharp_region_for_each_in_their_order() {
        let options = Options::default();
        for (name, indices) in [
            ("aquarium", &[1.5, 1.33, 1.0][..]),
            ("hollow_ball", &[1.5, 1.0]),
            ("two_indices", &[1.7, 1.33]),
            ("tinted_glass", &[1.5, 1.5]),
        ] {
            let known = known_refraction(&truth(name), 48, &options);
            let regions = known.medium.regions();
            let found: Vec<f32> = regions.iter().map(|r| r.interior_index().unwrap()).collect();
            assert!(found.iter().zip(indices).all(|(a, b)| (a - b).abs() < 1e-6), "{name}: {found:?}");
            assert!(regions.iter().all(|r| r.level_set().is_some()) && found.len() == indices.len());
            for (state, n) in known.states.iter().zip(indices) {
                assert_eq!(state.fixed_index, *n == 1.0, "{name}: only air is held");
            }
            let IndexSource::Truth(truth) = truth(name) else { unreachable!() };
            let (mut compared, voxel) = (0, f64::from(regions[0].level_set().unwrap().voxel()));
            for k in 0..3000_u32 {
                let t = f64::from(k);
                let x = Vec3 { x: (t * 0.71).sin(), y: (t * 1.3).cos(), z: (t * 2.37).sin() } * 0.6;
                let bodies = truth.constant_bodies().unwrap();
                // Away from the surfaces, whose edges are rounded.
                if bodies.iter().all(|b| b.shape.surface(x).0.abs() > voxel) {
                    assert!((f64::from(known.index(x.cast())) - truth.n(x)).abs() < 1e-6, "{name} {x:?}");
                    compared += 1;
                }
            }
            assert!(compared > 1000, "{name}: {compared}");
        }
    }

    #[test]
    fn graded_and_single_bodies_and_soft_edges_stay_one_field() {
        let mut options = Options::default();
        for name in ["luneburg", "glass_ball"] {
            let one = known_refraction(&truth(name), 32, &options);
            assert_eq!((one.medium.regions().len(), one.states[0].fixed_index), (1, false), "{name}");
        }
        options.search.profile = SurfaceProfile::Smooth;
        assert_eq!(known_refraction(&truth("aquarium"), 32, &options).medium.regions().len(), 1);
    }
}

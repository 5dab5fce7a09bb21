//! A refractive region before it learns: its shape, and the grid that an index gives it.

use super::Start;
use crate::blur::gaussian_blur;
use crate::events::Event;
use crate::initial::{Profile, Site};
use crate::model::polyhedron::Polyhedron;
use crate::model::{Gate, RegionState};
use crate::options::{Options, StartShape};
use refraxel_core::{Domain, IndexGrid, LevelSet, Vec3};

/// A refractive region before it has an index.
pub(super) struct Region {
    pub site: Site,
    /// Signed distance from the surface, negative inside; absent where the shape is not a body.
    pub surface: Option<LevelSet<f32>>,
    /// n at the nodes where it is known.
    pub known: Option<Vec<f32>>,
    /// Share of each node's voxel inside, 0 to 1, blurred.
    pub occupancy: Vec<f32>,
    /// φ of the surface at the nodes; empty without one.
    pub distance: Vec<f32>,
    /// Per node: whether the index may be learned there; empty for everywhere.
    pub trainable: Vec<bool>,
    pub gate: Option<Gate>,
    /// The planes of its surface, where they are all of it.
    pub solid: Option<Polyhedron>,
}

impl Region {
    /// Nothing refractive yet.
    pub(super) fn uniform(site: Site) -> Self {
        let nodes = site.domain().resolution.map(|n| n as usize).iter().product();
        let (occupancy, trainable) = (vec![0.0; nodes], Vec::new());
        Self {
            site,
            surface: None,
            known: Some(vec![1.0; nodes]),
            occupancy,
            distance: Vec::new(),
            trainable,
            gate: None,
            solid: None,
        }
    }

    /// A body by its signed distance.
    pub(super) fn body(site: Site, distance: impl Fn(Vec3<f32>) -> f32, options: &Options) -> Self {
        let surface = LevelSet::from_samples(site.bounds, site.resolution, distance);
        Self::new(site, surface, options)
    }

    pub(super) fn new(site: Site, surface: LevelSet<f32>, options: &Options) -> Self {
        let nodes = surface.coefficients().len();
        let distance: Vec<f32> = (0..nodes).map(|j| surface.value(surface.position(j))).collect();
        let voxel = site.domain().voxel();
        let mut occupancy: Vec<f32> = distance.iter().map(|d| (0.5 - d / voxel).clamp(0.0, 1.0)).collect();
        let gate = options.shape.gate.is_on().then(|| Gate::new(site.domain(), &occupancy));
        gaussian_blur(&mut occupancy, site.resolution, options.shape.smooth);
        let trainable = if options.shape.interior.is_on() {
            distance.iter().map(|&d| d < 2.0 * voxel).collect()
        } else {
            Vec::new()
        };
        Self { site, surface: Some(surface), known: None, occupancy, distance, trainable, gate, solid: None }
    }

    /// Its index is known from a file.
    pub(super) fn is_known(&self) -> bool {
        self.known.is_some()
    }

    /// What a file says of its inside is one number, but at its surface.
    pub(super) fn has_one_index(&self) -> bool {
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

    /// what is reported of region number `k`.
    pub(super) fn found(&self, k: usize) -> Event {
        let bounds = &self.site.bounds;
        Event::RegionFound {
            region: k,
            center: bounds.center().to_array(),
            extent: bounds.extent().to_array(),
            nodes: self.site.resolution,
            faces: self.solid.as_ref().map(|s| s.faces.len()),
        }
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
    pub(super) fn state(&self, start: &Start) -> RegionState {
        let searched = start.searched.then_some(start.index);
        match start.profile {
            // Rays that miss a sharp surface do not bend: no gate is needed, and the surface may move.
            Profile::Sharp => {
                // A hollow body has surfaces inside.
                let solid = self.solid.clone().filter(|_| start.wall >= 1.0);
                RegionState { searched, solid, ..RegionState::default() }
            }
            _ => RegionState {
                trainable: self.trainable.clone(),
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
    use refraxel_core::Aabb;

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
        let (mut held, mut known) = (usual.clone(), usual);
        known.shape.start = StartShape::File;
        held.surface.rate = 0.0;

        assert!(learning(&held, 1.0).is_none() && learning(&known, 1.0).is_none());
    }
}

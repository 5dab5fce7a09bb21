//! A refractive region before it learns: its shape, and the grid that an index gives it.

use super::shapes::{Ellipsoid, Side};
use crate::blur::gaussian_blur;
use crate::events::Event;
use crate::model::axis::Axis;
use crate::model::polyhedron::{Plane, Polyhedron};
use crate::model::{Gate, RegionState};
use crate::silhouettes::Site;
use refraxel_core::{Domain, LevelSet, Ray, Vec3};
use std::sync::OnceLock;

/// Standard deviation of the blur of a shape whose index learns [voxel of the index grid].
pub(super) const SMOOTH: f32 = 0.7;

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
    /// Which straight rays meet it; absent for all that meet its box.
    pub shadow: Option<Gate>,
    /// The planes of its surface, where they are all of it.
    pub solid: Option<Polyhedron>,
    /// The convex polyhedron that its silhouettes show, if they may show one.
    pub faceted: Option<Polyhedron>,
    /// The ellipsoid that its silhouettes show, if they do: its surface then.
    pub round: Option<Ellipsoid>,
    /// The axis of a body of revolution.
    pub axis: Option<Axis>,
    /// The same as a body of revolution, where it may be one: what is seen through it tells.
    pub revolved: Option<Box<Region>>,
    /// Unit vector away from what it stands on, or upwards in the pictures.
    pub up: Option<Vec3<f32>>,
    /// How far it reaches into what it stands on [scene unit]; 0 where nothing is known of that.
    pub sunk: f32,
    /// Water below an open surface, where it may be that.
    pub water: Option<Water>,
    /// Other regions reach into its box: its surface must be sharp.
    pub is_shared: bool,
    /// Its side, if it is an open vessel: made when it is asked for.
    pub side: OnceLock<Option<Side>>,
    /// What an offset of the surface counts in [scene unit]: a voxel of the finest grid.
    pub unit: f32,
}

/// Nodes of a [sketch](Region::sketch), about.
const SKETCH_NODES: f64 = 1.2e5;
/// A sketch has voxels at most this much larger: thin things must not vanish.
const SKETCH_COARSER: f64 = 2.0;

/// Water that is seen through its surface only, from above.
#[derive(Clone)]
pub(super) struct Water {
    /// The water if its surface were at the highest level that the masks allow.
    pub highest: LevelSet<f32>,
    /// Unit vector away from the water.
    pub up: Vec3<f32>,
    /// Lowest and highest level along `up` [scene unit].
    pub range: [f32; 2],
    /// The level at which masks coincide best [that range].
    pub level: f32,
}

impl Region {
    /// Nothing is known of it yet.
    fn blank(site: Site) -> Self {
        Self {
            site,
            surface: None,
            known: None,
            occupancy: Vec::new(),
            distance: Vec::new(),
            trainable: Vec::new(),
            gate: None,
            shadow: None,
            solid: None,
            faceted: None,
            round: None,
            axis: None,
            revolved: None,
            up: None,
            sunk: 0.0,
            water: None,
            is_shared: false,
            side: OnceLock::new(),
            unit: site.domain().voxel(),
        }
    }

    /// Nothing refractive yet.
    pub(super) fn uniform(site: Site) -> Self {
        let nodes = site.domain().resolution.map(|n| n as usize).iter().product();
        Self { known: Some(vec![1.0; nodes]), occupancy: vec![0.0; nodes], ..Self::blank(site) }
    }

    /// A body by its signed distance.
    pub(super) fn body(site: Site, distance: impl Fn(Vec3<f32>) -> f32) -> Self {
        let surface = LevelSet::from_samples(site.bounds, site.resolution, distance);
        Self::new(site, surface)
    }

    pub(super) fn new(site: Site, surface: LevelSet<f32>) -> Self {
        let nodes = surface.coefficients().len();
        let distance: Vec<f32> = (0..nodes).map(|j| surface.value(surface.position(j))).collect();
        let voxel = site.domain().voxel();
        let mut occupancy: Vec<f32> = distance.iter().map(|d| (0.5 - d / voxel).clamp(0.0, 1.0)).collect();
        let shadow = Gate::new(site.domain(), &occupancy);
        gaussian_blur(&mut occupancy, site.resolution, SMOOTH);
        let trainable = distance.iter().map(|&d| d < 2.0 * voxel).collect();
        // Only rays bend that would meet the shape on a straight line.
        let (surface, gate, shadow) = (Some(surface), Some(shadow.clone()), Some(shadow));
        Self { surface, occupancy, distance, trainable, gate, shadow, ..Self::blank(site) }
    }

    /// The same region on a coarser grid, where a search tries many shapes in the time that one takes here. Rays through a
    /// smooth surface hardly feel the grid.
    pub(super) fn sketch(&self) -> Option<Self> {
        let (surface, nodes) = (self.surface.as_ref()?, self.distance.len() as f64);
        let coarser = (nodes / SKETCH_NODES).cbrt().min(SKETCH_COARSER);
        if self.is_known() || coarser <= 1.0 {
            return None;
        }
        let site = Site { resolution: fewer(self.site.resolution, coarser), ..self.site };
        let surface = LevelSet::from_samples(site.bounds, site.resolution, |x| surface.value(x));
        let water = self.water.as_ref().map(|w| {
            let Domain { bounds, resolution, .. } = *w.highest.domain();
            let value = |x| w.highest.value(x);
            Water { highest: LevelSet::from_samples(bounds, fewer(resolution, coarser), value), ..w.clone() }
        });
        Some(Self {
            axis: self.axis,
            up: self.up,
            sunk: self.sunk,
            water,
            is_shared: self.is_shared,
            solid: self.solid.clone(),
            faceted: self.faceted.clone(),
            unit: self.unit,
            ..Self::new(site, surface)
        })
    }

    /// It goes on below a plane.
    pub(super) fn reaches_below(&self, ground: &Plane) -> bool {
        let below = |s: &LevelSet<f32>| {
            let depth = |j: usize| ground.height(s.position(j)) < -0.5 * s.voxel();
            s.parameters().any(|j| depth(j) && self.distance[j] < 0.0)
        };
        self.surface.as_ref().is_some_and(below)
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

    /// What is reported of region number `k`.
    pub(super) fn found(&self, k: usize) -> Event {
        let bounds = &self.site.bounds;
        Event::RegionFound {
            region: k,
            center: bounds.center().to_array(),
            extent: bounds.extent().to_array(),
            nodes: self.site.resolution,
            faces: self.solid.as_ref().or(self.faceted.as_ref()).map(|s| s.faces.len()),
            ellipsoid: self.round.as_ref().map(|e| e.misfit as f32),
            revolution: self.axis.is_some(),
        }
    }

    /// Depth of its deepest point [scene unit].
    pub(super) fn depth(&self) -> f32 {
        -self.distance.iter().copied().fold(0.0, f32::min)
    }

    /// Its side, if it is a vessel that is open at the top: of flat walls where silhouettes may show them.
    pub(super) fn vessel_side(&self) -> Option<&Side> {
        let planes = |solid: &Polyhedron| solid.level_set(self.site.bounds, self.site.resolution);
        // Planes of a hull that is a polyhedron have cut off the roof that silhouettes leave it.
        let solid = self.solid.as_ref().or(self.faceted.as_ref());
        let outer = || solid.map(planes).or_else(|| self.surface.clone());
        let of = || Some(Side::new(outer()?, self.up?)?.of_planes(solid));
        self.side.get_or_init(of).as_ref()
    }

    /// What goes with a field that varies smoothly. Rays that miss a sharp surface do not bend; of a smooth one they must be
    /// kept away by the gate.
    pub(super) fn smooth_state(&self) -> RegionState {
        let (trainable, gate) = (self.trainable.clone(), self.gate.clone());
        RegionState { trainable, gate, ..RegionState::default() }
    }

    /// Whether the straight ray meets the region.
    pub(super) fn meets(&self, ray: &Ray<f32>) -> bool {
        match &self.shadow {
            Some(shadow) => shadow.admits(ray),
            None => self.site.bounds.clip(ray).is_some(),
        }
    }
}

/// Nodes per axis of a grid over the same box whose voxels are larger by a factor.
fn fewer(resolution: [u32; 3], by: f64) -> [u32; 3] {
    resolution.map(|n| (f64::from(n - 1) / by).round().max(8.0) as u32 + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::polyhedron::Plane;
    use crate::options::Options;
    use refraxel_core::{Aabb, vec3};

    #[test]
    fn the_side_of_a_vessel_has_no_roof_that_planes_have_cut_off() {
        let face = |x: f32, y: f32, z: f32, offset| Plane::facing(vec3(x, y, z), offset);
        let walls = [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)];
        let side = || walls.map(|(x, y)| face(2.0 * x, 2.0 * y, 0.0, 0.5));
        let base = Some(face(0.0, 0.0, -1.0, 0.4));
        let flat = Polyhedron { faces: side().into_iter().chain([face(0.0, 0.0, 1.0, 0.2)]).collect(), base };
        let slope = |(x, y): (f32, f32)| Plane::facing(vec3(0.4 * x, 0.4 * y, 1.0).normalized(), 0.29);
        let roofed = Polyhedron { faces: side().into_iter().chain(walls.map(slope)).collect(), base };
        let bounds = Aabb::new(Vec3::splat(-0.8), Vec3::splat(0.8));
        let options = Options::default();
        let site = Site { bounds, resolution: [33; 3], interpolation: options.index.interpolation.into() };
        let body = || Region::body(site, |x| flat.height(x));
        let rim = |solid: Option<&Polyhedron>| {
            let (solid, faceted, up) = (solid.cloned(), Some(roofed.clone()), Some(vec3(0.0, 0.0, 1.0)));
            Region { solid, faceted, up, ..body() }.vessel_side().unwrap().span[1]
        };
        assert!((rim(Some(&flat)) - 0.2).abs() < 0.5 * 0.05, "{}", rim(Some(&flat)));
        assert!(rim(None) > 0.24, "{}", rim(None));
    }
}

//! A refractive region before it learns: where it lies, and the shapes that views, a box or a file allow there.

use super::shapes::Side;
use super::surface::{Form, Surface};
use crate::events::Event;
use crate::model::RegionState;
use crate::model::polyhedron::Polyhedron;
use crate::silhouettes::Site;
use refraxel_core::{Domain, LevelSet, Ray, Vec3};
use refraxel_data::LocalOrigin;

/// A place where rays may bend.
pub(super) struct Region {
    pub site: Site,
    /// What may stand there. Each hypothesis takes from the list what it needs.
    pub shapes: Vec<Shape>,
    /// What goes with an index there that varies smoothly.
    pub state: RegionState,
    /// Other regions reach into its box: its surface must be sharp.
    pub is_shared: bool,
    /// What an offset of the surface counts in [scene unit]: a voxel of the finest grid.
    pub unit: f32,
}

/// A shape that may stand in a region.
pub(super) enum Shape {
    /// The surface of the body there.
    Surface(Surface),
    /// A surface that may take the place of that one: what is seen through it tells.
    Rival(Surface),
    /// The convex polyhedron that silhouettes may show.
    Polyhedron(Polyhedron),
    /// Water below an open surface.
    Water(Water),
    /// n at the nodes, from a file.
    Known(Vec<f32>),
}

/// Water that is seen through its surface only, from above.
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

/// Nodes of a [sketch](Region::sketch), about.
const SKETCH_NODES: f64 = 1.2e5;
/// A sketch has voxels at most this much larger: thin things must not vanish.
const SKETCH_COARSER: f64 = 2.0;

impl Region {
    pub(super) fn new(site: Site, shapes: Vec<Shape>) -> Self {
        let (state, unit) = (RegionState::default(), site.domain().voxel());
        let mut region = Self { site, shapes, state, is_shared: false, unit };
        region.state = region.surface().map_or_else(RegionState::default, Surface::smooth_state);
        region
    }

    /// Nothing refractive yet.
    pub(super) fn uniform(site: Site) -> Self {
        let nodes = site.domain().resolution.map(|n| n as usize).iter().product();
        Self::new(site, vec![Shape::Known(vec![1.0; nodes])])
    }

    /// A body by its signed distance.
    pub(super) fn body(site: Site, distance: impl Fn(Vec3<f32>) -> f32) -> Self {
        let level = LevelSet::from_samples(site.bounds, site.resolution, distance);
        Self::new(site, vec![Shape::Surface(Surface::new(Form::Free, level))])
    }

    /// The same place with this surface alone.
    pub(super) fn with(&self, surface: Surface) -> Self {
        let Self { is_shared, unit, .. } = *self;
        Self { is_shared, unit, ..Self::new(self.site, vec![Shape::Surface(surface)]) }
    }

    /// The same region on a coarser grid, where a search tries many shapes in the time that one takes here. Rays through a
    /// smooth surface hardly feel the grid.
    pub(super) fn sketch(&self) -> Option<Self> {
        let nodes = self.surface()?.distance.len() as f64;
        let coarser = (nodes / SKETCH_NODES).cbrt().min(SKETCH_COARSER);
        if self.is_known() || coarser <= 1.0 {
            return None;
        }
        let site = Site { resolution: fewer(self.site.resolution, coarser), ..self.site };
        let shapes = self.shapes.iter().map(|s| s.coarser(coarser)).collect();
        let Self { is_shared, unit, .. } = *self;
        Some(Self { is_shared, unit, ..Self::new(site, shapes) })
    }

    /// The surface of the body there; none where a file says n at the nodes alone.
    pub(super) fn surface(&self) -> Option<&Surface> {
        self.shapes.iter().find_map(|s| if let Shape::Surface(surface) = s { Some(surface) } else { None })
    }

    /// The convex polyhedron that silhouettes may show.
    pub(super) fn polyhedron(&self) -> Option<&Polyhedron> {
        self.shapes.iter().find_map(|s| if let Shape::Polyhedron(body) = s { Some(body) } else { None })
    }

    /// Water below an open surface.
    pub(super) fn water(&self) -> Option<&Water> {
        self.shapes.iter().find_map(|s| if let Shape::Water(water) = s { Some(water) } else { None })
    }

    /// n at the nodes, where a file says it.
    pub(super) fn known(&self) -> Option<&[f32]> {
        self.shapes.iter().find_map(|s| if let Shape::Known(n) = s { Some(&n[..]) } else { None })
    }

    /// Takes the surfaces out of the list that may take the place of the one there.
    pub(super) fn take_rivals(&mut self) -> Vec<Surface> {
        let (mut rivals, mut others) = (Vec::new(), Vec::new());
        for shape in std::mem::take(&mut self.shapes) {
            match shape {
                Shape::Rival(surface) => rivals.push(surface),
                other => others.push(other),
            }
        }
        self.shapes = others;
        rivals
    }

    /// Its index is known from a file.
    pub(super) fn is_known(&self) -> bool {
        self.known().is_some()
    }

    /// A file says n of the inside of a body, and that it is one number but at the surface.
    pub(super) fn has_one_index(&self) -> bool {
        let (Some(surface), Some(known)) = (self.surface(), self.known()) else { return false };
        let deep = -2.0 * surface.level.voxel();
        let inside = surface.distance.iter().zip(known).filter(|(d, _)| **d < deep).map(|(_, n)| *n);
        let (least, most) = inside.fold((f32::MAX, 1.0_f32), |(a, b), n| (a.min(n), b.max(n)));
        most - least < 1e-3
    }

    /// Inside, or within a voxel of it.
    pub(super) fn is_inside(&self, x: Vec3<f32>) -> bool {
        self.surface().is_some_and(|s| s.is_inside(x))
    }

    /// What is reported of region number `k`; its coordinates have this origin.
    pub(super) fn found(&self, k: usize, origin: LocalOrigin) -> Event {
        let (bounds, surface) = (&self.site.bounds, self.surface());
        let form = surface.map_or(&Form::Free, |s| &s.form);
        Event::RegionFound {
            region: k,
            center: origin.to_world(bounds.cast().center()).to_array(),
            extent: bounds.extent().to_array(),
            nodes: self.site.resolution,
            faces: self.planes().map(|s| s.faces.len()),
            ellipsoid: if let Form::Ellipsoid(e) = form { Some(e.misfit as f32) } else { None },
            revolution: matches!(form, Form::Revolution(_)),
        }
    }

    /// Depth of its deepest point [scene unit].
    pub(super) fn depth(&self) -> f32 {
        self.surface().map_or(0.0, Surface::depth)
    }

    /// The planes of its surface, or else those that silhouettes may show.
    fn planes(&self) -> Option<&Polyhedron> {
        self.surface().and_then(Surface::planes).or(self.polyhedron())
    }

    /// Its side, if it is a vessel that is open at the top: of flat walls where silhouettes may show them. Planes of a hull that
    /// is a polyhedron have cut off the roof that silhouettes leave it.
    pub(super) fn vessel_side(&self) -> Option<&Side> {
        self.surface()?.side(self.planes())
    }

    /// How far the body reaches into what it stands on [scene unit]; 0 where nothing is known of that.
    pub(super) fn sunk(&self) -> f32 {
        self.surface().and_then(|s| s.stand.as_ref()).map_or(0.0, |s| s.sunk)
    }

    /// Whether the straight ray meets the region.
    pub(super) fn meets(&self, ray: &Ray<f32>) -> bool {
        match self.surface() {
            Some(surface) => surface.shadow.admits(ray),
            None => self.site.bounds.clip(ray).is_some(),
        }
    }
}

impl Shape {
    /// The same shape on a grid whose voxels are larger by a factor.
    fn coarser(&self, by: f64) -> Self {
        let of = |s: &Surface| s.coarser(fewer(s.level.domain().resolution, by));
        match self {
            Self::Surface(surface) => Self::Surface(of(surface)),
            Self::Rival(surface) => Self::Rival(of(surface)),
            Self::Polyhedron(body) => Self::Polyhedron(body.clone()),
            Self::Water(water) => Self::Water(water.coarser(by)),
            Self::Known(n) => Self::Known(n.clone()),
        }
    }
}

impl Water {
    fn coarser(&self, by: f64) -> Self {
        let Domain { bounds, resolution, .. } = *self.highest.domain();
        let value = |x| self.highest.value(x);
        Self { highest: LevelSet::from_samples(bounds, fewer(resolution, by), value), ..*self }
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
    use crate::refraction_search::surface::Stand;
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
        let bounds = Aabb::cube(0.8);
        let options = Options::default();
        let site = Site { bounds, resolution: [33; 3], interpolation: options.index.interpolation.into() };
        let level = LevelSet::from_samples(bounds, site.resolution, |x| flat.height(x));
        let rim = |solid: Option<&Polyhedron>| {
            let form = solid.map_or(Form::Free, |s| Form::Polyhedron(s.clone()));
            let stand = Some(Stand::new(vec3(0.0, 0.0, 1.0), 0.0));
            let surface = Surface { stand, ..Surface::new(form, level.clone()) };
            let shapes = vec![Shape::Surface(surface), Shape::Polyhedron(roofed.clone())];
            Region::new(site, shapes).vessel_side().unwrap().span[1]
        };
        assert!((rim(Some(&flat)) - 0.2).abs() < 0.5 * 0.05, "{}", rim(Some(&flat)));
        assert!(rim(None) > 0.24, "{}", rim(None));
    }
}

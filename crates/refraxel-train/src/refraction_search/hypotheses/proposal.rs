//! A hypothesis as data, and a candidate: one with numbers.

use crate::evidence::Unknown;
use crate::model::{Refraction, RegionState};
use crate::options::Options;
use crate::refraction_search::region::Region;
use crate::verdict::{Found, Hypothesis};
use refraxel_core::{IndexGrid, LevelSet, Medium};

/// A body with what belongs to it.
#[derive(Clone)]
pub(in crate::refraction_search) struct Body {
    pub grid: IndexGrid<f32>,
    pub state: RegionState,
    /// It has a sharp surface, and its index is the one that is sought.
    pub is_searched: bool,
}

impl Body {
    /// A body within a sharp surface, of the index that is sought.
    pub(in crate::refraction_search) fn searched(surface: LevelSet<f32>, index: f32) -> Self {
        Self { grid: IndexGrid::sharp(surface, index), state: RegionState::default(), is_searched: true }
    }

    /// A body within a sharp surface, of an index that is known.
    pub(super) fn given(surface: LevelSet<f32>, index: f32, state: RegionState) -> Self {
        Self { grid: IndexGrid::sharp(surface, index), state, is_searched: false }
    }

    /// A field that varies smoothly.
    pub(super) fn field(grid: IndexGrid<f32>, region: &Region) -> Self {
        Self { grid, state: region.state.clone(), is_searched: false }
    }
}

/// A hypothesis on what stands in a region.
pub(in crate::refraction_search) struct Proposal {
    pub kind: Hypothesis,
    /// Whether the region has the shape that it needs.
    pub fits: fn(&Region) -> bool,
    /// It has many unknowns, or its rays are slow: it is looked at last, and its search continues only where its first numbers score
    /// nearly as much as the hypothesis that stands.
    pub is_dear: bool,
    /// Its bodies have sharp surfaces, which the index does not move.
    pub is_sharp: bool,
    /// What it does not know, the index first.
    pub unknowns: fn(&Region) -> Vec<Unknown>,
    /// The bodies, when the unknowns have these values.
    pub bodies: fn(&Region, &[f32], &Options) -> Vec<Body>,
    /// The same bodies on the grids where they learn.
    pub learning: fn(&Region, &[f32], &Options) -> Vec<Body>,
}

impl PartialEq for Proposal {
    fn eq(&self, other: &Self) -> bool {
        self.kind == other.kind
    }
}

/// A hypothesis with numbers.
#[derive(Clone)]
pub(in crate::refraction_search) struct Candidate {
    pub proposal: &'static Proposal,
    /// One per unknown.
    pub values: Vec<f32>,
    /// A scan found them; else they are guessed or known.
    pub searched: bool,
    /// A surface of its first body that takes the place of that of the region.
    pub refined: Option<Box<LevelSet<f32>>>,
}

impl Candidate {
    /// The middle of what may be, with this index.
    pub(in crate::refraction_search) fn guess(
        proposal: &'static Proposal,
        region: &Region,
        index: f32,
    ) -> Self {
        let middle = |u: &Unknown| if u.name == INDEX { index } else { u.first[u.first.len() / 2] };
        let values = (proposal.unknowns)(region).iter().map(middle).collect();
        Self { proposal, values, searched: false, refined: None }
    }

    /// All that lies within is seen through it alone, so that the field must learn it anew.
    pub(in crate::refraction_search) fn relearns(&self) -> bool {
        self.proposal.kind == Hypothesis::WaterSurface
    }

    /// The bodies to search with.
    pub(in crate::refraction_search) fn bodies(&self, region: &Region, options: &Options) -> Vec<Body> {
        self.with_state((self.proposal.bodies)(region, &self.values, options))
    }

    /// The bodies that learn.
    pub(in crate::refraction_search) fn learning(&self, region: &Region, options: &Options) -> Vec<Body> {
        self.with_state((self.proposal.learning)(region, &self.values, options))
    }

    /// The bodies to search with, where the surfaces of a candidate are known that differs in the index only.
    pub(in crate::refraction_search) fn bodies_of_shape(&self, shape: &[Body]) -> Vec<Body> {
        let mut bodies = shape.to_vec();
        bodies.iter_mut().filter(|b| b.is_searched).for_each(|b| b.grid.set_interior_index(self.values[0]));
        self.with_state(bodies)
    }

    /// The index of a body stays near to what a scan found.
    fn with_state(&self, mut bodies: Vec<Body>) -> Vec<Body> {
        if let (Some(surface), Some(body)) = (&self.refined, bodies.iter_mut().find(|b| b.is_searched)) {
            body.grid = IndexGrid::sharp((**surface).clone(), self.values[0]);
        }
        for body in bodies.iter_mut().filter(|b| b.is_searched) {
            body.state.searched = self.values.first().copied().filter(|_| self.searched);
        }
        bodies
    }

    /// Which of its numbers is the index that tells most: that of what fills a vessel, whose wall is thin.
    pub(in crate::refraction_search) fn telling(&self, region: &Region) -> usize {
        let unknowns = (self.proposal.unknowns)(region);
        let which = |name: &str| unknowns.iter().position(|u| u.name == name);
        let is_filled = which(WATER).is_some_and(|k| self.values[k] > 0.0);
        which(FILLING).filter(|_| is_filled).unwrap_or(0)
    }

    /// Its numbers with their names.
    pub(in crate::refraction_search) fn found(&self, region: &Region) -> Vec<Found> {
        let unknowns = (self.proposal.unknowns)(region);
        let numbers = unknowns.iter().map(|u| u.name).zip(self.values.iter().copied());
        numbers.map(|(name, value)| Found { name: name.to_owned(), value }).collect()
    }
}

pub(super) const INDEX: &str = "index";
/// How far a surface lies outside the hull [voxel].
pub(in crate::refraction_search) const OFFSET: &str = "offset";
/// Thickness of a wall [depth of the body].
pub(in crate::refraction_search) const WALL: &str = "wall";
/// Height of what fills a vessel above its base [height of the vessel], and its index.
pub(super) const WATER: &str = "water";
pub(super) const FILLING: &str = "filling";

/// The index of a whole body, over the range of all matter that is clear.
pub(super) fn index_of_a_body() -> Unknown {
    let first = std::array::from_fn::<f32, 21, _>(|k| 1.0 + 0.075 * k as f32);
    Unknown::new(INDEX, &first, &[0.03, 0.01, 0.005], [1.0, 4.0])
}

/// What bends rays where these bodies are.
pub(in crate::refraction_search) fn refraction(bodies: Vec<Body>, options: &Options) -> Refraction {
    let (grids, states) = bodies.into_iter().map(|b| (b.grid, b.state)).unzip();
    let medium = Medium::new(grids).unwrap_or_else(|e| unreachable!("regions were made apart: {e}"));
    Refraction { medium, optics: options.optics(), states }
}

//! What may stand in a region: hypotheses as data. Each is a file with a function from the region that views show, and from
//! a few unknown numbers, to the bodies that bend rays there.

mod graded;
mod known;
mod polyhedron;
mod shell;
mod smooth;
mod solid;
mod vessel;
mod water_surface;

pub(super) use known::{HELD, HELD_SMOOTH};
pub(super) use solid::SOLID;

use super::region::Region;
pub(super) use crate::evidence::Unknown;
use crate::model::RegionState;
use crate::options::{Options, SurfaceProfile};
use crate::verdict::{Found, Hypothesis};
use refraxel_core::{IndexGrid, LevelSet};

/// A body with what belongs to it.
#[derive(Clone)]
pub(super) struct Body {
    pub grid: IndexGrid<f32>,
    pub state: RegionState,
    /// It has a sharp surface, and its index is the one that is sought.
    pub is_sought: bool,
}

impl Body {
    /// A body within a sharp surface, of the index that is sought.
    pub(super) fn sought(surface: LevelSet<f32>, index: f32) -> Self {
        Self { grid: IndexGrid::sharp(surface, index), state: RegionState::default(), is_sought: true }
    }

    /// A body within a sharp surface, of an index that is known.
    fn given(surface: LevelSet<f32>, index: f32, state: RegionState) -> Self {
        Self { grid: IndexGrid::sharp(surface, index), state, is_sought: false }
    }

    /// A field that varies smoothly.
    fn field(grid: IndexGrid<f32>, region: &Region) -> Self {
        Self { grid, state: region.smooth_state(), is_sought: false }
    }
}

/// A hypothesis on what stands in a region.
pub(super) struct Proposal {
    pub kind: Hypothesis,
    /// Its search takes long: it is left out where another hypothesis explains what is seen.
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
pub(super) struct Candidate {
    pub proposal: &'static Proposal,
    /// One per unknown.
    pub values: Vec<f32>,
    /// A search found them; else they are guessed or known.
    pub searched: bool,
    /// What its glass absorbs of red, green and blue [1 / scene unit].
    pub tint: [f32; 3],
    /// A surface of its first body that takes the place of that of the region.
    pub refined: Option<Box<LevelSet<f32>>>,
}

impl Candidate {
    /// The guess before any search.
    pub(super) fn guess(proposal: &'static Proposal, region: &Region, options: &Options) -> Self {
        let first =
            |u: &Unknown| if u.name == INDEX { options.search.guess } else { u.first[u.first.len() / 2] };
        let values = (proposal.unknowns)(region).iter().map(first).collect();
        Self { proposal, values, searched: false, tint: [0.0; 3], refined: None }
    }

    /// All that lies within is seen through it alone, so that the field must learn it anew.
    pub(super) fn relearns(&self) -> bool {
        self.proposal.kind == Hypothesis::WaterSurface
    }

    /// The bodies to search with.
    pub(super) fn bodies(&self, region: &Region, options: &Options) -> Vec<Body> {
        self.with_state((self.proposal.bodies)(region, &self.values, options))
    }

    /// The bodies that learn.
    pub(super) fn learning(&self, region: &Region, options: &Options) -> Vec<Body> {
        self.with_state((self.proposal.learning)(region, &self.values, options))
    }

    /// The bodies to search with, where the surfaces of a candidate are known that differs in the index only.
    pub(super) fn bodies_of_shape(&self, shape: &[Body]) -> Vec<Body> {
        let mut bodies = shape.to_vec();
        bodies.iter_mut().filter(|b| b.is_sought).for_each(|b| b.grid.set_interior_index(self.values[0]));
        self.with_state(bodies)
    }

    /// The index of a body stays near to what a search found, and it has its colour, unless it is air.
    fn with_state(&self, mut bodies: Vec<Body>) -> Vec<Body> {
        if let (Some(surface), Some(body)) = (&self.refined, bodies.iter_mut().find(|b| b.is_sought)) {
            body.grid = IndexGrid::sharp((**surface).clone(), self.values[0]);
        }
        let is_air = |b: &Body| b.grid.interior_index() == Some(1.0);
        bodies.iter_mut().filter(|b| !is_air(b)).for_each(|b| b.grid.set_absorption(self.tint));
        for body in bodies.iter_mut().filter(|b| b.is_sought) {
            body.state.searched = self.values.first().copied().filter(|_| self.searched);
        }
        bodies
    }

    /// Which of its numbers is the index that tells most: that of what fills a vessel, whose wall is thin.
    pub(super) fn telling(&self, region: &Region) -> usize {
        let unknowns = (self.proposal.unknowns)(region);
        let which = |name: &str| unknowns.iter().position(|u| u.name == name);
        let is_filled = which(WATER).is_some_and(|k| self.values[k] > 0.0);
        which(FILLING).filter(|_| is_filled).unwrap_or(0)
    }

    /// Its numbers with their names.
    pub(super) fn found(&self, region: &Region) -> Vec<Found> {
        let unknowns = (self.proposal.unknowns)(region);
        let numbers = unknowns.iter().map(|u| u.name).zip(self.values.iter().copied());
        let tint = COLOURS.into_iter().zip(self.tint).filter(|_| self.tint != [0.0; 3]);
        numbers.chain(tint).map(|(name, value)| Found { name: name.to_owned(), value }).collect()
    }
}

const INDEX: &str = "index";
/// How far a surface lies outside the hull [voxel].
pub(super) const OFFSET: &str = "offset";
/// Thickness of a wall [depth of the body].
pub(super) const WALL: &str = "wall";
/// Height of what fills a vessel above its base [height of the vessel], and its index.
const WATER: &str = "water";
const FILLING: &str = "filling";
/// What glass absorbs of each [1 / scene unit].
const COLOURS: [&str; 3] = ["red", "green", "blue"];

/// The index of a whole body, over the range of all matter that is clear.
fn index_of_a_body() -> Unknown {
    let first = (0..21).map(|k| 1.0 + 0.075 * k as f32).collect();
    Unknown { name: INDEX, first, fine: vec![0.03, 0.01, 0.005], range: [1.0, 4.0] }
}

/// The hypotheses that may hold in a region, the simplest first.
pub(super) fn proposals(region: &Region, options: &Options) -> Vec<&'static Proposal> {
    if region.is_body_of_truth() {
        return vec![&HELD];
    }
    if region.is_known() {
        let is_field = region.surface.is_none() || !region.has_one_index();
        let is_smooth = is_field || options.search.profile == SurfaceProfile::Smooth;
        return vec![if is_smooth { &HELD_SMOOTH } else { &HELD }];
    }
    let sharp = |all: &mut Vec<&'static Proposal>| {
        all.push(&SOLID);
        if region.faceted.is_some() {
            all.push(&polyhedron::POLYHEDRON);
        }
        all.push(&shell::SHELL);
        if options.search.rare.is_on() && region.up.is_some() {
            all.push(&vessel::VESSEL);
        }
        if region.water.is_some() {
            all.push(&water_surface::WATER_SURFACE);
        }
    };
    let mut all = Vec::new();
    match options.search.profile {
        // A field that varies smoothly may not overlap other bodies.
        _ if region.is_shared => sharp(&mut all),
        SurfaceProfile::Sharp => sharp(&mut all),
        SurfaceProfile::Smooth => all.push(&smooth::SMOOTH),
        SurfaceProfile::Graded => all.push(&graded::GRADED),
        SurfaceProfile::Auto => {
            sharp(&mut all);
            all.push(&graded::GRADED);
        }
    }
    all
}

//! What may stand in a region: hypotheses as data. Each is a file with a function from the region that views show, and from
//! a few unknown numbers, to the bodies that bend rays there.

mod graded;
mod known;
mod list;
mod polyhedron;
mod proposal;
mod shell;
mod smooth;
mod solid;
mod vessel;
mod water_surface;

pub(super) use list::{proposals, simplest};
pub(super) use proposal::{Body, Candidate, OFFSET, Proposal, refraction};
pub(super) use solid::SOLID;

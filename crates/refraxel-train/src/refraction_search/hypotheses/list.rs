//! Which hypotheses may hold in a region.

use super::graded::GRADED;
use super::known::{HELD, HELD_SMOOTH};
use super::polyhedron::POLYHEDRON;
use super::proposal::{Candidate, Proposal};
use super::shell::SHELL;
use super::smooth::SMOOTH;
use super::solid::SOLID;
use super::vessel::VESSEL;
use super::water_surface::WATER_SURFACE;
use crate::options::{Options, SurfaceProfile};
use crate::refraction_search::region::Region;

/// The hypotheses that may hold in a region, the simplest first.
pub(in crate::refraction_search) fn proposals(region: &Region, options: &Options) -> Vec<&'static Proposal> {
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
            all.push(&POLYHEDRON);
        }
        all.push(&SHELL);
        if region.up.is_some() {
            all.push(&VESSEL);
        }
        if region.water.is_some() {
            all.push(&WATER_SURFACE);
        }
    };
    let mut all = Vec::new();
    match options.search.profile {
        // A field that varies smoothly may not overlap other bodies.
        _ if region.is_shared => sharp(&mut all),
        SurfaceProfile::Sharp => sharp(&mut all),
        SurfaceProfile::Smooth => all.push(&SMOOTH),
        SurfaceProfile::Graded => all.push(&GRADED),
        SurfaceProfile::Auto => {
            sharp(&mut all);
            all.push(&GRADED);
        }
    }
    all
}

/// The simplest hypothesis on a region, with the index that is assumed where nothing is searched.
pub(in crate::refraction_search) fn simplest(region: &Region, options: &Options) -> Candidate {
    Candidate::guess(proposals(region, options)[0], region, options.search.guess)
}

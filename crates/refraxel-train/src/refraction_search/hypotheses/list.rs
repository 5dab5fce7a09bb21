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

/// Bodies with sharp surfaces, the simplest first.
const SHARP: [&Proposal; 5] = [&SOLID, &POLYHEDRON, &SHELL, &VESSEL, &WATER_SURFACE];

/// The hypotheses that may hold in a region, the simplest first.
pub(in crate::refraction_search) fn proposals(region: &Region, options: &Options) -> Vec<&'static Proposal> {
    if region.is_known() {
        let is_smooth = !region.is_body_of_truth()
            && (!region.has_one_index() || options.search.profile == SurfaceProfile::Smooth);
        return vec![if is_smooth { &HELD_SMOOTH } else { &HELD }];
    }
    let smooth: &[&Proposal] = match options.search.profile {
        // A field that varies smoothly may not overlap other bodies.
        _ if region.is_shared => &[],
        SurfaceProfile::Sharp => &[],
        SurfaceProfile::Smooth => return vec![&SMOOTH],
        SurfaceProfile::Graded => return vec![&GRADED],
        SurfaceProfile::Auto => &[&GRADED],
    };
    SHARP.iter().chain(smooth).copied().filter(|p| (p.fits)(region)).collect()
}

/// The simplest hypothesis on a region, with the index that is assumed where nothing is searched.
pub(in crate::refraction_search) fn simplest(region: &Region, options: &Options) -> Candidate {
    Candidate::guess(proposals(region, options)[0], region, options.search.guess)
}

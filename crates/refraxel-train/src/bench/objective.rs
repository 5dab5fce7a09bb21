//! How the scene learns, so slowly that it stays what it is.

use crate::backend::{IndexObjective, Marching, Objective};
use crate::options::Options;
use crate::schedule::index_objective;

pub(super) const MARCHING: Marching =
    Marching { step: 1.0, near: 0.0, min_optical_depth: 0.0, min_transmittance: 0.0 };

/// The index learns as by default, at rates so small that the scene stays what it is.
pub(super) fn index() -> IndexObjective {
    let usual = index_objective(&Options::default(), 0.0);
    IndexObjective { rate: 1e-7, surface_rate: 1e-6, surface_smooth: 1e-4, ..usual }
}

pub(super) fn objective() -> Objective {
    Objective { rate_density: 1e-6, rate_colour: 1e-6, rate_view: 1.0, ..Objective::still(MARCHING) }
}

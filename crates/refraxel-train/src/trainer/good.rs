//! A state that a run can go back to.

use crate::alignment::Alignment;
use crate::model::{Model, Optimiser};
use crate::run::{State, nearest_half};
use rayon::prelude::*;

/// What going back restores.
pub(super) struct Good {
    pub(super) state: State,
    pub(super) model: Model,
    pub(super) optimiser: Optimiser,
    pub(super) alignment: Alignment,
}

impl Good {
    /// Colour as half precision has it; what is too large for that is as large as can be.
    pub(super) fn round_colour(&mut self) {
        let round = |c: &mut f32| *c = nearest_half(*c).to_f32();
        self.model.field.colour.par_iter_mut().for_each(round);
    }
}

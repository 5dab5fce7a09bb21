//! A state that a run can go back to.

use crate::alignment::Alignment;
use crate::model::{Model, Optimiser};
use crate::run::{State, nearest_half};
use rayon::prelude::*;
use refraxel_core::{AlignedVec, VoxelField};

/// Values that a thread copies at a time.
const COPIED: usize = 1 << 16;

/// What going back restores.
pub(super) struct Good {
    pub(super) state: State,
    pub(super) model: Model,
    pub(super) optimiser: Optimiser,
    pub(super) alignment: Alignment,
}

impl Good {
    /// A copy of a model and the state of its optimiser, in the memory of this one as far as that is as large: fresh memory would be
    /// cleared first, page by page, and by one thread.
    pub(super) fn copied(self, model: &Model, optimiser: &Optimiser) -> (Model, Optimiser) {
        let Self { model: Model { field: old, .. }, optimiser: moments, .. } = self;
        let field = VoxelField {
            domain: model.field.domain,
            map: model.field.map.clone(),
            degree: model.field.degree,
            density: copied(old.density, &model.field.density),
            colour: copied(old.colour, &model.field.colour),
        };
        let model = Model {
            field,
            background: model.background.clone(),
            refraction: model.refraction.clone(),
            reflection: model.reflection.clone(),
            clearcoat: model.clearcoat.clone(),
        };
        let optimiser = Optimiser {
            density: copied(moments.density, &optimiser.density),
            colour: copied(moments.colour, &optimiser.colour),
            background: optimiser.background.clone(),
            index: optimiser.index.clone(),
            reflection: optimiser.reflection.clone(),
            clearcoat: optimiser.clearcoat.clone(),
            occupied: optimiser.occupied.clone(),
        };
        (model, optimiser)
    }

    /// Colour as half precision has it; what is too large for that is as large as can be.
    pub(super) fn round_colour(&mut self) {
        let round = |c: &mut f32| *c = nearest_half(*c).to_f32();
        self.model.field.colour.par_iter_mut().for_each(round);
    }
}

/// A copy of values in the memory of as many others.
fn copied(mut into: AlignedVec<f32>, values: &[f32]) -> AlignedVec<f32> {
    if into.len() != values.len() {
        drop(into); // at most one copy at a time
        return AlignedVec::from_slice(values);
    }
    let parts = into.par_chunks_mut(COPIED).zip(values.par_chunks(COPIED));
    parts.for_each(|(into, values)| into.copy_from_slice(values));
    into
}

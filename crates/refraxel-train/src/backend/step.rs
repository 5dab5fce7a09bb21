//! A step that is waited for.

use super::contract::Backend;
use super::objective::Objective;
use super::outcome::StepOutcome;
use crate::rays::Batch;

/// The one outcome of a step that is waited for.
///
/// # Panics
/// If the backend gives none or several: outcomes of earlier steps were not asked for.
pub fn step(backend: &mut dyn Backend, batch: &Batch, objective: &Objective, step: u64) -> StepOutcome {
    backend.submit(batch, objective, step);
    let outcomes = backend.outcomes(true);
    assert_eq!(outcomes.len(), 1, "one outcome per step");
    outcomes[0]
}

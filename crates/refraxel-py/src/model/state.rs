//! What a model holds: its parameters where they render, and what has changed since.

use super::parameters::{Given, Parameter};
use crate::errors::refused;
use pyo3::prelude::*;
use refraxel_train::backend::Marching;
use refraxel_train::{Backend, CpuBackend};

/// Rays between two looks at the wish to stop: a fraction of a second.
pub(super) const PORTION: usize = 16_384;

/// A backend and how its rays are marched.
pub(super) struct Inner {
    pub(super) backend: CpuBackend,
    pub(super) marching: Marching,
    /// How often each parameter has changed, in the order of all; the last number counts changes of the marching.
    pub(super) changes: Vec<u32>,
}

impl Inner {
    pub(super) fn model(&self) -> &refraxel_train::Model {
        // A CPU's snapshot borrows.
        self.backend.model()
    }

    /// Takes new values of a parameter. The same values change nothing.
    pub(super) fn take(&mut self, given: &Given) -> PyResult<()> {
        let parameter = Parameter::find(self.model(), &given.name)?;
        let new = parameter.checked(self.model(), given)?;
        if parameter.flat(self.model()) == new {
            return Ok(());
        }
        self.backend.edit(|model| parameter.set(model, &new));
        if parameter == Parameter::RawDensity {
            self.backend.refresh_occupancy(&self.marching);
        }
        let at = Parameter::all(self.model()).iter().position(|p| *p == parameter);
        self.count(at.unwrap_or(self.changes.len() - 1));
        Ok(())
    }

    pub(super) fn count(&mut self, at: usize) {
        self.changes[at] = self.changes[at].wrapping_add(1);
    }

    /// Refuses what has changed since a rendering and is not put back by what is given.
    pub(super) fn check_unchanged(&self, since: &[u32], given: &[Given]) -> PyResult<()> {
        let names = Parameter::all(self.model()).into_iter().map(|p| p.name()).chain(["marching".to_owned()]);
        for ((name, now), then) in names.zip(&self.changes).zip(since) {
            if now != then && !given.iter().any(|g| g.name == name) {
                return Err(refused(format!(
                    "{name} of the model has changed since these rays were rendered; take gradients before it changes, or pass it \
                     among the values"
                )));
            }
        }
        Ok(())
    }
}

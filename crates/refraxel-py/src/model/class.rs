//! The class Model: who looks at what it holds, and who changes that. What Python can do with it is in `methods`.

use super::parameters::{Given, Parameter};
use super::state::Inner;
use crate::errors::refused;
use crate::interruptible::interruptible;
use pyo3::prelude::*;
use refraxel_core::{Background, EnvironmentMap};
use refraxel_train::backend::Marching;
use refraxel_train::cancel::Cancel;
use refraxel_train::{Backend, CpuBackend};
use std::sync::{RwLock, RwLockReadGuard, RwLockWriteGuard};

/// A voxel radiance field with its background and what bends rays: a differentiable function of parameters and rays.
///
/// Parameters, all float32: "raw_density" (V,), of which density_scale * softplus is the density [1 / scene unit]; "sh" (V, 3, basis), colour
/// = 0.5 + SH, clamped at 0; "background" (H, 2 H, 3), a panorama, H = 1 for one colour; and for region k "index.k": () for a body of one
/// index, else (X, Y, Z), control values n of a spline, of which the three outermost layers are held at 1; "surface.k" (X, Y, Z), coefficients of
/// the level set [scene unit]; "absorption.k" (3,) [1 / scene unit]. What surfaces mirror is held fixed.
#[pyclass(frozen, module = "refraxel")]
pub struct Model(RwLock<Inner>);

impl Model {
    /// A model, with its background as a panorama: that of a constant colour has two texels.
    pub fn of(mut model: refraxel_train::Model, marching: Marching) -> Self {
        if let Background::Constant(colour) = model.background {
            model.background = Background::Environment(EnvironmentMap::uniform(1, colour));
        }
        let changes = vec![0; Parameter::all(&model).len() + 1];
        let mut backend = CpuBackend::new(model);
        backend.refresh_occupancy(&marching);
        Self(RwLock::new(Inner { backend, marching, changes }))
    }

    /// To look at. Nobody waits here who holds the interpreter's lock: whoever has the model may need that to go on.
    fn read(&self) -> PyResult<RwLockReadGuard<'_, Inner>> {
        self.0.read().map_err(|_| refused("the model is damaged: an earlier call failed"))
    }

    /// To change, likewise.
    pub(super) fn write(&self) -> PyResult<RwLockWriteGuard<'_, Inner>> {
        self.0.write().map_err(|_| refused("the model is damaged: an earlier call failed"))
    }

    /// What `f` sees, without the interpreter's lock.
    pub(super) fn look<T: Send>(
        &self,
        py: Python<'_>,
        f: impl FnOnce(&Inner) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| f(&*self.read()?))
    }

    /// What `f` computes, which takes long, once the model has taken values over. Nobody changes the model meanwhile.
    pub(super) fn compute<T: Send>(
        &self,
        py: Python<'_>,
        given: &[Given],
        f: impl FnOnce(&Inner, &Cancel) -> PyResult<T> + Send,
    ) -> PyResult<T> {
        interruptible(py, |cancel| {
            if given.is_empty() {
                return f(&*self.read()?, cancel);
            }
            let mut inner = self.write()?;
            given.iter().try_for_each(|value| inner.take(value))?;
            f(&RwLockWriteGuard::downgrade(inner), cancel)
        })
    }
}

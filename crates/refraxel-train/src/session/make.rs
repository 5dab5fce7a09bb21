//! How a session gets its backend.

use crate::backend::Backend;
use std::error::Error;

/// Why there is no backend for a model: what a device cannot do, or has no memory for.
pub type BackendError = Box<dyn Error + Send + Sync>;

/// A backend, or the reason why there is none: what functions return that make one for a
/// [`Session`](super::Session).
pub trait IntoBackend {
    /// The backend.
    fn into_backend(self) -> Result<Box<dyn Backend>, BackendError>;
}

impl<B: Backend> IntoBackend for B {
    fn into_backend(self) -> Result<Box<dyn Backend>, BackendError> {
        Ok(Box::new(self))
    }
}

impl IntoBackend for Box<dyn Backend> {
    fn into_backend(self) -> Result<Box<dyn Backend>, BackendError> {
        Ok(self)
    }
}

impl<B: IntoBackend, E: Into<BackendError>> IntoBackend for Result<B, E> {
    fn into_backend(self) -> Result<Box<dyn Backend>, BackendError> {
        self.map_err(E::into)?.into_backend()
    }
}

//! How a session gets its backend.

use crate::backend::Backend;
use std::error::Error;

/// Why there is no backend for a model: what a device cannot do, or has no memory for.
pub type BackendError = Box<dyn Error + Send + Sync>;

/// A backend, or the reason why there is none: what functions return that make one for a
/// [`Session`](super::Session).
pub trait IntoBackend<B> {
    /// The backend.
    fn into_backend(self) -> Result<B, BackendError>;
}

impl<B: Backend> IntoBackend<B> for B {
    fn into_backend(self) -> Result<B, BackendError> {
        Ok(self)
    }
}

impl<B: Backend, E: Into<BackendError>> IntoBackend<B> for Result<B, E> {
    fn into_backend(self) -> Result<B, BackendError> {
        self.map_err(E::into)
    }
}

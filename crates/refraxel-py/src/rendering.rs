//! What a camera sees.

use crate::arrays::shaped;
use pyo3::prelude::*;

/// What a camera sees: `colour` (height, width, 3) uint8 sRGB, `opacity` (height, width) from 0 to 1, `depth` (height, width), the mean
/// arc length to what is seen [scene unit], 0 where nothing is.
#[pyclass(frozen, module = "refraxel")]
pub struct Rendering {
    #[pyo3(get)]
    colour: Py<PyAny>,
    #[pyo3(get)]
    opacity: Py<PyAny>,
    #[pyo3(get)]
    depth: Py<PyAny>,
}

impl Rendering {
    /// Takes the pixels over.
    pub fn new(py: Python<'_>, seen: refraxel_train::evaluation::Rendering) -> PyResult<Self> {
        let shape = [seen.height as usize, seen.width as usize];
        Ok(Self {
            colour: shaped(py, seen.colour.into_flattened(), &[shape[0], shape[1], 3])?,
            opacity: shaped(py, seen.opacity, &shape)?,
            depth: shaped(py, seen.depth, &shape)?,
        })
    }
}

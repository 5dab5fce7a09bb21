//! Values of serde as Python objects: what numbers and words say needs no classes.

use crate::errors::refused;
use pyo3::prelude::*;
use serde::Serialize;

/// Dictionaries, lists, texts and numbers.
pub fn to_python<'py>(py: Python<'py>, value: &impl Serialize) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(value).map_err(|e| refused(e.to_string()))?;
    py.import("json")?.call_method1("loads", (text,))
}

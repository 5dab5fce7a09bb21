//! Parts of datasets, and scores.

use crate::errors::refused;
use crate::json;
use pyo3::prelude::*;
use refraxel_data::Part;
use refraxel_train::evaluation::Evaluation;
use serde_json::json;

/// A part of a dataset by its name.
pub fn part(name: &str) -> PyResult<Part> {
    let found = Part::ALL.into_iter().find(|p| p.name() == name);
    found.ok_or_else(|| {
        refused(format!("there is no part {name:?} of a dataset; expected train, val or test"))
    })
}

/// Scores as a dictionary.
pub fn scores<'py>(py: Python<'py>, found: &Evaluation) -> PyResult<Bound<'py, PyAny>> {
    let mut all = serde_json::to_value(&found.scores).map_err(|e| refused(e.to_string()))?;
    all["truth_crc32"] = json!(found.truth_crc32);
    if let Some(index) = &found.index {
        all["ior"] = json!(index);
    }
    json::to_python(py, &all)
}

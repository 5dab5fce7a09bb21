//! The runs of a plan, for engines that start them elsewhere.

use crate::errors::raised;
use crate::json;
use pyo3::prelude::*;
use refraxel::progress::Show;
use refraxel::verbs::sweep::{chosen, collect, plan};
use std::path::PathBuf;

/// The runs of a plan: a list of dictionaries.
#[pyfunction]
pub fn sweep_jobs(py: Python<'_>, plan: PathBuf, out: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    json::to_python(py, &plan::jobs(&plan, &out).map_err(raised)?)
}

/// Trains and scores one run of a plan, or goes on with what an earlier attempt has saved.
#[pyfunction]
pub fn sweep_run(py: Python<'_>, plan: PathBuf, out: PathBuf, number: usize) -> PyResult<()> {
    let jobs = plan::jobs(&plan, &out).map_err(raised)?;
    let job = chosen(&jobs, number).map_err(raised)?;
    py.detach(|| job.run(Show::Nothing)).map(|_| ()).map_err(raised)
}

/// Writes the table and the page of a sweep, and returns the rows.
#[pyfunction]
pub fn sweep_collect(py: Python<'_>, plan: PathBuf, out: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let jobs = plan::jobs(&plan, &out).map_err(raised)?;
    let rows = py.detach(|| collect(&jobs, &[], &out)).map_err(raised)?;
    json::to_python(py, &rows)
}

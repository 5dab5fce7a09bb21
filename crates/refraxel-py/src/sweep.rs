//! The runs of a plan, for engines that start them elsewhere.

use crate::errors::raised;
use crate::interruptible::with_events;
use crate::json;
use pyo3::prelude::*;
use refraxel::progress::Show;
use refraxel::verbs::interrupts::cancel;
use refraxel::verbs::sweep::{check_data, chosen, collect, plan};
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
    // The wish to stop is that of the program: of all runs of this process.
    let done = with_events(py, &cancel(), None, |_| job.run(Show::Nothing))?;
    done.map(|_| ()).map_err(raised)
}

/// Refuses a plan whose datasets cannot be opened, or hold no images out.
#[pyfunction]
pub fn sweep_check(py: Python<'_>, plan: PathBuf, out: PathBuf) -> PyResult<()> {
    let jobs = plan::jobs(&plan, &out).map_err(raised)?;
    py.detach(|| check_data(&jobs)).map_err(raised)
}

/// Writes the table and the page of a sweep, and returns the rows.
#[pyfunction]
pub fn sweep_collect(py: Python<'_>, plan: PathBuf, out: PathBuf) -> PyResult<Bound<'_, PyAny>> {
    let jobs = plan::jobs(&plan, &out).map_err(raised)?;
    let rows = py.detach(|| collect(&jobs, &[], &out)).map_err(raised)?;
    json::to_python(py, &rows)
}

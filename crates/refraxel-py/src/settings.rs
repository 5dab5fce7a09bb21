//! Options and threads.

use crate::errors::{input, refused};
use crate::json;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use refraxel_train::Options;
use refraxel_train::options::list;

/// All options of training: a list of dictionaries with name, meaning, default and range.
#[pyfunction]
pub fn options(py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
    json::to_python(py, &list())
}

/// Use so many threads; before anything has been computed.
#[pyfunction]
pub fn set_threads(threads: usize) -> PyResult<()> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    pool.map_err(|_| refused("threads have started already; call set_threads before anything else"))
}

/// Sets the options that a dictionary names: {"run.steps": 500, "refraction.bend": False}.
pub fn set_options(options: &mut Options, given: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
    for (name, value) in given.into_iter().flatten() {
        options.set(&name.extract::<String>()?, &text(&value)?).map_err(input)?;
    }
    Ok(())
}

/// How an option's value is written.
fn text(value: &Bound<'_, PyAny>) -> PyResult<String> {
    Ok(match value.extract::<bool>() {
        Ok(switch) if value.is_instance_of::<pyo3::types::PyBool>() => {
            if switch { "on" } else { "off" }.to_owned()
        }
        _ => value.str()?.to_string(),
    })
}

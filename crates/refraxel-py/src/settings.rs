//! Options and threads.

use crate::errors::{input, refused};
use crate::json;
use pyo3::prelude::*;
use pyo3::types::PyMapping;
use refraxel_train::Options;
use refraxel_train::options::list;

/// All options of training: a list of dictionaries with name, meaning, range, default; unbounded: the default for photographs of
/// surroundings, or None where it is the same; and forward: that for forward-facing captures, or None where it is that of surroundings.
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

/// Sets the options that a mapping names: {"run.steps": 500, "refraction.bend": False}.
pub fn set_options(options: &mut Options, given: Option<&Bound<'_, PyMapping>>) -> PyResult<()> {
    let Some(given) = given else { return Ok(()) };
    for entry in given.items()?.iter() {
        let (name, value): (String, Bound<'_, PyAny>) = entry.extract()?;
        options.set(&name, &text(&value)?).map_err(input)?;
    }
    Ok(())
}

/// How an option's value is written. The switches of numpy are no `bool`, but are written alike.
fn text(value: &Bound<'_, PyAny>) -> PyResult<String> {
    let text = value.str()?.to_string();
    Ok(match &text[..] {
        "True" => "on".to_owned(),
        "False" => "off".to_owned(),
        _ => text,
    })
}

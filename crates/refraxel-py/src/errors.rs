//! Failures of the libraries as exceptions of `refraxel.errors`.

use pyo3::{PyErr, import_exception};
use refraxel::exit::{Exit, Failure};
use refraxel::verbs::dataset::data_failure;
use refraxel::verbs::train::session_failure;
use refraxel_data::DataError;
use refraxel_train::session::SessionError;

import_exception!(refraxel.errors, InputError);
import_exception!(refraxel.errors, FileError);
import_exception!(refraxel.errors, DivergedError);
import_exception!(refraxel.errors, CancelledError);

/// The exception for a failure of a verb.
pub fn raised(failure: Failure) -> PyErr {
    let report = failure.report();
    let text = report.strip_prefix("error: ").unwrap_or(&report).to_owned();
    match failure.exit {
        Exit::Io => FileError::new_err(text),
        Exit::Numerical => DivergedError::new_err(text),
        Exit::Interrupted => CancelledError::new_err(text),
        _ => InputError::new_err(text),
    }
}

/// The exception for input that cannot be used.
pub fn input(error: impl Into<anyhow::Error>) -> PyErr {
    raised(Failure::new(Exit::BadInput, error))
}

/// The same, for a sentence.
pub fn refused(text: impl Into<String>) -> PyErr {
    InputError::new_err(text.into())
}

/// The exception for data that cannot be used.
pub fn of_data(error: DataError) -> PyErr {
    raised(data_failure(error))
}

/// The exception for a session that cannot go on.
pub fn of_session(error: SessionError) -> PyErr {
    raised(session_failure(error))
}

/// The exception for work that somebody wished to stop.
pub fn cancelled() -> PyErr {
    CancelledError::new_err("cancelled")
}

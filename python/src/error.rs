//! Exceptions from errors.

use harness::case::Fault;
use harness::scene::Failure;
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::path::Path;

pyo3::create_exception!(
    polymech,
    SceneError,
    PyValueError,
    "A fault in a scene. The text has the lines of the scene with a caret; `key` is the path of the key, \
     `line` its line."
);
pyo3::create_exception!(
    polymech,
    RunError,
    PyRuntimeError,
    "A run that failed: its solution did not converge, for example."
);
pyo3::create_exception!(
    polymech,
    Interrupted,
    RunError,
    "A run that was stopped. Its checkpoint is in the folder `output`; `resume` continues it."
);

/// Creates the exception of a run that failed; `output` is its folder.
pub fn failure<E: Fault>(py: Python<'_>, failure: Failure<E>, output: &Path) -> PyErr {
    match failure {
        Failure::Scene(error) => {
            let plain = error.plain();
            // the message above the source excerpt
            let picture = plain.find("╭─").and_then(|at| plain[..at].rfind('\n')).map(|at| &plain[at + 1..]);
            let raised = SceneError::new_err(match picture {
                Some(picture) => format!("{}\n{picture}", error.message()),
                None => plain,
            });
            let value = raised.value(py);
            // an exception can have attributes
            let _ = value.setattr("key", error.key()).and_then(|()| value.setattr("line", error.line()));
            raised
        }
        Failure::Run(error) if error.is_interruption() => {
            let raised = Interrupted::new_err(format!(
                "stopped; continue with resume({:?})",
                output.display().to_string()
            ));
            let _ = raised.value(py).setattr("output", output);
            raised
        }
        Failure::Run(error) => fault(&error),
    }
}

/// Converts an error of one of the crates: `ValueError` for bad input.
pub fn fault<E: Fault>(error: &E) -> PyErr {
    match error.exit_code() {
        2 => PyValueError::new_err(error.to_string()),
        _ => RunError::new_err(error.to_string()),
    }
}

/// Creates a `ValueError`, for laws, fits and parameters.
pub fn value(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// Creates the exception of a file that cannot be read: `OSError` if the system refuses it, else
/// `ValueError`.
pub fn file(error: &polycore::Error) -> PyErr {
    match error {
        polycore::Error::Io { .. } => PyOSError::new_err(error.to_string()),
        _ => value(error),
    }
}

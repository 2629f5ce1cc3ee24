//! Locates errors of the physics at their keys in a scene.

use crate::error::Error;
use harness::scene::{SceneError, Source};

/// Converts an error to a scene error at `key`, with the allowed values or known names.
pub fn located(source: &Source, key: &str, error: &Error) -> SceneError {
    match error {
        Error::Parameter { name, found, allowed } => source.error(key, format!("{name} = {found}"), allowed),
        Error::Unknown { name, known, .. } => {
            let known: Vec<&str> = known.iter().map(String::as_str).collect();
            source.unknown(key, name, &known)
        }
        other => source.refused(key, other),
    }
}

/// Converts an error of a block to a scene error at the key of its parameter; `keys` pairs parameters with
/// keys.
pub fn located_in(source: &Source, block: &str, keys: &[(&str, &str)], error: &Error) -> SceneError {
    let key = match error {
        Error::Parameter { name, .. } => keys.iter().find(|(parameter, _)| parameter == name),
        _ => None,
    };
    match key {
        Some((_, key)) => located(source, &format!("{block}.{key}"), error),
        None => located(source, block, error),
    }
}

//! Errors of the physics at their keys in a scene.

use crate::error::Error;
use harness::scene::{SceneError, Source};

/// An error at a key: values with what is allowed, names with those that are known.
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

/// An error of a block, at the key inside it that holds the parameter: `keys` are names of parameters and keys.
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

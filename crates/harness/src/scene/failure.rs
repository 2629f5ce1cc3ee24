//! Errors that end a run.

use super::SceneError;

/// A fault in the scene, or one met on the way: an error `E` of the crate that runs it.
#[derive(Debug, thiserror::Error)]
pub enum Failure<E> {
    /// The scene.
    #[error(transparent)]
    Scene(SceneError),
    /// Anything else.
    #[error(transparent)]
    Run(E),
}

impl<E> From<SceneError> for Failure<E> {
    fn from(error: SceneError) -> Self {
        Self::Scene(error)
    }
}

impl<E: From<polycore::Error>> From<polycore::Error> for Failure<E> {
    fn from(error: polycore::Error) -> Self {
        Self::Run(error.into())
    }
}

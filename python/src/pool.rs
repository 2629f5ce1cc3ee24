//! Threads of this process: a forked process inherits none from its parent.

use pyo3::PyResult;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Process that loaded the module; rayon's own threads belong to it.
static LOADED_IN: AtomicU32 = AtomicU32::new(0);

/// Threads of a forked process, with its process id.
static FORKED: Mutex<Option<(u32, Arc<rayon::ThreadPool>)>> = Mutex::new(None);

/// Marks this process as the one that loaded the module.
pub fn loaded() {
    LOADED_IN.store(std::process::id(), Ordering::Relaxed);
}

/// Creates threads in a forked process: rayon's own would never answer there.
///
/// # Errors
/// `ValueError` if the system provides no threads.
pub fn forked() -> PyResult<Option<Arc<rayon::ThreadPool>>> {
    let own = std::process::id();
    if own == LOADED_IN.load(Ordering::Relaxed) {
        return Ok(None);
    }
    let mut kept = FORKED.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((process, pool)) = &*kept
        && *process == own
    {
        return Ok(Some(pool.clone()));
    }
    let pool = rayon::ThreadPoolBuilder::new().build().map_err(|error| {
        crate::error::value(format!(
            "threads of a forked process: {error}; use multiprocessing.get_context(\"spawn\")"
        ))
    })?;
    let pool = Arc::new(pool);
    // the pool of the parent has no threads that could end
    std::mem::forget(kept.replace((own, pool.clone())));
    Ok(Some(pool))
}

/// Runs work on threads of this process.
///
/// # Errors
/// As [`forked`].
pub fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(match forked()? {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

//! Threads of this process: a process forked from one that has computed has none of its parent's.

use pyo3::PyResult;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The process that loaded the module; rayon's own threads belong to it.
static LOADED_IN: AtomicU32 = AtomicU32::new(0);

/// The threads of a forked process, with its number.
static FORKED: Mutex<Option<(u32, Arc<rayon::ThreadPool>)>> = Mutex::new(None);

/// Marks this process as that which loaded the module.
pub fn loaded() {
    LOADED_IN.store(std::process::id(), Ordering::Relaxed);
}

/// Threads of its own in a process that was forked: none of rayon's would ever answer there.
///
/// # Errors
/// `ValueError` where the system gives no threads.
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
    // that of a parent has no threads that could end
    std::mem::forget(kept.replace((own, pool.clone())));
    Ok(Some(pool))
}

/// Computes on threads that this process has.
///
/// # Errors
/// As [`forked`].
pub fn here<T: Send>(work: impl FnOnce() -> T + Send) -> PyResult<T> {
    Ok(match forked()? {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

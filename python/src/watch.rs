//! Long work on a separate thread, while the caller's thread handles signals and calls Python's functions.

use harness::case::{Step, StepField};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::time::{Duration, Instant};

/// Interval between checks for signals.
const EVERY: Duration = Duration::from_millis(50);

/// Least time between two calls of a progress function.
const SHOWN_EVERY: Duration = Duration::from_millis(100);

/// Functions of Python that observe a run.
pub struct Watchers {
    /// `progress(part, line)`.
    pub progress: Option<Py<PyAny>>,
    /// `on_step(values, units, fields)`; `False` stops.
    pub on_step: Option<Py<PyAny>>,
}

/// Message of the working thread.
enum Message {
    Progress(f64, String),
    Step(Step, SyncSender<bool>),
}

/// Sending end of the working thread.
pub struct RunLink<'a> {
    stop: &'a AtomicBool,
    sender: Sender<Message>,
    wants_progress: bool,
    wants_steps: bool,
    shown: Option<Instant>,
}

impl<'a> RunLink<'a> {
    /// Flag that is true once the user asks to stop.
    pub fn stop(&self) -> &'a AtomicBool {
        self.stop
    }

    /// Returns true if a function of Python receives the steps.
    pub fn wants_steps(&self) -> bool {
        self.wants_steps
    }

    /// Reports the progress from time to time.
    pub fn progress(&mut self, part: f64, line: &dyn Fn() -> String) {
        if self.wants_progress && self.shown.is_none_or(|shown| shown.elapsed() > SHOWN_EVERY) {
            self.shown = Some(Instant::now());
            let _ = self.sender.send(Message::Progress(part, line()));
        }
    }

    /// Creates a link that reports steps alone.
    pub fn steps(&self) -> RunLink<'a> {
        RunLink { sender: self.sender.clone(), wants_progress: false, shown: None, ..*self }
    }

    /// Reports a step; returns false if the run must stop.
    pub fn step(&self, step: Step) -> bool {
        if self.stop.load(Ordering::Relaxed) {
            return false;
        }
        let (answer, answered) = sync_channel(1);
        let sent = self.sender.send(Message::Step(step, answer));
        sent.is_ok() && answered.recv().unwrap_or(false)
    }
}

/// Runs `work` on a separate thread, with `threads` threads if given. A signal (`KeyboardInterrupt`) or an
/// exception of a function of Python asks it to stop, and is raised when it has.
pub fn watched<T: Send>(
    py: Python<'_>,
    watchers: &Watchers,
    threads: Option<usize>,
    work: impl FnOnce(RunLink<'_>) -> T + Send,
) -> PyResult<T> {
    let stop = AtomicBool::new(false);
    let pool = match threads {
        Some(threads) => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            Some(Arc::new(pool.map_err(crate::error::value)?))
        }
        None => crate::pool::forked()?,
    };
    let (sender, receiver) = channel();
    let (wants_progress, wants_steps) = (watchers.progress.is_some(), watchers.on_step.is_some());
    let line = RunLink { stop: &stop, sender, wants_progress, wants_steps, shown: None };
    let stop = &stop;
    py.detach(move || {
        std::thread::scope(|scope| {
            let worker = scope.spawn(move || match pool {
                Some(pool) => pool.install(|| work(line)),
                None => work(line),
            });
            let raised = hear(watchers, receiver, stop);
            let found = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            raised.map_or(Ok(found), Err)
        })
    })
}

/// Runs `work` on a separate thread, with a flag that a signal sets, without functions of Python.
pub fn stoppable<T: Send>(py: Python<'_>, work: impl FnOnce(&AtomicBool) -> T + Send) -> PyResult<T> {
    watched(py, &Watchers { progress: None, on_step: None }, None, |line| work(line.stop()))
}

/// Runs `work` that cannot be stopped on a separate thread. A signal abandons it: it runs to its end, and its
/// result is dropped.
pub fn left_alone<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let pool = crate::pool::forked()?;
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        let found = match pool {
            Some(pool) => pool.install(work),
            None => work(),
        };
        let _ = sender.send(found);
    });
    py.detach(move || {
        loop {
            match receiver.recv_timeout(EVERY) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(PyRuntimeError::new_err("a thread ended without an answer"));
                }
            }
        }
    })
}

/// Serves the working thread until it ends; returns the first exception.
fn hear(watchers: &Watchers, receiver: Receiver<Message>, stop: &AtomicBool) -> Option<PyErr> {
    let mut raised = None;
    loop {
        let message = match receiver.recv_timeout(EVERY) {
            Err(RecvTimeoutError::Disconnected) => return raised,
            Err(RecvTimeoutError::Timeout) => None,
            Ok(message) => Some(message),
        };
        Python::attach(|py| {
            let answered = message.map_or(Ok(()), |message| serve(py, watchers, message));
            if let Err(error) = answered.and_then(|()| py.check_signals()) {
                stop.store(true, Ordering::Relaxed);
                raised.get_or_insert(error);
            }
        });
    }
}

fn serve(py: Python<'_>, watchers: &Watchers, message: Message) -> PyResult<()> {
    match message {
        Message::Progress(part, line) => {
            if let Some(progress) = &watchers.progress {
                progress.call1(py, (part, line))?;
            }
            Ok(())
        }
        Message::Step(step, answer) => {
            let Some(on_step) = &watchers.on_step else { return Ok(()) };
            let (values, units) = (PyDict::new(py), PyDict::new(py));
            for (name, unit, value) in step.values {
                values.set_item(name, value)?;
                units.set_item(name, unit)?;
            }
            let fields = PyDict::new(py);
            for StepField { name, unit, components, data } in step.fields {
                units.set_item(name, unit)?;
                let flat = data.into_pyarray(py);
                match components {
                    1 => fields.set_item(name, flat)?,
                    _ => fields.set_item(name, flat.reshape([flat.len()? / components, components])?)?,
                }
            }
            // an error drops the sender, which stops the run
            let more = on_step.call1(py, (values, units, fields))?;
            let stop = more.bind(py).is(pyo3::types::PyBool::new(py, false));
            let _ = answer.send(!stop);
            Ok(())
        }
    }
}

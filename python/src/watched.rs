//! Work that Ctrl-C interrupts.

use std::{
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::Duration,
};

use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// How often Python is asked whether it was interrupted.
const TICK: Duration = Duration::from_millis(50);

/// Does `work` on a separate thread, without the interpreter's lock, and asks Python meanwhile for interrupts: signal handlers run on
/// Python's main thread alone, so the work must run on another thread.
///
/// An interrupted caller returns at once; the work runs to its end, and its result is dropped.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (send, mut answer) = mpsc::channel();
    // The channel is closed once the caller was interrupted.
    thread::Builder::new().name("stretch".into()).spawn(move || drop(send.send(work())))?;
    loop {
        let answer = &mut answer;
        match py.detach(move || answer.recv_timeout(TICK)) {
            Ok(done) => return Ok(done),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the work ended without an answer; this is an error of stretch: please report it",
                ));
            }
        }
    }
}

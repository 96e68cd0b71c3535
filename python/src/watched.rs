//! Work that can be interrupted with Ctrl-C.

use std::{
    sync::mpsc::{self, Receiver, RecvTimeoutError},
    thread,
    time::Duration,
};

use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// Interval at which Python signals are checked.
const TICK: Duration = Duration::from_millis(50);

/// Runs `work` on a separate thread, without the interpreter lock, and checks Python signals
/// meanwhile. The calling thread must stay free, because signal handlers run only on Python's main
/// thread.
///
/// If the caller is interrupted, this returns immediately. The work continues to its end, and its
/// result is dropped.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (send, mut answer) = mpsc::channel();
    // The channel is closed once the caller was interrupted.
    thread::Builder::new().name("stretch".into()).spawn(move || drop(send.send(work())))?;
    received(py, &mut answer)
}

/// Waits for a message without the interpreter lock, and checks Python signals meanwhile.
pub(crate) fn received<T: Send>(py: Python<'_>, messages: &mut Receiver<T>) -> PyResult<T> {
    loop {
        let messages = &mut *messages;
        match py.detach(move || messages.recv_timeout(TICK)) {
            Ok(message) => return Ok(message),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "the work ended without an answer; this is an error of stretch: please report it",
                ));
            }
        }
    }
}

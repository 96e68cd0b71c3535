//! Work that Ctrl-C ends.

use std::{
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::Duration,
};

use pyo3::{exceptions::PyRuntimeError, prelude::*};

/// How often Python is asked whether it was interrupted.
const TICK: Duration = Duration::from_millis(50);

/// Does `work` on a thread of its own, without the interpreter's lock, and asks Python meanwhile whether it was
/// interrupted: signal handlers run on Python's main thread alone, which must not be the one that works.
///
/// An interrupted caller returns at once; the work runs out unseen.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
) -> PyResult<T> {
    let (tell, mut told) = mpsc::channel();
    // Nobody listens any more once the caller was interrupted.
    thread::Builder::new().name("stretch".into()).spawn(move || drop(tell.send(work())))?;
    loop {
        let told = &mut told;
        match py.detach(move || told.recv_timeout(TICK)) {
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

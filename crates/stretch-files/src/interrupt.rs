//! Ctrl-C: writers clean up after themselves, and a program without one leaves at once.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

use crate::{FileError, temporary::remove_unfinished};

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static OPEN: AtomicUsize = AtomicUsize::new(0);

/// Tells every writer to stop and clean up, and says how many are open.
///
/// A signal handler calls it. At 0 no writer is open and none can open any more, and folders that
/// were being built are gone, so the handler may leave the process at once; otherwise the writers fail with
/// [`FileError::Interrupted`] at their next write, nothing half-written stays, and the
/// program leaves when that error reaches it:
///
/// ```no_run
/// // ctrlc::set_handler(...):
/// if stretch_files::interrupt() == 0 {
///     std::process::exit(130);
/// }
/// ```
pub fn interrupt() -> usize {
    // Stored before the count is read; a writer counts itself before it reads the flag:
    // one of the two always sees the other.
    INTERRUPTED.store(true, SeqCst);
    let open = writers_open();
    if open == 0 {
        remove_unfinished();
    }
    open
}

/// Whether [`interrupt`] was called: long work inside a writer's closure may ask.
pub fn interrupted() -> bool {
    INTERRUPTED.load(SeqCst)
}

/// How many files are being written, and folders being given their names.
pub fn writers_open() -> usize {
    OPEN.load(SeqCst)
}

/// Counts a writer as open for as long as it lives.
pub(crate) struct Open(());

impl Open {
    pub(crate) fn new(path: &dyn std::fmt::Display) -> Result<Self, FileError> {
        OPEN.fetch_add(1, SeqCst);
        let open = Self(());
        check(path)?;
        Ok(open)
    }
}

impl Drop for Open {
    fn drop(&mut self) {
        OPEN.fetch_sub(1, SeqCst);
    }
}

pub(crate) fn check(path: &dyn std::fmt::Display) -> Result<(), FileError> {
    if interrupted() {
        return Err(FileError::Interrupted { path: path.to_string() });
    }
    Ok(())
}

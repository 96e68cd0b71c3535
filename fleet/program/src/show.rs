//! Output of the program: results, warnings, progress bars, and panics as one line.

use std::{
    any::Any,
    cell::Cell,
    io::{self, Write},
    panic::{AssertUnwindSafe, catch_unwind, set_hook},
    sync::Once,
    time::Duration,
};

use indicatif::{ProgressBar, ProgressStyle};

use crate::lake::Refused;

/// Largest number of refused files that a message lists.
const MOST_TOLD: usize = 20;

/// Prints a line. A closed standard output is no error.
pub(crate) fn say(text: impl std::fmt::Display) -> anyhow::Result<()> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Err(e.into()),
        _ => Ok(()),
    }
}

/// Writes a message to standard error.
pub(crate) fn warn(text: impl std::fmt::Display) {
    // If the message cannot be written, there is no way to report that.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Prints which files were refused; of many, only the first ones.
pub(crate) fn warn_of(what: &str, refused: &[Refused]) {
    for Refused { file, why } in refused.iter().take(MOST_TOLD) {
        warn(format!("{what} {file}: {why}"));
    }
    if refused.len() > MOST_TOLD {
        warn(format!("... and {} more", refused.len() - MOST_TOLD));
    }
}

/// Returns a progress bar on standard error. It is visible on a terminal only.
pub(crate) fn bar(what: &'static str, steps: usize) -> ProgressBar {
    let bar = ProgressBar::new(steps as u64).with_message(what);
    // The template is a constant. If it were wrong, the plain bar would be shown.
    if let Ok(style) =
        ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len}, {elapsed} elapsed, {eta} left")
    {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

thread_local! {
    /// Whether [`caught`] is running on this thread, which reports a panic as an error.
    static IS_CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// From now on, a panic prints one line on standard error, without a backtrace. It prints nothing
/// if [`caught`] turns it into an error.
pub(crate) fn tell_in_a_line() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        set_hook(Box::new(|info| {
            if !IS_CAUGHT.get() {
                let line = info.to_string().replace('\n', " ");
                warn(format!("stretch-fleet: a thread {line}"));
            }
        }));
    });
}

/// Runs a reader and turns its panic into an error, because a panic concerns only one file.
///
/// The readers of Parquet and of the Arrow schema in its footer panic on some damaged files:
/// `arrow-ipc` has an `unimplemented!` or an `unwrap` for invalid schemas. No option switches that
/// off for every reader, because a query reads the embedded schema whatever the options of its
/// table. Therefore a footer is read here before any query reads it, and a panic is caught.
///
/// # Errors
/// The panic message. The reader's result is lost, so the reader must not change anything else.
pub(crate) fn caught<T>(read: impl FnOnce() -> T) -> anyhow::Result<T> {
    let outer = IS_CAUGHT.replace(true);
    let answer = catch_unwind(AssertUnwindSafe(read));
    IS_CAUGHT.set(outer);
    answer.map_err(|panic| anyhow::anyhow!("reading the file failed: {}", message(panic.as_ref())))
}

/// Returns the message of a panic.
pub(crate) fn message(panic: &(dyn Any + Send)) -> &str {
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    owned.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no reason given")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_an_error_with_its_words() {
        assert_eq!(caught(|| 1).unwrap(), 1);
        let words: [fn(); 2] = [|| panic!("no type"), || panic!("type {}", 133)];
        let told = words.map(|word| caught(word).unwrap_err().to_string());
        assert_eq!(told, ["reading the file failed: no type", "reading the file failed: type 133"]);
        assert!(!IS_CAUGHT.get());
    }
}

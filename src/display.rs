//! What the program says, where whoever reads it may have gone: no work hangs on it.
//!
//! Standard error is a courtesy: what cannot be written there is let go. Standard output may be
//! what was asked for: the first failure is kept, the work goes on, its files are written, and
//! [`lost`] tells the end of the program.

use std::{
    fmt::Display,
    io::{self, ErrorKind, Write},
    path::Path,
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering::SeqCst},
    },
};

use anyhow::ensure;
use stretch_data::is_standard_output;

static LOST: OnceLock<ErrorKind> = OnceLock::new();

/// Whether a file goes to standard output, where nothing else may then stand.
static TAKEN: AtomicBool = AtomicBool::new(false);

/// Gives standard output to the one of some files that is called `-`, or so.
pub(crate) fn give_stdout<'a>(
    files: impl IntoIterator<Item = Option<&'a Path>>,
) -> anyhow::Result<()> {
    let count = files.into_iter().flatten().filter(|path| is_standard_output(path)).count();
    ensure!(count < 2, "two files cannot go to standard output; name one of them");
    TAKEN.fetch_or(count == 1, SeqCst);
    Ok(())
}

/// A text and a line end to standard output, to standard error where a file goes there.
///
/// # Errors
/// None: a result, so that a command can end with what it says.
pub(crate) fn say(text: impl Display) -> anyhow::Result<()> {
    if TAKEN.load(SeqCst) {
        warn(text);
        return Ok(());
    }
    // what was lost is kept by `Output`
    let _ = writeln!(Output, "{}", plain(&text.to_string()));
    Ok(())
}

/// A value as JSON to standard output.
///
/// # Errors
/// A value that JSON cannot hold.
pub(crate) fn say_json(value: &impl serde::Serialize) -> anyhow::Result<()> {
    say(serde_json::to_string_pretty(value)?)
}

/// A text and a line end to standard error, or to nobody.
pub(crate) fn warn(text: impl Display) {
    let line = plain(&text.to_string()) + "\n";
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// A text without what a terminal acts on, or what turns the text around it or hides: names come from
/// files of anybody. What is written in its place is an escape of JSON, too.
fn plain(text: &str) -> String {
    let mut told = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '\n' | '\t' => told.push(c),
            '\u{61c}'
            | '\u{200b}'..='\u{200f}'
            | '\u{2028}'..='\u{202e}'
            | '\u{2066}'..='\u{2069}'
            | '\u{feff}' => {
                told += &format!("\\u{:04x}", u32::from(c));
            }
            c if c.is_control() => told += &format!("\\u{:04x}", u32::from(c)),
            c => told.push(c),
        }
    }
    told
}

/// Why standard output could not take all that it was given, if it could not.
pub(crate) fn lost() -> Option<ErrorKind> {
    LOST.get().copied()
}

/// Standard output that keeps the first failure for [`lost`].
#[derive(Debug)]
pub(crate) struct Output;

fn kept<T>(result: io::Result<T>) -> io::Result<T> {
    result.inspect_err(|error| {
        // a call that was interrupted is made again
        if error.kind() != ErrorKind::Interrupted {
            let _ = LOST.set(error.kind());
        }
    })
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        kept(io::stdout().lock().write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        kept(io::stdout().lock().flush())
    }
}

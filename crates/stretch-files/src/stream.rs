//! Outputs that are no files: standard output, pipes, devices.

use std::{
    fs::{Metadata, OpenOptions},
    io::{self, Write},
    path::Path,
};

/// Whether a path is standard output, as a file that is written: `-`, `/dev/stdout`.
///
/// ```
/// assert!(stretch_files::is_standard_output("-") && stretch_files::is_standard_output("/dev/stdout"));
/// assert!(!stretch_files::is_standard_output("out.csv"));
/// ```
pub fn is_standard_output(path: impl AsRef<Path>) -> bool {
    let path = path.as_ref();
    path.as_os_str() == "-" || is_one_of(path, STDOUT)
}

const STDIN: [&str; 3] = ["/dev/stdin", "/dev/fd/0", "/proc/self/fd/0"];
const STDOUT: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
const STDERR: [&str; 3] = ["/dev/stderr", "/dev/fd/2", "/proc/self/fd/2"];

fn is_one_of(path: &Path, names: [&str; 3]) -> bool {
    cfg!(unix) && names.iter().any(|name| path == Path::new(name))
}

/// What bytes can go to at once; none where the path is that of a file, or of nothing yet.
///
/// The program's own streams are not opened anew: where they are redirected into a file, that would
/// begin to write at its start again.
pub(crate) fn open(path: &Path, meta: Option<&Metadata>) -> io::Result<Option<Box<dyn Write>>> {
    if is_standard_output(path) {
        return Ok(Some(Box::new(io::stdout())));
    }
    if is_one_of(path, STDERR) {
        return Ok(Some(Box::new(io::stderr())));
    }
    if is_one_of(path, STDIN) {
        return Err(io::Error::other("it is standard input, which is read; name a file"));
    }
    let is_descriptor = path.starts_with("/dev/fd") || path.starts_with("/proc");
    match meta {
        None => Ok(None),
        Some(meta) if meta.is_file() && !is_descriptor => Ok(None),
        Some(meta) => device(path, meta).map(Some),
    }
}

#[cfg(unix)]
fn device(path: &Path, meta: &Metadata) -> io::Result<Box<dyn Write>> {
    use rustix::{fs::OFlags, io::Errno};
    use std::{
        os::unix::fs::{FileTypeExt, OpenOptionsExt},
        thread,
        time::{Duration, Instant},
    };

    let kind = meta.file_type();
    if kind.is_block_device() {
        return Err(io::Error::other("it is a disk; name a file"));
    }
    if kind.is_socket() {
        return Err(io::Error::other("it is a socket; name a file"));
    }
    let mut options = OpenOptions::new();
    // to open a pipe waits for its reader, to open a serial port for a carrier: for ever
    let flags = OFlags::NONBLOCK | OFlags::NOCTTY;
    options.write(true).custom_flags(flags.bits() as i32);
    let begun = Instant::now();
    let file = loop {
        match options.open(path) {
            Ok(file) => break file,
            Err(e) if kind.is_fifo() && e.raw_os_error() == Some(Errno::NXIO.raw_os_error()) => {
                if begun.elapsed() > READER {
                    return Err(io::Error::other(
                        "it is a pipe that nobody reads; begin to read it first",
                    ));
                }
                thread::sleep(Duration::from_millis(10));
            }
            Err(e) => return Err(e),
        }
    };
    let flags = rustix::fs::fcntl_getfl(&file)?;
    rustix::fs::fcntl_setfl(&file, flags - OFlags::NONBLOCK)?;
    Ok(Box::new(file))
}

/// How long to wait for the reader of a pipe.
#[cfg(unix)]
const READER: std::time::Duration = std::time::Duration::from_secs(2);

#[cfg(not(unix))]
fn device(path: &Path, _meta: &Metadata) -> io::Result<Box<dyn Write>> {
    Ok(Box::new(OpenOptions::new().write(true).open(path)?))
}

//! Outputs that are not files: standard output, pipes, devices.

use std::{
    fs::{File, Metadata},
    io::{self, Write},
    path::Path,
};

const STDIN: [&str; 3] = ["/dev/stdin", "/dev/fd/0", "/proc/self/fd/0"];
const STDOUT: [&str; 4] = ["-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// Whether an output path means standard output: `-`, `/dev/stdout`.
///
/// ```
/// use stretch_data::files::is_standard_output;
/// assert!(is_standard_output("-") && is_standard_output("/dev/stdout"));
/// assert!(!is_standard_output("out.csv"));
/// ```
pub fn is_standard_output(path: impl AsRef<Path>) -> bool {
    STDOUT.map(Path::new).contains(&path.as_ref())
}

/// Opens a target that takes bytes directly. Returns `None` if the path is a regular file or does
/// not exist yet.
///
/// Standard output is used through its open handle. Opening it again would write from the beginning of the file if it
/// is redirected into one.
pub(super) fn open_stream(
    path: &Path,
    meta: Option<&Metadata>,
) -> io::Result<Option<Box<dyn Write>>> {
    if is_standard_output(path) {
        return Ok(Some(Box::new(Stream(io::stdout()))));
    }
    if STDIN.map(Path::new).contains(&path) {
        return Err(io::Error::other("it is standard input, which cannot be written; name a file"));
    }
    let is_descriptor = path.starts_with("/dev/fd") || path.starts_with("/proc");
    match meta.filter(|meta| is_descriptor || !meta.is_file()) {
        Some(meta) => Ok(Some(Box::new(Stream(open_device(path, meta)?)))),
        None => Ok(None),
    }
}

/// Standard output or a pipe. If its reader has closed it, as `head` does, the remaining bytes are
/// discarded without an error, because the other outputs of the command are still wanted.
struct Stream<W>(W);

fn unless_closed<T>(done: io::Result<T>, instead: T) -> io::Result<T> {
    match done {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(instead),
        done => done,
    }
}

impl<W: Write> Write for Stream<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        unless_closed(self.0.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        unless_closed(self.0.flush(), ())
    }
}

#[cfg(unix)]
fn open_device(path: &Path, meta: &Metadata) -> io::Result<File> {
    use rustix::{
        fs::{Mode, OFlags, fcntl_setfl, open},
        io::Errno,
    };
    use std::{os::unix::fs::FileTypeExt, thread, time::Duration};

    if meta.file_type().is_block_device() {
        return Err(io::Error::other("it is a disk; name a file"));
    }
    // Without NONBLOCK, opening a pipe could wait for its reader forever, and opening a serial port
    // for a carrier.
    let flags = OFlags::WRONLY | OFlags::CLOEXEC | OFlags::NOCTTY;
    // A reader may start up to two seconds later.
    for _ in 0..200 {
        match open(path, flags | OFlags::NONBLOCK, Mode::empty()) {
            Err(Errno::NXIO) if meta.file_type().is_fifo() => {
                thread::sleep(Duration::from_millis(10));
            }
            opened => {
                let file = File::from(opened?);
                fcntl_setfl(&file, flags)?;
                return Ok(file);
            }
        }
    }
    Err(io::Error::other("no program reads this pipe; start the reader first"))
}

#[cfg(not(unix))]
fn open_device(path: &Path, _meta: &Metadata) -> io::Result<File> {
    File::options().write(true).open(path)
}

//! The port: reads bytes from a serial line that may disconnect and reconnect.

use std::{
    fs::{File, OpenOptions},
    io::{self, Read},
    path::{Path, PathBuf},
    sync::mpsc::{Receiver, SyncSender, sync_channel},
    thread,
    time::Duration,
};

/// An event of the port.
pub(crate) enum Heard {
    Bytes(Vec<u8>),
    Connected,
    /// The port has disconnected, for the given reason. It is reopened until the user stops
    /// listening.
    Disconnected(String),
    /// The end of a stream that cannot reconnect: a pipe or a file.
    Ended,
}

/// Delay before reopening a disconnected port.
const RETRY: Duration = Duration::from_millis(200);

/// Largest number of queued events. If the queue is full, reading the port waits.
const WAITING: usize = 64;

/// Starts to read a port; `-` is standard input.
///
/// # Errors
/// A port that cannot be opened the first time, or that is a folder.
pub(crate) fn listen(path: &Path, baud: u32) -> io::Result<Receiver<Heard>> {
    let (sender, heard) = sync_channel(WAITING);
    if path.as_os_str() == "-" {
        thread::spawn(move || {
            let _ = read_all(io::stdin(), &sender);
            let _ = sender.send(Heard::Ended);
        });
        return Ok(heard);
    }
    let first = open(path, baud)?;
    if first.metadata()?.is_dir() {
        // A folder can be opened, but delivers no bytes.
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a folder; name a serial port",
        ));
    }
    let path = path.to_owned();
    // Reading blocks. The thread ends with the program, or when the receiver is dropped.
    thread::spawn(move || keep_reading(first, path, baud, &sender));
    Ok(heard)
}

fn keep_reading(first: File, path: PathBuf, baud: u32, sender: &SyncSender<Heard>) {
    let mut port = Some(first);
    loop {
        if let Some(file) = port.take() {
            let regular = file.metadata().is_ok_and(|meta| meta.is_file());
            if sender.send(Heard::Connected).is_err() {
                return;
            }
            let why = match read_all(file, sender) {
                Ok(()) if regular => {
                    let _ = sender.send(Heard::Ended);
                    return;
                }
                Ok(()) => "the port was closed".to_owned(),
                Err(error) => error.to_string(),
            };
            if sender.send(Heard::Disconnected(why)).is_err() {
                return;
            }
        }
        thread::sleep(RETRY);
        port = open(&path, baud).ok();
    }
}

fn read_all(mut port: impl Read, sender: &SyncSender<Heard>) -> io::Result<()> {
    let mut buffer = [0; 4096];
    loop {
        match port.read(&mut buffer) {
            Ok(0) => return Ok(()),
            Ok(n) => {
                if sender.send(Heard::Bytes(buffer[..n].to_vec())).is_err() {
                    return Ok(());
                }
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(unix)]
fn open(path: &Path, baud: u32) -> io::Result<File> {
    use rustix::{fs::OFlags, termios};
    use std::os::unix::fs::OpenOptionsExt;

    let mut options = OpenOptions::new();
    options.read(true);
    // Without NOCTTY the port would become the controlling terminal, and a Ctrl-C byte on the line
    // would interrupt the program.
    let port = options.custom_flags(OFlags::NOCTTY.bits() as i32).open(path)?;
    if termios::isatty(&port) {
        let mut settings = termios::tcgetattr(&port)?;
        settings.make_raw();
        settings.set_speed(baud)?;
        termios::tcsetattr(&port, termios::OptionalActions::Now, &settings)?;
    }
    Ok(port)
}

#[cfg(not(unix))]
fn open(path: &Path, _baud: u32) -> io::Result<File> {
    // The user sets the speed beforehand (mode COM3 ...).
    OpenOptions::new().read(true).open(path)
}

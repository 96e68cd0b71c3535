//! Functions shared by the subcommands: progress, writing, Ctrl-C.
//!
//! At Ctrl-C a live recording ends normally, as at the end of its stream. Everything else stops
//! immediately, and no partial output remains.

use std::{
    ffi::OsStr,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::{
        atomic::{AtomicBool, Ordering::SeqCst},
        mpsc::{Receiver, RecvTimeoutError, sync_channel},
    },
    time::Duration,
};

use clap::{
    Arg, Command,
    builder::{PossibleValue, TypedValueParser},
};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use stretch_data::files::{FileError, Outputs};

use crate::display::shows_progress;
pub(crate) use crate::display::{
    detail, doubt, give_stdout, say, say_as_is, say_below, say_first, tell,
};

/// A parser of values that a shell completes with `names`, although it accepts further values.
#[derive(Clone)]
pub(crate) struct Completed<P> {
    pub(crate) names: fn() -> Vec<String>,
    pub(crate) parser: P,
}

impl<P: TypedValueParser> TypedValueParser for Completed<P> {
    type Value = P::Value;

    fn parse_ref(
        &self,
        command: &Command,
        argument: Option<&Arg>,
        value: &OsStr,
    ) -> Result<P::Value, clap::Error> {
        self.parser.parse_ref(command, argument, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new((self.names)().into_iter().map(PossibleValue::new)))
    }
}

/// Returns a progress bar on standard error. It is visible on a terminal only.
pub(crate) fn progress(what: &'static str, steps: u64) -> ProgressBar {
    let bar = ProgressBar::new(steps).with_message(what);
    // The template is a constant. If it were wrong, the plain bar would be shown.
    if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {pos}/{len} {elapsed}") {
        bar.set_style(style);
    }
    ticking(bar)
}

/// Returns a spinner with the current step and the elapsed time. It is visible on a terminal only.
pub(crate) fn spinner() -> ProgressBar {
    let bar = ProgressBar::new_spinner().with_message("reading");
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} {elapsed}") {
        bar.set_style(style);
    }
    ticking(bar)
}

/// Starts the regular updates of a bar, or hides the bar.
fn ticking(bar: ProgressBar) -> ProgressBar {
    if shows_progress() {
        bar.enable_steady_tick(Duration::from_millis(150));
    } else {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

/// Adds advice on how to replace the folder to an error about an existing folder.
pub(crate) fn or_force(error: anyhow::Error) -> anyhow::Error {
    match error.downcast_ref::<FileError>() {
        Some(FileError::Exists { .. }) => anyhow::anyhow!(
            "{error}, or give --force: files with the same names are then replaced, other files are kept"
        ),
        _ => error,
    }
}

/// Returns a number with its unit, or alone if the unit is empty.
pub(crate) fn with_unit(number: f64, unit: &str) -> String {
    format!("{} {unit}", crate::table::number(number)).trim_end().to_owned()
}

/// Adds the names of files to an error that does not contain them.
pub(crate) fn of_files(error: impl Into<anyhow::Error>, paths: &[PathBuf]) -> anyhow::Error {
    let (error, shown) = (error.into(), |path: &Path| path.display().to_string());
    let message = format!("{error:#}");
    let is_named = |path: &PathBuf| {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
        message.contains(&*name)
    };
    match paths {
        [] => error,
        paths if paths.iter().any(is_named) => error,
        [path] => error.context(shown(path)),
        [first, others @ ..] => {
            error.context(format!("{} and {} more", shown(first), others.len()))
        }
    }
}

/// Adds a text file to the outputs of a command.
pub(crate) fn stage_text(outputs: &mut Outputs, path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(outputs.file(path, |out| out.write_all(text.as_bytes()))?)
}

/// Writes a text file, completely or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> anyhow::Result<()> {
    Ok(stretch_data::files::write_whole(path, |out| out.write_all(text.as_bytes()))?)
}

/// Returns a file's name without folder and extension.
pub(crate) fn short_name(path: &Path) -> String {
    path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

/// Largest number of queued blocks of standard input.
const WAITING: usize = 64;

static RECORDING: AtomicBool = AtomicBool::new(false);
static ENDED: AtomicBool = AtomicBool::new(false);

/// Handles Ctrl-C. The first one ends a recording normally, the second one exits.
pub(crate) fn on_ctrl_c(exit_code: u8) {
    if RECORDING.load(SeqCst) && !ENDED.swap(true, SeqCst) {
        return;
    }
    stretch_data::files::clean_up_and_exit(exit_code)
}

/// After this call, the first Ctrl-C only sets the flag that [`is_ended`] returns.
pub(crate) fn begin_recording() {
    RECORDING.store(true, SeqCst);
}

/// Whether Ctrl-C has ended the recording.
pub(crate) fn is_ended() -> bool {
    ENDED.load(SeqCst)
}

/// Standard input that ends at Ctrl-C, so that the data received before are still written.
pub(crate) struct RecordedInput {
    pieces: Receiver<io::Result<Vec<u8>>>,
    piece: Vec<u8>,
    taken: usize,
}

impl RecordedInput {
    /// Starts to read standard input.
    pub(crate) fn new() -> Self {
        begin_recording();
        let (sender, pieces) = sync_channel(WAITING);
        // Reading blocks. The thread ends with the stream or with the program.
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            loop {
                let piece = io::stdin().read(&mut buffer).map(|n| buffer[..n].to_vec());
                let last = !matches!(&piece, Ok(bytes) if !bytes.is_empty());
                if sender.send(piece).is_err() || last {
                    return;
                }
            }
        });
        Self { pieces, piece: Vec::new(), taken: 0 }
    }
}

impl Read for RecordedInput {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.piece.len() {
            match self.pieces.recv_timeout(Duration::from_millis(50)) {
                Ok(piece) => {
                    self.piece = piece?;
                    self.taken = 0;
                    if self.piece.is_empty() {
                        return Ok(0);
                    }
                }
                Err(RecvTimeoutError::Timeout) if !ENDED.load(SeqCst) => {}
                Err(_) => return Ok(0),
            }
        }
        let n = out.len().min(self.piece.len() - self.taken);
        out[..n].copy_from_slice(&self.piece[self.taken..self.taken + n]);
        self.taken += n;
        Ok(n)
    }
}

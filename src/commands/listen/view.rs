//! Display of `listen`: CSV rows on standard output, and a status line on a terminal.
//!
//! A separate thread writes both, so that a slow reader or a stopped terminal cannot delay a
//! recording.

use std::{
    io::{self, BufWriter, IsTerminal, Write},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering::SeqCst},
        mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, channel, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use stretch_calibrate::{LinkSample, LinkStatus};

use crate::{
    commands::shared::is_ended,
    display::{Output, shows_progress, warn},
};

/// Largest number of blocks queued for standard output while a recording continues. A block is the
/// result of one read of the port, at most 4096 bytes, so the queue holds at most 64 MB.
const WAITING: usize = 16_384;

/// After Ctrl-C, time to wait for a reader of standard output that does not read.
const PATIENCE: Duration = Duration::from_secs(1);

/// Minimum time between updates of the status line.
const REFRESH: Duration = Duration::from_millis(100);

pub(crate) struct View {
    blocks: SyncSender<Shown>,
    /// Whether rows are written to standard output.
    has_rows: bool,
    /// Set once a write to standard output failed.
    gone: Arc<AtomicBool>,
    done: Receiver<()>,
    /// Whether the port waits for the reader of the rows, which is the case without a recording.
    waits: bool,
    unseen: u64,
    refreshed: Instant,
}

/// What the writing thread has to write.
enum Shown {
    Rows(Vec<u8>),
    Note(String),
    Status(String),
}

impl View {
    /// Starts the thread. `has_rows`: whether samples are written to standard output. `waits`:
    /// whether the port waits for their reader.
    pub(crate) fn open(header: &str, has_rows: bool, waits: bool) -> Self {
        let (blocks, shown) = sync_channel(WAITING);
        let (finished, done) = channel();
        let gone = Arc::new(AtomicBool::new(false));
        let is_gone = gone.clone();
        let header = has_rows.then(|| Shown::Rows(header.as_bytes().to_vec()));
        thread::spawn(move || {
            let mut out = BufWriter::new(Output);
            let bar = status_line(has_rows);
            for block in header.into_iter().chain(shown) {
                match block {
                    Shown::Status(text) => bar.set_message(text),
                    Shown::Note(text) => bar.suspend(|| warn(format!("stretch: {text}"))),
                    Shown::Rows(_) if is_gone.load(SeqCst) => {}
                    // `Output` stores the error, and it is reported at the end of the program.
                    Shown::Rows(rows) => {
                        if out.write_all(&rows).and_then(|()| out.flush()).is_err() {
                            is_gone.store(true, SeqCst);
                        }
                    }
                }
            }
            bar.finish_and_clear();
            let _ = finished.send(());
        });
        Self { blocks, has_rows, gone, done, waits, unseen: 0, refreshed: Instant::now() }
    }

    /// Whether the reader of the rows has closed standard output.
    pub(crate) fn is_gone(&self) -> bool {
        self.gone.load(SeqCst)
    }

    pub(crate) fn push(&mut self, samples: &[LinkSample]) {
        if !self.has_rows || samples.is_empty() {
            return;
        }
        let mut rows = Vec::with_capacity(64 * samples.len());
        samples.iter().for_each(|sample| sample.push_line(&mut rows));
        if self.waits {
            // This cannot fail, because the thread lives as long as this value.
            let _ = self.blocks.send(Shown::Rows(rows));
        } else if let Err(TrySendError::Full(_)) = self.blocks.try_send(Shown::Rows(rows)) {
            self.unseen += samples.len() as u64;
        }
    }

    /// Queues a note for standard error. It is dropped if the queue is full.
    pub(crate) fn note(&self, text: &str) {
        let _ = self.blocks.try_send(Shown::Note(text.to_owned()));
    }

    /// Updates the status line, at most ten times per second.
    pub(crate) fn refresh(&mut self, status: &LinkStatus) {
        if self.refreshed.elapsed() >= REFRESH {
            self.refreshed = Instant::now();
            let _ = self.blocks.try_send(Shown::Status(status.live_line()));
        }
    }

    /// Waits until everything is written, after Ctrl-C for at most one second. Returns the number
    /// of samples that were not shown.
    pub(crate) fn close(self) -> u64 {
        drop(self.blocks);
        let mut asked = None;
        while let Err(RecvTimeoutError::Timeout) = self.done.recv_timeout(Duration::from_millis(20))
        {
            if is_ended() && asked.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                break;
            }
        }
        self.unseen
    }
}

/// Returns a status line on standard error. It is hidden if standard error is not a terminal, or if
/// rows are written to the terminal.
fn status_line(has_rows: bool) -> ProgressBar {
    let bar = ProgressBar::no_length();
    if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
        bar.set_style(style);
    }
    if !shows_progress() || (has_rows && io::stdout().is_terminal()) {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    bar
}

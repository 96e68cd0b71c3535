//! What is seen while `listen` runs: CSV rows on standard output, a status line on a terminal.
//!
//! A thread of its own writes both, so that a slow reader or a stopped terminal cannot hold up a recording.

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

use super::trial_file::Sample;
use crate::{
    commands::stop,
    display::{Output, shows_progress, warn},
};

/// Blocks that may wait for a reader of standard output while a recording goes on. A block is what was read from the port at
/// once, 4096 bytes at most, so that all of them are 64 MB at most.
const WAITING: usize = 16_384;

/// How long Ctrl-C leaves a reader of standard output that does not read.
const PATIENCE: Duration = Duration::from_secs(1);

/// Time between two states of the status line.
const REFRESH: Duration = Duration::from_millis(100);

pub(crate) struct View {
    blocks: SyncSender<Shown>,
    /// Whether rows go to standard output at all.
    has_rows: bool,
    /// Set once a write to standard output failed.
    gone: Arc<AtomicBool>,
    done: Receiver<()>,
    /// Without a recording the port waits for the reader of the rows.
    waits: bool,
    unseen: u64,
    refreshed: Instant,
}

/// What the thread gets to write.
enum Shown {
    Rows(Vec<u8>),
    Note(String),
    Status(String),
}

impl View {
    /// `has_rows`: whether samples go to standard output. `waits`: whether the port waits for their reader.
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
                    // `Output` keeps the failure, and the end of the program reports it
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

    /// Whether the reader of the rows has gone.
    pub(crate) fn is_gone(&self) -> bool {
        self.gone.load(SeqCst)
    }

    pub(crate) fn push(&mut self, samples: &[Sample]) {
        if !self.has_rows || samples.is_empty() {
            return;
        }
        let mut rows = Vec::with_capacity(64 * samples.len());
        samples.iter().for_each(|sample| sample.push_line(&mut rows));
        if self.waits {
            // the thread lives as long as this does
            let _ = self.blocks.send(Shown::Rows(rows));
        } else if let Err(TrySendError::Full(_)) = self.blocks.try_send(Shown::Rows(rows)) {
            self.unseen += samples.len() as u64;
        }
    }

    /// A note on standard error, which is dropped if too much waits already.
    pub(crate) fn note(&self, text: &str) {
        let _ = self.blocks.try_send(Shown::Note(text.to_owned()));
    }

    /// Renews the status line, ten times a second at most.
    pub(crate) fn refresh(&mut self, status: &super::Status) {
        if self.refreshed.elapsed() >= REFRESH {
            self.refreshed = Instant::now();
            let _ = self.blocks.try_send(Shown::Status(status.live_line()));
        }
    }

    /// Waits until all is shown, after Ctrl-C for a second at most; returns how many samples were not shown.
    pub(crate) fn close(self) -> u64 {
        drop(self.blocks);
        let mut asked = None;
        while let Err(RecvTimeoutError::Timeout) = self.done.recv_timeout(Duration::from_millis(20))
        {
            if stop::ended() && asked.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                break;
            }
        }
        self.unseen
    }
}

/// A line on standard error that is drawn again and again. Nothing is drawn if that is no terminal, or if rows scroll by on a
/// terminal.
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

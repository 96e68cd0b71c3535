//! What is shown: a plot on a terminal, lines elsewhere. No recording waits for it.

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

use anyhow::Context;

use super::{screen::Screen, trial_file::Sample, twin::Twin};
use crate::{
    commands::stop,
    display::{Output, warn},
};

/// Blocks that wait for a reader of standard output beside a recording; a block is what was read
/// from the port at once, 4096 bytes at most, so that all of them are 64 MB at most.
const WAITING: usize = 16_384;

/// How long Ctrl-C leaves a reader of standard output that does not read.
const PATIENCE: Duration = Duration::from_secs(1);

pub(crate) enum View {
    Screen {
        screen: Box<Screen>,
        drawn: Instant,
    },
    Lines {
        blocks: SyncSender<Shown>,
        /// Nobody reads any more.
        gone: Arc<AtomicBool>,
        done: Receiver<()>,
        /// A recording does not wait for a reader; what is not recorded does.
        waits: bool,
        unseen: u64,
    },
    /// A terminal that went away.
    Gone,
}

/// For the thread that shows.
pub(crate) enum Shown {
    Lines(Vec<u8>),
    Note(String),
}

impl View {
    pub(crate) fn open(twin: &Twin, header: &str, is_recorded: bool) -> anyhow::Result<Self> {
        if cfg!(unix) && io::stdout().is_terminal() && io::stdin().is_terminal() {
            let screen = Box::new(Screen::open(twin).context("the terminal")?);
            return Ok(Self::Screen { screen, drawn: Instant::now() });
        }
        let (blocks, shown) = sync_channel(WAITING);
        let (finished, done) = channel();
        let gone = Arc::new(AtomicBool::new(false));
        let is_gone = gone.clone();
        let header = Shown::Lines(header.as_bytes().to_vec());
        thread::spawn(move || {
            let mut out = BufWriter::new(Output);
            for block in [header].into_iter().chain(shown) {
                match block {
                    Shown::Note(text) => warn(format!("stretch: {text}")),
                    Shown::Lines(_) if is_gone.load(SeqCst) => {}
                    // `Output` keeps the failure, and the end of the program reports it
                    Shown::Lines(lines) => {
                        if out.write_all(&lines).and_then(|()| out.flush()).is_err() {
                            is_gone.store(true, SeqCst);
                        }
                    }
                }
            }
            let _ = finished.send(());
        });
        Ok(Self::Lines { blocks, gone, done, waits: !is_recorded, unseen: 0 })
    }

    /// Whether nobody looks any more.
    pub(crate) fn is_gone(&self) -> bool {
        match self {
            Self::Screen { .. } => false,
            Self::Lines { gone, .. } => gone.load(SeqCst),
            Self::Gone => true,
        }
    }

    pub(crate) fn push(&mut self, samples: &[Sample]) {
        match self {
            Self::Screen { screen, .. } => samples.iter().for_each(|sample| screen.push(sample)),
            Self::Lines { blocks, waits, unseen, .. } if !samples.is_empty() => {
                let mut lines = Vec::with_capacity(64 * samples.len());
                samples.iter().for_each(|sample| sample.push_line(&mut lines));
                if *waits {
                    // the thread lives as long as this does
                    let _ = blocks.send(Shown::Lines(lines));
                } else if let Err(TrySendError::Full(_)) = blocks.try_send(Shown::Lines(lines)) {
                    *unseen += samples.len() as u64;
                }
            }
            Self::Lines { .. } | Self::Gone => {}
        }
    }

    pub(crate) fn note(&self, text: &str) {
        if let Self::Lines { blocks, .. } = self {
            // as with rows: nothing waits for a reader of standard error
            let _ = blocks.try_send(Shown::Note(text.to_owned()));
        }
    }

    pub(crate) fn draw(&mut self, status: &super::Status) {
        if let Self::Screen { screen, drawn } = self
            && drawn.elapsed() >= Duration::from_millis(50)
        {
            *drawn = Instant::now();
            if screen.draw(status).is_err() {
                *self = Self::Gone;
            }
        }
    }

    pub(crate) fn asked_to_stop(&mut self) -> bool {
        let Self::Screen { screen, .. } = self else { return false };
        match screen.asked_to_stop() {
            Ok(asked) => asked,
            Err(_) => {
                *self = Self::Gone;
                false
            }
        }
    }

    /// Waits until all is shown, after Ctrl-C not for long; gives how many samples were not.
    pub(crate) fn close(self) -> u64 {
        let Self::Lines { blocks, done, unseen, .. } = self else { return 0 };
        drop(blocks);
        let mut asked = None;
        while let Err(RecvTimeoutError::Timeout) = done.recv_timeout(Duration::from_millis(20)) {
            if stop::ended() && asked.get_or_insert_with(Instant::now).elapsed() > PATIENCE {
                break;
            }
        }
        unseen
    }
}

//! Ctrl-C: a live recording ends like a stream that ends; anything else stops at
//! once and leaves nothing half-written.

use std::{
    io::{self, Read},
    sync::{
        atomic::{AtomicBool, Ordering::SeqCst},
        mpsc::{Receiver, RecvTimeoutError, sync_channel},
    },
    time::Duration,
};

/// Pieces of standard input that may wait.
const WAITING: usize = 64;

static RECORDING: AtomicBool = AtomicBool::new(false);
static ENDED: AtomicBool = AtomicBool::new(false);

/// What the handler of Ctrl-C does; the second Ctrl-C stops a recording, too.
pub(crate) fn on_ctrl_c(exit_code: u8) {
    if RECORDING.load(SeqCst) && !ENDED.swap(true, SeqCst) {
        return;
    }
    stretch_data::files::clean_up_and_exit(exit_code)
}

/// From now on the first Ctrl-C only sets the flag of [`ended`].
pub(crate) fn record() {
    RECORDING.store(true, SeqCst);
}

/// Whether Ctrl-C ended the recording.
pub(crate) fn ended() -> bool {
    ENDED.load(SeqCst)
}

/// Standard input that ends at Ctrl-C, so that what has come is still written.
pub(crate) struct RecordedInput {
    pieces: Receiver<io::Result<Vec<u8>>>,
    piece: Vec<u8>,
    taken: usize,
}

impl RecordedInput {
    /// Reads standard input from now on.
    pub(crate) fn new() -> Self {
        RECORDING.store(true, SeqCst);
        let (sender, pieces) = sync_channel(WAITING);
        // Reading blocks; the thread ends with the stream or with the program.
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

//! The most recent frames.

use crate::{Answer, Frame};

/// A ring buffer of the most recent frames.
#[derive(Debug, Clone)]
pub(crate) struct Recent {
    frames: [Frame; Self::MOST],
    next: usize,
    known: usize,
}

impl Recent {
    /// Number of stored frames: as many frames of 24 bytes as fit in 4096 bytes, the block that a
    /// host reads at once. Only a frame in which all numbers have one digit is shorter than 24
    /// bytes (`$S1,0,0,0,,W,*00000000` and the newline).
    pub(crate) const MOST: usize = 4096 / 24;

    pub(crate) const fn new() -> Self {
        let none = Frame { counter: 0, time_ms: 0, code: 0, answer: Answer::Missing };
        Self { frames: [none; Self::MOST], next: 0, known: 0 }
    }

    pub(crate) fn push(&mut self, frame: Frame) {
        self.frames[self.next] = frame;
        self.next = (self.next + 1) % Self::MOST;
        self.known = (self.known + 1).min(Self::MOST);
    }

    pub(crate) fn has(&self, frame: &Frame) -> bool {
        self.frames[..self.known].contains(frame)
    }

    pub(crate) fn forget(&mut self) {
        (self.next, self.known) = (0, 0);
    }
}

//! From bytes to frames, whatever happened to the bytes.

use crate::{Frame, frame::Refused, recent::Recent};

/// What a byte completed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// A frame, each once, in the order of the counter.
    Frame(Frame),
    /// A frame after `lost` others that never came.
    AfterGap {
        /// How many.
        lost: u32,
        /// The frame.
        frame: Frame,
    },
    /// The first frame of a board that started again.
    Restarted(Frame),
    /// A frame that was already given; skipped.
    Repeated,
    /// A line that is no frame; skipped.
    Damaged,
    /// A sound frame of another version than [`Frame::VERSION`]; skipped.
    OtherVersion,
}

impl Event {
    /// The frame, if there is one.
    pub fn frame(self) -> Option<Frame> {
        match self {
            Self::Frame(frame) | Self::AfterGap { frame, .. } | Self::Restarted(frame) => {
                Some(frame)
            }
            _ => None,
        }
    }
}

/// What came and what did not.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Frames that were given.
    pub frames: u64,
    /// Frames missing from the counter's sequence, damaged ones among them.
    pub lost: u64,
    /// Lines, and pieces of lines, that are no frame.
    pub damaged: u64,
    /// Frames that came once more.
    pub repeated: u64,
    /// Times that the counter or the clock went back: the board started again.
    pub restarts: u64,
    /// Sound frames of another version.
    pub other_version: u64,
}

/// A streaming decoder.
///
/// A frame begins at a `$` and ends at a newline; a `$` inside a frame begins a new one. A counter
/// that steps ahead gives the number of lost frames. A frame that equals one of the last
/// [`REPLAYED`](Self::REPLAYED), to the last field, is a repetition, alone or in a block that came
/// twice. Any other step back of the counter or of the board's clock means that the board
/// restarted, and so does any step back to the counter 0.
#[derive(Debug, Clone)]
pub struct Decoder {
    line: [u8; Frame::LONGEST],
    length: usize,
    state: State,
    last: Option<Frame>,
    recent: Recent,
    counts: Counts,
}

/// A step of a wrapping number beyond it is a step back.
const HALF: u32 = u32::MAX / 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Between frames; nothing unknown was seen.
    Idle,
    /// Bytes that belong to no frame.
    Noise,
    /// Inside a frame.
    Frame,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// Number of stored frames: a block of so many that arrives again is skipped.
    pub const REPLAYED: usize = Recent::MOST;

    /// A decoder that has seen nothing.
    pub fn new() -> Self {
        Self {
            line: [0; Frame::LONGEST],
            length: 0,
            state: State::Idle,
            last: None,
            recent: Recent::new(),
            counts: Counts::default(),
        }
    }

    /// What came and what did not, so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Takes the next byte; says what it completed.
    pub fn push(&mut self, byte: u8) -> Option<Event> {
        match byte {
            b'$' => {
                let cut = self.abandon();
                self.state = State::Frame;
                cut
            }
            b'\n' if self.state == State::Frame => {
                self.state = State::Idle;
                let length = core::mem::take(&mut self.length);
                Some(self.line(length))
            }
            b'\n' => self.abandon(),
            // what some terminals add to a newline
            b'\r' => None,
            _ if self.state == State::Frame && self.length < self.line.len() => {
                self.line[self.length] = byte;
                self.length += 1;
                None
            }
            _ => {
                // one line of noise counts once, when it ends
                self.state = State::Noise;
                self.length = 0;
                None
            }
        }
    }

    /// The stream ended or broke off (a cable was pulled), so no byte completes the current frame.
    ///
    /// A frame that lacks only its newline is complete, because the checksum is its last field.
    pub fn disconnected(&mut self) -> Option<Event> {
        if self.state == State::Frame
            && matches!(
                Frame::decode(&self.line[..self.length]),
                Ok(_) | Err(Refused::OtherVersion)
            )
        {
            return self.push(b'\n');
        }
        self.abandon()
    }

    fn abandon(&mut self) -> Option<Event> {
        let begun = self.state != State::Idle;
        self.state = State::Idle;
        self.length = 0;
        begun.then(|| {
            self.counts.damaged += 1;
            Event::Damaged
        })
    }

    fn line(&mut self, length: usize) -> Event {
        match Frame::decode(&self.line[..length]) {
            Ok(frame) => self.place(frame),
            Err(Refused::Damaged) => {
                self.counts.damaged += 1;
                Event::Damaged
            }
            Err(Refused::OtherVersion) => {
                self.counts.other_version += 1;
                Event::OtherVersion
            }
        }
    }

    /// The position of a sound frame in the sequence.
    fn place(&mut self, frame: Frame) -> Event {
        let event = match self.last {
            None => Event::Frame(frame),
            Some(last) => {
                let ahead = frame.counter.wrapping_sub(last.counter);
                let later = frame.time_ms.wrapping_sub(last.time_ms);
                if later > HALF || !(1..=HALF).contains(&ahead) {
                    if last == frame || (frame.counter != 0 && self.recent.has(&frame)) {
                        self.counts.repeated += 1;
                        return Event::Repeated;
                    }
                    self.counts.restarts += 1;
                    self.recent.forget();
                    Event::Restarted(frame)
                } else if ahead == 1 {
                    Event::Frame(frame)
                } else {
                    let lost = ahead - 1;
                    self.counts.lost += u64::from(lost);
                    Event::AfterGap { lost, frame }
                }
            }
        };
        self.recent.push(frame);
        self.counts.frames += 1;
        self.last = Some(frame);
        event
    }
}

//! Decodes frames from a byte stream that may be damaged.

use crate::{Answer, Frame, frame::Refused};

/// The result of a byte that completes a line or ends it early.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// The next frame in the order of the counter. Each frame is given once.
    Frame(Frame),
    /// A frame after `lost` frames that did not arrive.
    AfterGap {
        /// Number of lost frames.
        lost: u32,
        /// The frame.
        frame: Frame,
    },
    /// The first frame of a board that restarted.
    Restarted(Frame),
    /// A frame that was already given; skipped.
    Repeated,
    /// A line that is not a frame; skipped.
    Damaged,
    /// A valid frame of another version than [`Frame::VERSION`]; skipped.
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

/// Counts of received, lost and skipped frames.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Frames that were decoded and returned.
    pub frames: u64,
    /// Frames missing from the counter's sequence, including damaged frames.
    pub lost: u64,
    /// Lines, and parts of lines, that are not frames.
    pub damaged: u64,
    /// Frames that arrived again.
    pub repeated: u64,
    /// Restarts of the board: the counter or the clock went back.
    pub restarts: u64,
    /// Valid frames of another version.
    pub other_version: u64,
}

/// A decoder that takes the bytes of a stream one at a time.
///
/// A frame begins at a `$` and ends at a newline; a `$` inside a frame begins a new one. If the
/// counter increases by more than one, the frames in between are lost. A frame whose fields all
/// equal those of one of the last [`REPLAYED`](Self::REPLAYED) frames is a repetition, whether it
/// arrives alone or in a block that was received twice. In any other case, a counter that stays the
/// same or goes back, or a clock that goes back, means that the board restarted. A step back to the
/// counter 0 is a restart unless the frame equals the last one.
#[derive(Debug, Clone)]
pub struct Decoder {
    line: [u8; Frame::LONGEST],
    length: usize,
    state: State,
    last: Option<Frame>,
    recent: Recent,
    counts: Counts,
}

/// The difference of two wrapping numbers from which on the second number counts as earlier than
/// the first.
const HALF: u32 = u32::MAX / 2;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// Between frames; no byte has come since the last line end.
    Idle,
    /// Inside bytes that belong to no frame.
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
    /// Number of stored frames. A block of up to this many frames that arrives again is skipped.
    pub const REPLAYED: usize = Recent::MOST;

    /// Creates a decoder that has received no bytes.
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

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Processes the next byte. Returns the event that it completes.
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
            // ignored, because some terminals add it to a newline
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

    /// Ends the current line, for example after a cable was pulled. Later bytes do not complete the current frame.
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

    /// Classifies a valid frame by its position in the sequence, and counts it.
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

/// A ring buffer of the most recent frames.
#[derive(Debug, Clone)]
struct Recent {
    frames: [Frame; Self::MOST],
    next: usize,
    known: usize,
}

impl Recent {
    /// Number of stored frames: as many frames of 24 bytes as fit in 4096 bytes, the block that a
    /// host reads at once. Only a frame in which all numbers have one digit is shorter than 24
    /// bytes (`$S1,0,0,0,,W,*00000000` and the newline).
    const MOST: usize = 4096 / 24;

    const fn new() -> Self {
        let none = Frame { counter: 0, time_ms: 0, code: 0, answer: Answer::Missing };
        Self { frames: [none; Self::MOST], next: 0, known: 0 }
    }

    fn push(&mut self, frame: Frame) {
        self.frames[self.next] = frame;
        self.next = (self.next + 1) % Self::MOST;
        self.known = (self.known + 1).min(Self::MOST);
    }

    fn has(&self, frame: &Frame) -> bool {
        self.frames[..self.known].contains(frame)
    }

    fn forget(&mut self) {
        (self.next, self.known) = (0, 0);
    }
}

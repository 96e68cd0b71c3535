//! One time line over restarts of a board and the wrap of its clock.

use crate::{Event, Frame};

/// The time line of frames: seconds since the first frame, always rising.
///
/// A frame's time is that of the frame before it plus the step of the board's clock, which wraps at 2^32 ms. A board that started again counts anew:
/// then the time that passed at the receiver, and at least one sample period, stands in for the step. Times are rounded to 1 us.
///
/// ```
/// use stretch_link::{Answer, Event, Frame, TimeLine};
/// let frame = |time_ms| Frame { counter: 0, time_ms, code: 0, answer: Answer::Warming };
/// let mut line = TimeLine::new(0.01);
/// assert_eq!(line.time_s(&Event::Frame(frame(u32::MAX - 4)), 7.0), Some(0.0));
/// assert_eq!(line.time_s(&Event::Frame(frame(5)), 7.01), Some(0.01));
/// assert_eq!(line.time_s(&Event::Restarted(frame(0)), 9.01), Some(2.01));
/// assert_eq!(line.time_s(&Event::Damaged, 9.02), None);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TimeLine {
    period_s: f64,
    last: Option<Last>,
}

/// The last frame that came.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    board_ms: u32,
    time_s: f64,
    heard_s: f64,
}

impl TimeLine {
    /// A time line of samples that are at least `period_s` apart where the board starts again, s.
    pub fn new(period_s: f64) -> Self {
        Self { period_s, last: None }
    }

    /// Seconds from the first frame to that of `event`, which was heard at `now_s` of the receiver's clock, s; none for an event without a frame.
    pub fn time_s(&mut self, event: &Event, now_s: f64) -> Option<f64> {
        let Frame { time_ms: board_ms, .. } = event.frame()?;
        let time_s = match self.last {
            None => 0.0,
            Some(last) if matches!(event, Event::Restarted(_)) => {
                last.time_s + (now_s - last.heard_s).max(self.period_s)
            }
            Some(last) => {
                let step_ms = board_ms.wrapping_sub(last.board_ms);
                // two frames within a millisecond of the board's clock
                last.time_s + if step_ms > 0 { f64::from(step_ms) / 1e3 } else { 1e-6 }
            }
        };
        // sums of steps carry rounding errors
        let time_s = libm::round(time_s * 1e6) / 1e6;
        self.last = Some(Last { board_ms, time_s, heard_s: now_s });
        Some(time_s)
    }
}

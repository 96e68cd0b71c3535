//! One continuous time line across restarts of a board and wraps of its clock.

use crate::{Event, Frame};

/// The time line of frames: seconds since the first frame, always rising.
///
/// A frame's time is the time of the previous frame plus the step of the board's clock, which wraps
/// at 2^32 ms. A board that restarts begins its clock at zero; the step is then the time that
/// passed at the receiver, and at least one sample period. Times are rounded to 1 us.
///
/// If the sample period is two milliseconds or more, two frames with the same millisecond mean that the board's clock
/// has stopped. The second frame then gets no time, because any time would be invented. Faster samples can share a
/// millisecond. Their times are 1 us apart, which keeps their order. The time of the next millisecond is counted from
/// the first of them, so the time line does not run fast. After 1,000 frames with the same millisecond the clock counts
/// as stopped.
///
/// ```
/// use stretch_link::{Answer, Event, Frame, TimeLine};
/// let frame = |time_ms| Frame { counter: 0, time_ms, code: 0, answer: Answer::Warming };
/// let mut line = TimeLine::new(0.01);
/// assert_eq!(line.time_s(&Event::Frame(frame(u32::MAX - 4)), 7.0), Some(0.0));
/// assert_eq!(line.time_s(&Event::Frame(frame(5)), 7.01), Some(0.01));
/// assert_eq!(line.time_s(&Event::Restarted(frame(0)), 9.01), Some(2.01));
/// assert_eq!(line.time_s(&Event::Damaged, 9.02), None);
/// assert_eq!(line.time_s(&Event::Frame(frame(0)), 9.02), None);
/// assert_eq!(line.time_s(&Event::Frame(frame(10)), 9.03), Some(2.02));
///
/// let mut fast = TimeLine::new(0.0005);
/// let times_s = [0, 0, 1, 1, 2].map(|ms| fast.time_s(&Event::Frame(frame(ms)), 0.0));
/// assert_eq!(times_s, [0.0, 1e-6, 1e-3, 1.001e-3, 2e-3].map(Some));
/// let stopped = (0..1000).map(|_| fast.time_s(&Event::Frame(frame(2)), 0.0));
/// assert_eq!(stopped.filter(Option::is_some).count(), 999);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TimeLine {
    period_s: f64,
    last: Option<Last>,
}

/// The last frame to which a time was given.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Last {
    board_ms: u32,
    /// Time of the first frame with this millisecond.
    began_s: f64,
    time_s: f64,
    heard_s: f64,
}

/// Smallest sample period, s, at which two samples never have the same millisecond, even if the board's clock jitters.
const APART_S: f64 = 2e-3;

impl TimeLine {
    /// Creates a time line for samples that are `period_s` seconds apart. When the board restarts,
    /// the time advances by at least this period.
    pub fn new(period_s: f64) -> Self {
        Self { period_s, last: None }
    }

    /// Returns the seconds from the first frame to the frame of `event`. `now_s` is the time of
    /// arrival on the receiver's clock, s. Returns `None` for an event without a frame, and if the
    /// board's clock has stopped.
    pub fn time_s(&mut self, event: &Event, now_s: f64) -> Option<f64> {
        let Frame { time_ms: board_ms, .. } = event.frame()?;
        // removes the rounding errors of a sum of steps
        let rounded = |time_s: f64| libm::round(time_s * 1e6) / 1e6;
        let mut began_s = None;
        let time_s = match self.last {
            None => 0.0,
            Some(last) if matches!(event, Event::Restarted(_)) => {
                rounded(last.time_s + (now_s - last.heard_s).max(self.period_s))
            }
            Some(last) => match board_ms.wrapping_sub(last.board_ms) {
                0 => {
                    let next_s = rounded(last.time_s + 1e-6);
                    if self.period_s >= APART_S || next_s >= rounded(last.began_s + 1e-3) {
                        return None;
                    }
                    began_s = Some(last.began_s);
                    next_s
                }
                step_ms => rounded(last.began_s + f64::from(step_ms) / 1e3),
            },
        };
        let began_s = began_s.unwrap_or(time_s);
        self.last = Some(Last { board_ms, began_s, time_s, heard_s: now_s });
        Some(time_s)
    }
}

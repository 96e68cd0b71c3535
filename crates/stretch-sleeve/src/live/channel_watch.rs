//! Statistics of one of several channels, sample by sample.

use stretch_core::Real;

/// Number of values from which a [`Jump`] is computed. One value is taken at each tick, about every
/// 10 ms.
pub const JUMP_SAMPLES: u8 = 8;
const HALF: usize = JUMP_SAMPLES as usize / 2;

/// Returns the number of samples between two ticks of a [`Jump`]: about 10 ms, and at least one
/// sample.
///
/// ```
/// use stretch_sleeve::samples_a_tick;
/// assert_eq!((samples_a_tick(50.0), samples_a_tick(100.0), samples_a_tick(1000.0)), (1, 1, 10));
/// ```
pub fn samples_a_tick(sample_rate_hz: f64) -> u16 {
    (sample_rate_hz / 100.0 + 0.5).clamp(1.0, f64::from(u16::MAX)) as u16
}

/// Count of recent repetitions of one value. A repetition adds one, and a different value subtracts one. If the count
/// is one, a different value becomes the new value (the majority vote of Boyer and Moore 1991).
///
/// A signal at the end of the converter's range changes for a single sample now and then. A count of consecutive
/// repetitions would restart each time.
///
/// ```
/// use stretch_sleeve::Repeats;
/// let mut repeats = Repeats::new();
/// let counts = [1.2, 5.0, 5.0, 4.9, 5.0, 5.0].map(|x| repeats.step(x, true));
/// assert_eq!(counts, [1, 1, 2, 1, 2, 3]);
/// // a repetition while nothing else changes says nothing
/// assert_eq!(repeats.step(5.0, false), 3);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repeats<T> {
    held: T,
    count: u16,
}

impl<T: Real> Repeats<T> {
    /// Creates a count without a value.
    pub fn new() -> Self {
        Self { held: T::nan(), count: 0 }
    }

    /// Takes a sample, and returns the count; it is 1 if the value is new. A repetition counts only if `others_change`,
    /// that is, if any channel changed.
    #[inline(always)]
    pub fn step(&mut self, sample: T, others_change: bool) -> u16 {
        if sample == self.held {
            if others_change {
                self.count = self.count.saturating_add(1);
            }
        } else if self.count > 1 {
            self.count -= 1;
        } else {
            self.held = sample;
            self.count = 1;
        }
        self.count
    }
}

impl<T: Real> Default for Repeats<T> {
    fn default() -> Self {
        Self::new()
    }
}

/// Detector of a lasting jump of a signal. The jump is the signed distance between the range of the
/// last four values and the range of the four values before them, or zero if the ranges overlap.
///
/// An outlier does not separate the ranges. A ramp separates them only by its rise in one tick.
///
/// ```
/// use stretch_sleeve::Jump;
/// let mut jump = Jump::new();
/// let last = |jump: &mut Jump<f64>, x: [f64; 8]| x.map(|x| jump.step(x))[7];
/// assert_eq!(last(&mut jump, [0.0, 0.1, 0.0, 0.1, 1.0, 1.1, 1.0, 1.1]), 1.0 - 0.1);
/// assert_eq!(last(&mut jump, [0.0, 0.1, 0.0, 0.1, 9.0, 0.1, 0.0, 0.1]), 0.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jump<T> {
    values: [T; JUMP_SAMPLES as usize],
}

impl<T: Real> Jump<T> {
    /// Creates a detector whose previous values are all zero.
    pub fn new() -> Self {
        Self { values: [T::zero(); JUMP_SAMPLES as usize] }
    }

    /// Takes a value, and returns the jump in the last eight values.
    #[inline(always)]
    pub fn step(&mut self, value: T) -> T {
        for i in 1..self.values.len() {
            self.values[i - 1] = self.values[i];
        }
        self.values[2 * HALF - 1] = value;
        let ends = |values: &[T]| {
            let (mut least, mut most) = (values[0], values[0]);
            for value in values {
                least = least.min(*value);
                most = most.max(*value);
            }
            (least, most)
        };
        let (before, after) = self.values.split_at(HALF);
        let ((least, most), (least_after, most_after)) = (ends(before), ends(after));
        let (up, down) = (least_after - most, most_after - least);
        if up > T::zero() {
            up
        } else if down < T::zero() {
            down
        } else {
            T::zero()
        }
    }
}

impl<T: Real> Default for Jump<T> {
    fn default() -> Self {
        Self::new()
    }
}

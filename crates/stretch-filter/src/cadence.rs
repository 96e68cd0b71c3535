//! Checks of the time stamps of a live stream.

use crate::sample;
use stretch_core::{Design, DesignError, SampleRate, Seconds, Stage};

/// Classifies the time stamps of a live stream by its sample rate.
///
/// Every estimator of this crate assumes one sample per period. Step the cadence with each time
/// stamp, and reset an estimator of this crate after an [`Arrival::Gap`] or an
/// [`Arrival::Backwards`]. A receptor of `stretch-receptor` bridges a short gap itself: give it as
/// many missing samples as the gap has, and reset it only after an [`Arrival::Backwards`].
///
/// Missing samples are counted on a grid of periods and not by single intervals. A late sample that is followed by an
/// early one therefore causes no gap. The grid passes through the earliest stamps. A sample is missing only if a stamp
/// is later than the grid by 0.9 periods or more, so jitter of up to 0.45 periods to both sides causes no gap. The grid
/// moves by up to a hundredth of a period per sample, so a clock that is slower by up to 1 % causes no gap either.
///
/// ```
/// use stretch_core::{Runner, SampleRate, Seconds};
/// use stretch_filter::{Cadence, Arrival};
///
/// let rate = SampleRate::new(100.0).unwrap();
/// let mut cadence = Runner::new(Cadence::new(rate, 0.2).unwrap());
/// assert_eq!(cadence.step(Seconds(0.00)), Arrival::First);
/// assert_eq!(cadence.step(Seconds(0.01)), Arrival::OnTime);
/// assert!(matches!(cadence.step(Seconds(0.028)), Arrival::Jitter { .. })); // late
/// assert!(matches!(cadence.step(Seconds(0.030)), Arrival::Jitter { .. })); // early
/// assert_eq!(cadence.step(Seconds(0.060)), Arrival::Gap { missing: 2 });
/// assert!(matches!(cadence.step(Seconds(0.060)), Arrival::Backwards { .. }));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cadence {
    sample_rate: SampleRate,
    tolerance: f64,
}

/// State of a [`Cadence`]: the last finite time stamp, and its place on the grid.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CadenceMemory {
    last_s: Option<f64>,
    /// The grid point of the last sample: its stamp would have this value if it were as early as the earliest stamps.
    due_s: f64,
}

/// Lateness against the grid, in periods, from which on a sample is missing.
const LATEST: f64 = 0.9;

/// Largest movement of the grid to a later time, in periods per sample.
const DRIFT: f64 = 0.01;

/// Relation of a time stamp to the one before it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Arrival {
    /// The first time stamp.
    First,
    /// The stamp is one period later, within the tolerance.
    OnTime,
    /// The stamp is early or late by more than the tolerance, but no sample is missing.
    Jitter {
        /// Lateness in seconds; negative if early.
        late_s: f64,
    },
    /// Samples are missing between the stamp and the one before it, counted on the grid.
    Gap {
        /// Number of missing samples, saturating.
        missing: u32,
    },
    /// The stamp repeats the one before it or is earlier.
    Backwards {
        /// Step back in seconds; zero for a repeated stamp.
        by_s: f64,
    },
    /// The stamp is NaN or infinite. It is ignored.
    NotFinite,
}

impl Cadence {
    /// Creates a cadence. An interval is on time if it deviates from one period by at most
    /// `tolerance` periods, from 0 to 0.5.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `tolerance` or `sample_rate_hz`.
    pub fn new(sample_rate: SampleRate, tolerance: f64) -> Result<Self, DesignError> {
        let sample_rate = sample::checked_rate(sample_rate)?;
        DesignError::check("tolerance", tolerance, (0.0..=0.5).contains(&tolerance))?;
        Ok(Self { sample_rate, tolerance })
    }

    /// Returns the expected sample rate.
    pub fn sample_rate(&self) -> SampleRate {
        self.sample_rate
    }
}

impl Design for Cadence {
    type Memory = CadenceMemory;

    fn memory(&self) -> CadenceMemory {
        CadenceMemory::default()
    }
}

impl Stage<Seconds> for Cadence {
    type Out = Arrival;

    fn step(&self, memory: &mut CadenceMemory, time: Seconds) -> Arrival {
        let Seconds(time_s) = time;
        if !time_s.is_finite() {
            return Arrival::NotFinite;
        }
        let Some(last_s) = memory.last_s.replace(time_s) else {
            memory.due_s = time_s;
            return Arrival::First;
        };
        let (elapsed_s, period_s) = (time_s - last_s, self.sample_rate.period_s());
        if elapsed_s <= 0.0 {
            memory.due_s = time_s;
            return Arrival::Backwards { by_s: -elapsed_s };
        }
        // A saturating cast, which rounds down.
        let late = (time_s - memory.due_s) * self.sample_rate.hz() - 1.0;
        let missing = (late + (1.0 - LATEST)) as u32;
        memory.due_s += (1.0 + f64::from(missing) + DRIFT) * period_s;
        // The grid starts again at a sample that is earlier than its grid point, and if more samples are missing than
        // can be counted.
        if memory.due_s > time_s || missing == u32::MAX {
            memory.due_s = time_s;
        }
        if missing > 0 {
            Arrival::Gap { missing }
        } else if (elapsed_s * self.sample_rate.hz() - 1.0).abs() <= self.tolerance {
            Arrival::OnTime
        } else {
            Arrival::Jitter { late_s: elapsed_s - period_s }
        }
    }
}

//! Whether the samples of a live stream come when they should.

use crate::sample;
use stretch_core::{Design, DesignError, SampleRate, Seconds, Stage};

/// Judges the time stamps of a live stream against its sample rate.
///
/// Every estimator of this crate assumes one sample a period. Step the cadence
/// with each time stamp and start the estimator afresh after an
/// [`Arrival::Gap`] or an [`Arrival::Backwards`].
///
/// ```
/// use stretch_core::{Runner, SampleRate, Seconds};
/// use stretch_filter::{Cadence, Arrival};
///
/// let rate = SampleRate::new(100.0).unwrap();
/// let mut cadence = Runner::new(Cadence::new(rate, 0.2).unwrap());
/// assert_eq!(cadence.step(Seconds(0.00)), Arrival::First);
/// assert_eq!(cadence.step(Seconds(0.01)), Arrival::OnTime);
/// assert!(matches!(cadence.step(Seconds(0.024)), Arrival::Jitter { .. }));
/// assert_eq!(cadence.step(Seconds(0.054)), Arrival::Gap { missing: 2 });
/// assert!(matches!(cadence.step(Seconds(0.054)), Arrival::Backwards { .. }));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cadence {
    sample_rate: SampleRate,
    tolerance: f64,
}

/// What a [`Cadence`] remembers: the last finite time stamp.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CadenceMemory {
    last_s: Option<f64>,
}

/// How one time stamp follows the one before it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Arrival {
    /// The first stamp: there is nothing to compare it with.
    First,
    /// One period later, within the tolerance.
    OnTime,
    /// One sample, early or late by more than the tolerance, none missing.
    Jitter {
        /// How late, in seconds; negative when early.
        late_s: f64,
    },
    /// Samples are missing: the interval is nearest to `missing + 1` periods.
    Gap {
        /// How many are missing, saturating.
        missing: u32,
    },
    /// The stamp repeats the one before it or is earlier.
    Backwards {
        /// How far back, in seconds; zero for a repeated stamp.
        by_s: f64,
    },
    /// The stamp is NaN or infinite; it was not remembered.
    NotFinite,
}

impl Arrival {
    /// Whether an estimator may go on: one period has passed, on time or not.
    pub fn is_continuous(self) -> bool {
        matches!(self, Self::First | Self::OnTime | Self::Jitter { .. })
    }
}

impl Cadence {
    /// A cadence that calls an interval on time when it is off by no more than
    /// `tolerance` periods, from 0 to 0.5.
    ///
    /// # Errors
    /// [`DesignError::OutOfRange`] naming `tolerance` or `sample_rate_hz`.
    pub fn new(sample_rate: SampleRate, tolerance: f64) -> Result<Self, DesignError> {
        let sample_rate = sample::checked_rate(sample_rate)?;
        DesignError::check("tolerance", tolerance, (0.0..=0.5).contains(&tolerance))?;
        Ok(Self { sample_rate, tolerance })
    }

    /// The sample rate that is expected.
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
        let Some(last_s) = memory.last_s.replace(time_s) else { return Arrival::First };
        let elapsed_s = time_s - last_s;
        if elapsed_s <= 0.0 {
            return Arrival::Backwards { by_s: -elapsed_s };
        }
        let periods = elapsed_s * self.sample_rate.hz();
        if periods >= 1.5 {
            // A saturating cast; adding a half rounds to the nearest count.
            return Arrival::Gap { missing: (periods + 0.5) as u32 - 1 };
        }
        if (periods - 1.0).abs() <= self.tolerance {
            Arrival::OnTime
        } else {
            Arrival::Jitter { late_s: elapsed_s - self.sample_rate.period_s() }
        }
    }
}

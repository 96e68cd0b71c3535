//! Checks of the time stamps of a live stream.

use crate::sample;
use stretch_core::{Design, DesignError, SampleRate, Seconds, Stage};

/// Classifies the time stamps of a live stream by its sample rate.
///
/// Every estimator of this crate assumes one sample per period. Step the cadence with each time
/// stamp and reset the estimator after an [`Arrival::Gap`] or an [`Arrival::Backwards`].
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

/// State of a [`Cadence`]: the last finite time stamp.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct CadenceMemory {
    last_s: Option<f64>,
}

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
    /// Samples are missing: the interval is nearest to `missing + 1` periods.
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

//! The live rate estimator that a calibration file specifies.

use crate::{
    Cost, Differentiator, DifferentiatorMemory, FilterError, LowPassSpec, NamedRate, SgFilter,
    SgMemory, SgShape, Tracker, TrackerMemory, TrackerSpec,
};
use stretch_core::{Design, Hertz, RateEstimator, Real, SampleRate, Stage};

/// A live rate estimator that is chosen at run time by a [`RateEstimator`], with room for a
/// Savitzky-Golay window of `CAP` samples.
///
/// A step gives the rate in the sample's unit per second, or `None` while the estimator warms up. A
/// sample that is NaN or beyond `LARGEST_SAMPLE` also gives `None` and leaves the memory unchanged.
///
/// ```
/// use stretch_core::{RateEstimator, Runner, SampleRate};
/// use stretch_filter::{FilterError, RateFilter};
///
/// let hz = SampleRate::new(100.0).unwrap();
/// let design = RateFilter::<f64>::new(RateEstimator::SAVGOL_11_2, hz).unwrap();
/// let mut rate = Runner::new(design);
/// let out = (0..11).filter_map(|n| rate.step(0.5 * n as f64)).last().unwrap();
/// approx::assert_abs_diff_eq!(out, 50.0, epsilon = 1e-10);
///
/// // The paper's central difference needs the sample after: not live.
/// let refused = RateFilter::<f64>::new(RateEstimator::CentralDifference, hz);
/// assert_eq!(refused, Err(FilterError::LooksAhead { samples: 1 }));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateFilter<T, const CAP: usize = 64> {
    kind: Kind<T, CAP>,
    estimator: RateEstimator,
    sample_rate: SampleRate,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator to put the taps elsewhere")]
enum Kind<T, const CAP: usize> {
    SavitzkyGolay(SgFilter<T, CAP>),
    Differentiator(Differentiator<T>),
    Tracker(Tracker<T>),
}

/// State of a [`RateFilter`].
///
/// If a step is called with the memory of another kind of estimator, it replaces the memory by a fresh one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateMemory<T, const CAP: usize = 64>(Inner<T, CAP>);

#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(clippy::large_enum_variant, reason = "there is no allocator to put the state elsewhere")]
enum Inner<T, const CAP: usize> {
    SavitzkyGolay(SgMemory<T, CAP>),
    Differentiator(DifferentiatorMemory<T>),
    Tracker(TrackerMemory<T>),
}

impl<T, const CAP: usize> RateMemory<T, CAP> {
    /// Returns the number of further samples that give `None` before the estimator has warmed up.
    pub fn remaining(&self) -> usize {
        match &self.0 {
            Inner::SavitzkyGolay(memory) => memory.remaining(),
            Inner::Differentiator(memory) => memory.remaining(),
            Inner::Tracker(memory) => memory.remaining(),
        }
    }
}

impl<T: Real, const CAP: usize> RateFilter<T, CAP> {
    /// Creates the estimator for samples at `sample_rate`.
    ///
    /// # Errors
    /// [`FilterError::LooksAhead`] for an estimator that only works on a log;
    /// [`FilterError::Design`], naming the field, for invalid parameters or a window above `CAP`.
    pub fn new(estimator: RateEstimator, sample_rate: SampleRate) -> Result<Self, FilterError> {
        let estimator = estimator.validate()?;
        let kind = match estimator {
            RateEstimator::SavitzkyGolay { window, degree, delay } => {
                let shape = SgShape {
                    window: window.into(),
                    degree: degree.into(),
                    order: 1,
                    delay: delay.into(),
                };
                Kind::SavitzkyGolay(SgFilter::new(shape, sample_rate)?)
            }
            RateEstimator::Differentiator { cutoff_hz } => {
                let spec = LowPassSpec { cutoff: Hertz(cutoff_hz), sample_rate };
                Kind::Differentiator(Differentiator::new(spec)?)
            }
            RateEstimator::Tracker { tracking_index } => {
                Kind::Tracker(Tracker::new(TrackerSpec { tracking_index, sample_rate })?)
            }
            // This refuses the central difference, and estimators that a later version may add.
            _ => return Err(FilterError::LooksAhead { samples: 1 }),
        };
        Ok(Self { kind, estimator, sample_rate })
    }

    /// Returns the parameters from which the design was built.
    pub fn estimator(&self) -> RateEstimator {
        self.estimator
    }

    /// Returns the number of samples that give `None` at the start.
    pub fn warm_up(&self) -> usize {
        self.memory().remaining()
    }

    /// Returns the delay of the rate for slow signals, in seconds.
    pub fn delay_s(&self) -> f64 {
        match &self.kind {
            Kind::SavitzkyGolay(design) => design.delay_s(),
            Kind::Differentiator(design) => design.delay_s(),
            Kind::Tracker(design) => design.delay_s(),
        }
    }

    /// Returns the standard deviation of the rate for white noise of standard deviation 1, in 1/s.
    pub fn noise_gain(&self) -> f64 {
        match &self.kind {
            Kind::SavitzkyGolay(design) => design.noise_gain(),
            Kind::Differentiator(design) => design.noise_gain(),
            Kind::Tracker(design) => design.noise_gain(),
        }
    }

    /// Returns the arithmetic and memory of one step.
    pub fn cost(&self) -> Cost {
        match &self.kind {
            Kind::SavitzkyGolay(design) => design.cost(),
            Kind::Differentiator(_) => Differentiator::<T>::COST,
            Kind::Tracker(_) => Tracker::<T>::COST,
        }
    }
}

impl<T: Real, const CAP: usize> Design for RateFilter<T, CAP> {
    type Memory = RateMemory<T, CAP>;

    fn memory(&self) -> RateMemory<T, CAP> {
        RateMemory(match &self.kind {
            Kind::SavitzkyGolay(design) => Inner::SavitzkyGolay(design.memory()),
            Kind::Differentiator(design) => Inner::Differentiator(design.memory()),
            Kind::Tracker(design) => Inner::Tracker(design.memory()),
        })
    }
}

impl<T: Real, const CAP: usize> NamedRate for RateFilter<T, CAP> {
    fn named(&self) -> Option<(RateEstimator, SampleRate)> {
        Some((self.estimator, self.sample_rate))
    }
}

impl<T: Real, const CAP: usize> Stage<T> for RateFilter<T, CAP> {
    type Out = Option<T>;

    #[inline]
    fn step(&self, memory: &mut RateMemory<T, CAP>, x: T) -> Option<T> {
        match (&self.kind, &mut memory.0) {
            (Kind::SavitzkyGolay(design), Inner::SavitzkyGolay(memory)) => design.step(memory, x),
            (Kind::Differentiator(design), Inner::Differentiator(memory)) => design.step(memory, x),
            (Kind::Tracker(design), Inner::Tracker(memory)) => {
                design.step(memory, x).map(|track| track.rate)
            }
            _ => {
                *memory = self.memory();
                self.step(memory, x)
            }
        }
    }
}

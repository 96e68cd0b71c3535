//! The live form of lines and surfaces: a signal in, a reading out, one sample at a time.

use stretch_core::{Branch, Calibration, Design, Real, Stage};
use stretch_filter::{NamedRate, RateFilter};

use crate::{
    Front, Reading, ReceptorError,
    fold::{check_rate, estimator},
    front::{Direction, Live, over_volts},
    map::{Map, Point},
};

/// A stretch receptor: a line or two surfaces, folded, with the rate estimator for which they were fitted.
///
/// For each sample, in volts (or the unit of the calibration's signal):
/// 1. the estimator `R` gives the rate of the signal;
/// 2. outside the dead band, the sign of that rate gives the branch;
/// 3. inputs outside the calibrated domain are clamped, and [`Reading::domain`] shows this;
/// 4. the branch's surface gives the estimate in the reference's unit. The slope of the surface times the rate of the
///    signal gives the estimate's rate. This derivative leaves out the surface's dependence on the rate, which would
///    need the second derivative of a noisy signal.
///
/// **Warm-up**: a calibration that [needs the signal only](stretch_core::Model::needs_signal_only) (a line, or one
/// curve for both branches) answers from the first sample on. The rate of such a reading is 0 until the rate estimator
/// has seen enough samples.
///
/// **Missing samples and the branch** are handled as in every [`Front`]. A short gap is bridged: the last sample is
/// extrapolated at the last rate. Therefore one lost sample costs one reading and not a warm-up.
///
/// **Reset**: start from a fresh [`Design::memory`]; the `reset` of a [`Runner`](stretch_core::Runner) does this.
///
/// ```
/// use stretch_core::{Runner, Volts, Design};
/// use stretch_receptor::{StretchReceptor, Withheld};
/// # let calibration = stretch_receptor::example_calibration();
///
/// let mut receptor = Runner::new(StretchReceptor::<f32>::new(&calibration)?);
/// let mut length_mm = f32::NAN;
/// for n in 0..100 {
///     let bridge_v = 1.3 + 0.004 * n as f32; // the muscle fills
///     match receptor.step(Volts(bridge_v)) {
///         Ok(reading) => length_mm = reading.length().0,
///         Err(withheld) => assert!(n < 10 && withheld == Withheld::Warming),
///     }
/// }
/// assert!(length_mm > 158.0 && length_mm < 161.0);
/// # Ok::<(), stretch_receptor::ReceptorError>(())
/// ```
///
/// Source: sections 2.5 and 3.4 of the paper with the published method. Cost: see the crate's front page.
pub type StretchReceptor<T, R = RateFilter<T>> = Front<Surfaces<T, R>>;

/// The model of a [`StretchReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfaces<T, R> {
    rate: R,
    map: Map<T>,
    direction: Direction<T>,
    period_s: T,
    needs_signal_only: bool,
}

impl<T: Real, R> Surfaces<T, R> {
    /// The folded line or surfaces.
    pub fn map(&self) -> &Map<T> {
        &self.map
    }

    /// The rule by which the rate chooses the branch.
    pub fn direction(&self) -> Direction<T> {
        self.direction
    }

    /// Seconds from a sample to the next.
    pub fn period_s(&self) -> T {
        self.period_s
    }
}

/// The state of a [`StretchReceptor`]'s model: the estimator's memory and the last sample with its rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacesMemory<T, M> {
    rate: M,
    last: T,
    last_rate: T,
}

impl<T: Real> StretchReceptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// The estimator's shape is a run-time value here. If the compiler knows the shape, [`with_rate`](Self::with_rate)
    /// takes an [`SgRate`](stretch_filter::SgRate) and is smaller and faster.
    ///
    /// # Errors
    /// [`ReceptorError`] when the estimator cannot run live or cannot be designed,
    /// the calibration is of another model, or a coefficient leaves the range of `T`.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        Self::with_rate(calibration, estimator(calibration)?)
    }
}

impl<T: Real, R> StretchReceptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator built for it.
    ///
    /// `rate` must be the estimator that [`CalibrationSpec::rate_estimator`]
    /// names, designed for the calibration's sample rate: a surface is valid only with the estimator of its fit.
    ///
    /// [`CalibrationSpec::rate_estimator`]: stretch_core::CalibrationSpec::rate_estimator
    ///
    /// # Errors
    /// [`ReceptorError::Rate`] for another estimator or sample rate (an `R` whose [`NamedRate::named`]
    /// is `None`, such as `()`, is not compared), or [`ReceptorError`] when the calibration is of another model or a coefficient leaves the range of
    /// `T`.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, ReceptorError>
    where
        R: NamedRate,
    {
        check_rate(calibration, &rate)?;
        let direction =
            Direction::of_signal(calibration.spec().polarity, calibration.spec().dead_band);
        let model = Surfaces {
            rate,
            map: Map::of(calibration)?,
            direction,
            period_s: T::from_f64(calibration.spec().sample_rate_hz.period_s()),
            needs_signal_only: calibration.spec().model.needs_signal_only(),
        };
        Ok(Self { model })
    }

    /// Returns the reading of a signal at a known rate, on a known branch. No memory is involved, so samples may come
    /// in any order. `R` can be `()`.
    ///
    /// ```
    /// use stretch_core::Branch;
    /// use stretch_receptor::{StretchReceptor, example_calibration};
    /// let receptor = StretchReceptor::<f64, ()>::with_rate(&example_calibration(), ())?;
    /// let reading = receptor.at(Branch::Inflation, 0.4, 1.5);
    /// assert!(reading.estimate > 150.0 && reading.estimate < 180.0);
    /// # Ok::<(), stretch_receptor::ReceptorError>(())
    /// ```
    pub fn at(&self, branch: Branch, rate: T, signal: T) -> Reading<T> {
        self.model.reading(branch, rate, signal)
    }
}

impl<T: Real, R> Surfaces<T, R> {
    #[inline(always)]
    fn reading(&self, branch: Branch, rate: T, signal: T) -> Reading<T> {
        let Point { estimate, slope, domain } = self.map.at(branch, rate, signal);
        Reading { estimate, rate: slope * rate, branch, domain, sd: None }
    }
}

impl<T: Real, R: Design> Design for Surfaces<T, R> {
    type Memory = SurfacesMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        SurfacesMemory { rate: self.rate.memory(), last: T::nan(), last_rate: T::zero() }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Live for Surfaces<T, R> {
    over_volts!(T);

    #[inline(always)]
    fn read(
        &self,
        memory: &mut Self::Memory,
        branch: &mut Branch,
        signal: T,
    ) -> Option<Reading<T>> {
        memory.last = signal;
        let estimated = self.rate.step(&mut memory.rate, signal);
        if estimated.is_none() && !self.needs_signal_only {
            return None;
        }
        let rate = estimated.unwrap_or(T::zero());
        memory.last_rate = rate;
        *branch = self.direction.next(*branch, rate);
        Some(self.reading(*branch, rate, signal))
    }

    /// Bridges a missing sample by the last sample, extrapolated at the last rate.
    fn bridge(&self, memory: &mut Self::Memory, _: u8) -> bool {
        let bridged = memory.last + memory.last_rate * self.period_s;
        if bridged.is_finite() {
            memory.last = bridged;
            // only the window is updated, because there is no answer for this sample
            let _ = self.rate.step(&mut memory.rate, bridged);
        }
        bridged.is_finite()
    }
}

//! Both surfaces, mixed across the dead band.

use stretch_core::{Branch, Calibration, Design, DesignError, Model, Polarity, Real, Stage, Volts};
use stretch_filter::{FilterError, LARGEST_SAMPLE, RateFilter};

use crate::{Domain, MAX_BRIDGED, Reading, ReceptorMemory, Withheld, map::Map};

/// A receptor for [`Model::Blended`]: as [`StretchReceptor`](crate::StretchReceptor),
/// but inside the dead band it answers with both surfaces, weighed by the rate:
/// no jump at a reversal. With `r` the signed rate and `d` the dead band, the
/// inflation surface weighs `(1 + r/d)/2`, held to 0..1.
///
/// Cost: outside the dead band one surface, inside it two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlendedReceptor<T, R = RateFilter<T>> {
    rate: R,
    map: Map<T>,
    sign: T,
    dead_band: T,
    per_band: T,
    period_s: T,
}

impl<T: Real> BlendedReceptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// # Errors
    /// [`FilterError`] when the estimator cannot run live, or the calibration
    /// is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, FilterError> {
        let rate = RateFilter::new(calibration.rate_estimator, calibration.sample_rate_hz)?;
        Ok(Self::with_rate(calibration, rate)?)
    }
}

impl<T: Real, R> BlendedReceptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator built for it.
    ///
    /// # Errors
    /// [`DesignError`] when the calibration is of another model or a coefficient
    /// leaves the range of `T`.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, DesignError> {
        let Model::Blended { inflation, deflation } = &calibration.model else {
            return Err(DesignError::OutOfRange { field: "model", value: f64::NAN });
        };
        let dead_band = T::from_f64(calibration.dead_band);
        Ok(Self {
            rate,
            map: Map::sheets(calibration, inflation, deflation)?,
            sign: match calibration.polarity {
                Polarity::Rising => T::one(),
                Polarity::Falling => -T::one(),
            },
            dead_band,
            // without a band there is nothing to mix in: the weight is never asked for
            per_band: if dead_band > T::zero() { dead_band.recip() } else { T::zero() },
            period_s: T::from_f64(calibration.sample_rate_hz.period_s()),
        })
    }

    #[inline(always)]
    fn answer(&self, branch: Branch, rate: T, signal: T) -> Reading<T> {
        let signed = self.sign * rate;
        let branch = branch.next(signed, self.dead_band);
        let here = self.map.at(branch, rate, signal);
        let (mut estimate, mut slope) = (here.estimate, here.slope);
        let mut domain = here.domain;
        if signed.abs() < self.dead_band {
            let other = match branch {
                Branch::Inflation => Branch::Deflation,
                Branch::Deflation => Branch::Inflation,
            };
            let there = self.map.at(other, rate, signal);
            let half = T::from_f64(0.5);
            let rising = half + half * signed * self.per_band;
            let weight = if branch == Branch::Inflation { rising } else { T::one() - rising };
            estimate = there.estimate + weight * (estimate - there.estimate);
            slope = there.slope + weight * (slope - there.slope);
            // each surface knows one sign of the rate only: beyond its own is no surprise here
            let outside = |d| matches!(d, Domain::SignalClamped | Domain::BothClamped);
            domain = Domain::from_flags(outside(domain) || outside(there.domain), false);
        }
        Reading { estimate, rate: slope * rate, branch, domain }
    }
}

impl<T: Real, R: Design> Design for BlendedReceptor<T, R> {
    type Memory = ReceptorMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        ReceptorMemory::unseen(self.rate.memory())
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Stage<Volts<T>> for BlendedReceptor<T, R> {
    type Out = Result<Reading<T>, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, sample: Volts<T>) -> Self::Out {
        let signal = sample.0;
        let usable = signal.abs() <= T::from_f64(LARGEST_SAMPLE);
        if !usable {
            memory.miss(&self.rate, self.period_s, MAX_BRIDGED);
            return Err(Withheld::Missing);
        }
        let Some(rate) = memory.take(&self.rate, signal) else {
            return Err(Withheld::Warming);
        };
        let reading = self.answer(memory.branch(), rate, signal);
        memory.set_branch(reading.branch);
        Ok(reading)
    }
}

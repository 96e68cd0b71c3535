//! The live form of a polynomial of the signal's history.

use stretch_core::{
    Branch, Calibration, Design, DesignError, HistoryMap, MAX_HISTORY_TERMS, MAX_PLAYS,
    MAX_RELAXATIONS, MAX_STATES, Model, Real, Stage, Volts,
};
use stretch_filter::{FilterError, LARGEST_SAMPLE, RateFilter};

use crate::{
    Domain, MAX_BRIDGED, Reading, Withheld,
    fold::{output, reference_dead_band, share_of},
    rest_level::{Baseline, RestLevel},
};

/// A receptor for [`Model::History`]: low-passes and plays of the signal, then
/// one polynomial.
///
/// A sample every period:
/// 1. the baseline, where one is followed;
/// 2. the states of [`HistoryMap`], each moved into its domain
///    ([`Reading::domain`] says so);
/// 3. the polynomial gives the estimate, held to what the fit saw;
/// 4. the estimator `R` gives the estimate's own rate, and so the branch: by its
///    sign, outside the dead band carried over to the reference.
///
/// The first sample finds every state settled at it. Warm-up, missing samples
/// and reset are those of [`StretchReceptor`](crate::StretchReceptor): a short
/// gap is bridged by the last sample, a longer one forgets all but branch and
/// baseline.
///
/// Cost: a product and a sum a term, a product a state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryReceptor<T, R = RateFilter<T>> {
    rate: R,
    sign: T,
    rest: RestLevel<T>,
    offset: T,
    scale: T,
    relaxations: usize,
    shares: [T; MAX_RELAXATIONS],
    plays: usize,
    radii: [T; MAX_PLAYS],
    centre: [T; MAX_STATES],
    per_half: [T; MAX_STATES],
    terms: usize,
    /// Of every term beyond the constant: the term it extends, and by which state.
    products: [(u8, u8); MAX_HISTORY_TERMS],
    coefficients: [T; MAX_HISTORY_TERMS],
    low: T,
    high: T,
    dead_band: T,
    rising: Branch,
}

/// What a [`HistoryReceptor`] remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryMemory<T, M> {
    rate: M,
    baseline: Baseline<T>,
    /// NaN before the first sample.
    last: T,
    low_passes: [T; MAX_RELAXATIONS],
    plays: [T; MAX_PLAYS],
    branch: Branch,
    missing: u8,
}

impl<T: Real> HistoryReceptor<T> {
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

impl<T: Real, R> HistoryReceptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator for the estimate.
    ///
    /// # Errors
    /// [`DesignError`] when the calibration is of another model.
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, DesignError> {
        let Model::History(map) = &calibration.model else {
            return Err(DesignError::OutOfRange { field: "model", value: f64::NAN });
        };
        map.validate()?;
        let sign = calibration.polarity.sign();
        let range = calibration.signal_range;
        let shape = map.shape();
        let (gain, zero) = output(calibration);
        let mut products = [(0, 0); MAX_HISTORY_TERMS];
        let mut terms = 1;
        shape.each_product(|parent, state| {
            if let Some(place) = products.get_mut(terms) {
                *place = (parent as u8, state as u8);
            }
            terms += 1;
        });
        let mut coefficients = [T::zero(); MAX_HISTORY_TERMS];
        for (place, &c) in coefficients.iter_mut().zip(map.coefficients.iter()) {
            *place = T::from_f64(gain * c);
        }
        coefficients[0] = T::from_f64(zero + gain * map.coefficients[0]);
        let (centre, per_half) = scales(map);
        let ends = [map.estimate_domain.min, map.estimate_domain.max].map(|t| zero + gain * t);
        Ok(Self {
            rate,
            sign: T::from_f64(sign),
            rest: RestLevel::new(map.rest, calibration),
            offset: T::from_f64(range.offset()),
            scale: T::from_f64(range.span().recip()),
            relaxations: map.relaxations_s.len(),
            shares: shares(map, calibration.sample_rate_hz.period_s()),
            plays: map.radii.len(),
            radii: rounded(&map.radii),
            centre,
            per_half,
            terms,
            products,
            coefficients,
            low: T::from_f64(ends[0].min(ends[1])),
            high: T::from_f64(ends[0].max(ends[1])),
            dead_band: T::from_f64(reference_dead_band(calibration)),
            rising: if gain > 0.0 { Branch::Inflation } else { Branch::Deflation },
        })
    }

    /// The states of a usable sample, each scaled to -1..1, and whether the
    /// signal and any memory had to be moved into their domains.
    #[inline(always)]
    fn states<M>(
        &self,
        memory: &mut HistoryMemory<T, M>,
        signal: T,
    ) -> ([T; MAX_STATES], bool, bool) {
        let above = self.rest.step(&mut memory.baseline, self.sign * signal, T::zero());
        let x = (self.sign * above - self.offset) * self.scale;
        if memory.last.is_nan() {
            memory.low_passes = [x; MAX_RELAXATIONS];
            memory.plays = [x; MAX_PLAYS];
        }
        memory.last = signal;
        let mut states = [T::zero(); MAX_STATES];
        states[0] = x;
        let mut before = x;
        for i in 0..self.relaxations {
            let slow = memory.low_passes[i] + self.shares[i] * (x - memory.low_passes[i]);
            memory.low_passes[i] = slow;
            states[1 + i] = before - slow;
            before = slow;
        }
        for j in 0..self.plays {
            let played = play(memory.plays[j], x, self.radii[j]);
            memory.plays[j] = played;
            states[1 + self.relaxations + j] = x - played;
        }
        let mut outside = [false; 2];
        for (i, state) in states.iter_mut().enumerate().take(1 + self.relaxations + self.plays) {
            let scaled = (*state - self.centre[i]) * self.per_half[i];
            *state = scaled.max(-T::one()).min(T::one());
            outside[usize::from(i > 0)] |= *state != scaled;
        }
        (states, outside[0], outside[1])
    }

    #[inline(always)]
    fn polynomial(&self, states: &[T; MAX_STATES]) -> T {
        let mut made = [T::one(); MAX_HISTORY_TERMS];
        let mut sum = self.coefficients[0];
        for k in 1..self.terms.min(MAX_HISTORY_TERMS) {
            let (parent, state) = self.products[k];
            let product = made[usize::from(parent) % MAX_HISTORY_TERMS]
                * states[usize::from(state) % MAX_STATES];
            made[k] = product;
            sum = sum + self.coefficients[k] * product;
        }
        sum
    }
}

impl<T: Real, R: Design> Design for HistoryReceptor<T, R> {
    type Memory = HistoryMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        HistoryMemory {
            rate: self.rate.memory(),
            baseline: Baseline::unmoved(),
            last: T::nan(),
            low_passes: [T::zero(); MAX_RELAXATIONS],
            plays: [T::zero(); MAX_PLAYS],
            branch: Branch::Inflation,
            missing: 0,
        }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> HistoryReceptor<T, R> {
    #[inline(always)]
    fn usable(
        &self,
        memory: &mut HistoryMemory<T, R::Memory>,
        signal: T,
    ) -> (T, Option<T>, Domain) {
        let (states, signal_outside, memory_outside) = self.states(memory, signal);
        let free = self.polynomial(&states);
        let estimate = free.max(self.low).min(self.high);
        let domain = Domain::from_flags(signal_outside || estimate != free, memory_outside);
        (estimate, self.rate.step(&mut memory.rate, estimate), domain)
    }

    #[cold]
    fn missed(&self, memory: &mut HistoryMemory<T, R::Memory>) {
        memory.missing = memory.missing.saturating_add(1);
        if memory.missing <= MAX_BRIDGED && memory.last.is_finite() {
            // the memories go on; nothing is answered for this sample
            let _ = self.usable(memory, memory.last);
        } else {
            let (branch, baseline) = (memory.branch, memory.baseline);
            *memory = HistoryMemory { branch, baseline, missing: MAX_BRIDGED, ..self.memory() };
        }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Stage<Volts<T>> for HistoryReceptor<T, R> {
    type Out = Result<Reading<T>, Withheld>;

    #[inline(always)]
    fn step(&self, memory: &mut Self::Memory, sample: Volts<T>) -> Self::Out {
        let usable = sample.0.abs() <= T::from_f64(LARGEST_SAMPLE);
        if !usable {
            self.missed(memory);
            return Err(Withheld::Missing);
        }
        memory.missing = 0;
        let (estimate, rate, domain) = self.usable(memory, sample.0);
        let Some(rate) = rate else {
            return Err(Withheld::Warming);
        };
        let rising = if self.rising == Branch::Inflation { rate } else { -rate };
        memory.branch = memory.branch.next(rising, self.dead_band);
        Ok(Reading { estimate, rate, branch: memory.branch, domain })
    }
}

/// Backlash of half-width `radius`: the nearest value within it.
#[inline(always)]
pub(crate) fn play<T: Real>(before: T, x: T, radius: T) -> T {
    before.max(x - radius).min(x + radius)
}

fn rounded<T: Real, const N: usize>(values: &[f64]) -> [T; N] {
    let mut out = [T::zero(); N];
    for (place, &value) in out.iter_mut().zip(values) {
        *place = T::from_f64(value);
    }
    out
}

fn shares<T: Real>(map: &HistoryMap, period_s: f64) -> [T; MAX_RELAXATIONS] {
    let mut out = [T::zero(); MAX_RELAXATIONS];
    for (place, &tau) in out.iter_mut().zip(map.relaxations_s.iter()) {
        *place = T::from_f64(share_of(period_s, tau));
    }
    out
}

fn scales<T: Real>(map: &HistoryMap) -> ([T; MAX_STATES], [T; MAX_STATES]) {
    let (mut centre, mut per_half) = ([T::zero(); MAX_STATES], [T::zero(); MAX_STATES]);
    for (i, (&min, &max)) in map.state_min.iter().zip(map.state_max.iter()).enumerate() {
        centre[i] = T::from_f64(0.5 * (min + max));
        per_half[i] = T::from_f64(2.0 / (max - min));
    }
    (centre, per_half)
}

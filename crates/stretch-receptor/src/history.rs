//! The live form of a polynomial of the signal's history.

use stretch_core::{
    Baseline, Branch, Calibration, Design, HistoryMap, MAX_HISTORY_TERMS, MAX_PLAYS,
    MAX_RELAXATIONS, MAX_STATES, Model, Real, RestLevel, Stage,
    arithmetic::{lag, lag_share, play},
};
use stretch_filter::{NamedRate, RateFilter};

use crate::{
    Domain, Front, Reading, ReceptorError,
    fold::{check_rate, estimator, output, reference_dead_band, rounded},
    front::{Direction, Live, over_volts},
};

/// A receptor for [`Model::History`], a polynomial of the signal and of its low-passes and plays (backlash operators).
///
/// For each sample:
/// 1. the baseline (the drifting signal at rest) is updated, if the calibration has one;
/// 2. the states of [`HistoryMap`] are computed and clamped to their domains ([`Reading::domain`] shows whether one was
///    outside);
/// 3. the polynomial gives the estimate, limited to the fitted range ([`Domain::EstimateClamped`] if only this limit applied);
/// 4. the estimator `R` gives the rate of the estimate. Outside the dead band, which is converted to the reference, the
///    sign of the rate gives the branch.
///
/// At the first sample every state is set to its steady state. Warm-up, missing samples and branch are handled as in
/// every [`Front`]. A gap is bridged with the last sample; after a longer gap the rate estimator starts again.
///
/// Cost: a product and a sum for each term, a product for each state.
pub type HistoryReceptor<T, R = RateFilter<T>> = Front<History<T, R>>;

/// The model of a [`HistoryReceptor`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct History<T, R> {
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
    /// For every term except the constant: the indices of an earlier term and of a state. The term is the product of
    /// the two.
    products: [(u8, u8); MAX_HISTORY_TERMS],
    coefficients: [T; MAX_HISTORY_TERMS],
    low: T,
    high: T,
    direction: Direction<T>,
}

/// The state of a [`HistoryReceptor`]'s model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HistoryMemory<T, M> {
    rate: M,
    baseline: Baseline<T>,
    /// NaN before the first sample.
    last: T,
    low_passes: [T; MAX_RELAXATIONS],
    plays: [T; MAX_PLAYS],
}

impl<T: Real> HistoryReceptor<T> {
    /// A receptor for `calibration`, with the rate estimator that it names.
    ///
    /// # Errors
    /// [`ReceptorError`] when the estimator cannot run live, or the calibration
    /// is of another model.
    pub fn new(calibration: &Calibration) -> Result<Self, ReceptorError> {
        Self::with_rate(calibration, estimator(calibration)?)
    }
}

impl<T: Real, R> HistoryReceptor<T, R> {
    /// A receptor for `calibration`, with a rate estimator for the estimate.
    ///
    /// # Errors
    /// The errors of [`StretchReceptor::with_rate`](crate::StretchReceptor::with_rate).
    pub fn with_rate(calibration: &Calibration, rate: R) -> Result<Self, ReceptorError>
    where
        R: NamedRate,
    {
        check_rate(calibration, &rate)?;
        let Model::History(map) = &calibration.spec().model else {
            return Err(calibration.spec().model.instead_of("history").into());
        };
        let (polarity, sample_rate) =
            (calibration.spec().polarity, calibration.spec().sample_rate_hz);
        let range = calibration.spec().signal_range;
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
        let mut coefficients: [T; MAX_HISTORY_TERMS] =
            rounded(map.coefficients.iter().map(|c| gain * c));
        coefficients[0] = T::from_f64(zero + gain * map.coefficients[0]);
        let (centre, per_half) = scales(map);
        let ends = [map.estimate_domain.min, map.estimate_domain.max].map(|t| zero + gain * t);
        let shares = map.relaxations_s.iter().map(|&tau| lag_share(sample_rate.period_s(), tau));
        let model = History {
            rate,
            sign: T::from_f64(polarity.sign()),
            rest: RestLevel::new(map.rest, polarity, range, sample_rate),
            offset: T::from_f64(range.offset()),
            scale: T::from_f64(range.span().recip()),
            relaxations: map.relaxations_s.len(),
            shares: rounded(shares),
            plays: map.radii.len(),
            radii: rounded(map.radii.iter().copied()),
            centre,
            per_half,
            terms,
            products,
            coefficients,
            low: T::from_f64(ends[0].min(ends[1])),
            high: T::from_f64(ends[0].max(ends[1])),
            direction: Direction {
                rising: if gain > 0.0 { Branch::Inflation } else { Branch::Deflation },
                dead_band: T::from_f64(reference_dead_band(calibration)),
            },
        };
        Ok(Self { model })
    }
}

impl<T: Real, R> History<T, R> {
    /// Returns the states of a usable sample, each scaled to -1..1, and whether the signal and any memory state had to
    /// be moved into their domains.
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
            let slow = lag(memory.low_passes[i], x, self.shares[i]);
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

impl<T: Real, R: Design> Design for History<T, R> {
    type Memory = HistoryMemory<T, R::Memory>;

    fn memory(&self) -> Self::Memory {
        HistoryMemory {
            rate: self.rate.memory(),
            baseline: self.rest.memory(),
            last: T::nan(),
            low_passes: [T::zero(); MAX_RELAXATIONS],
            plays: [T::zero(); MAX_PLAYS],
        }
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> History<T, R> {
    #[inline(always)]
    fn take(&self, memory: &mut HistoryMemory<T, R::Memory>, signal: T) -> (T, Option<T>, Domain) {
        let (states, signal_outside, memory_outside) = self.states(memory, signal);
        let free = self.polynomial(&states);
        let estimate = free.max(self.low).min(self.high);
        let domain = match Domain::from_flags(signal_outside, memory_outside) {
            Domain::Inside if estimate != free => Domain::EstimateClamped,
            domain => domain,
        };
        (estimate, self.rate.step(&mut memory.rate, estimate), domain)
    }
}

impl<T: Real, R: Stage<T, Out = Option<T>>> Live for History<T, R> {
    over_volts!(T);

    #[inline(always)]
    fn read(
        &self,
        memory: &mut Self::Memory,
        branch: &mut Branch,
        signal: T,
    ) -> Option<Reading<T>> {
        let (estimate, rate, domain) = self.take(memory, signal);
        let rate = rate?;
        *branch = self.direction.next(*branch, rate);
        Some(Reading { estimate, rate, branch: *branch, domain, sd: None })
    }

    /// Bridges a missing sample with the last sample: the memory is updated, and there is no reading.
    fn bridge(&self, memory: &mut Self::Memory, _: u8) -> bool {
        let begun = memory.last.is_finite();
        if begun {
            let _ = self.take(memory, memory.last);
        }
        begun
    }

    /// The memory relaxes towards the last sample, and the rate estimator starts again. The baseline does not change.
    fn pause(&self, memory: &mut Self::Memory) {
        let baseline = memory.baseline;
        self.bridge(memory, 0);
        (memory.baseline, memory.rate) = (baseline, self.rate.memory());
    }

    fn restart(&self, memory: &mut Self::Memory) {
        *memory = HistoryMemory { baseline: memory.baseline, ..self.memory() };
    }
}

fn scales<T: Real>(map: &HistoryMap) -> ([T; MAX_STATES], [T; MAX_STATES]) {
    let (mut centre, mut per_half) = ([T::zero(); MAX_STATES], [T::zero(); MAX_STATES]);
    for (i, (&min, &max)) in map.state_min.iter().zip(map.state_max.iter()).enumerate() {
        centre[i] = T::from_f64(0.5 * (min + max));
        per_half[i] = T::from_f64(2.0 / (max - min));
    }
    (centre, per_half)
}

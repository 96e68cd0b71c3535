//! Recorded signals in the form that terms use: scaled, so that no term depends on a unit.
//!
//! ```text
//! x = (signal - offset)/scale      0 .. 1 over the samples that are fitted; a command as it is
//! v = (dx/dt)/rate                 of root mean square 1 there
//! ```
//!
//! No test sample influences a fit: scales are computed from fitted samples only, terms with a
//! memory are causal and begin anew in every trial, and a rate at the border of the test part uses
//! samples of one side only.

use std::ops::Range;

use stretch_effects::Grid;

use stretch_data::ends;

use crate::{
    missing::proposed::SignalScale,
    problem::{
        error::GapError,
        record_facts::Recorded,
        sample_roles::{Role, SampleRoles, Segment},
        simulator::Simulator,
        spec::TrialSpec,
    },
};

/// A recorded signal, scaled.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    pub(crate) spec: SignalScale,
    /// x, all trials concatenated.
    pub(crate) x: Vec<f64>,
    /// v, all trials concatenated.
    pub(crate) v: Vec<f64>,
}

impl Signal {
    /// Returns the value of x about which odd and even curves are centred: the x of a signal of
    /// zero if the fitted range contains it, otherwise the middle of that range.
    pub(crate) fn centre(&self) -> f64 {
        let zero = -self.spec.offset / self.spec.scale;
        if (0.0..=1.0).contains(&zero) { zero } else { 0.5 }
    }
}

/// Signals, trials and time scales of a session.
#[derive(Debug, Clone)]
pub(crate) struct TermInputs {
    pub(crate) signals: Vec<Signal>,
    /// Range of each trial's samples in the concatenated signals.
    pub(crate) trials: Vec<Range<usize>>,
    /// Session time of each trial's first sample, relative to the first trial, s.
    pub(crate) starts_s: Vec<f64>,
    /// Length of the longest fitted segment, and session time of the last fitted sample, s. Both
    /// are units of time for terms.
    pub(crate) trial_s: f64,
    pub(crate) session_s: f64,
    /// Length of the longest trial without its test samples, s.
    pub(crate) recorded_s: f64,
    /// Time grid on which operators (lags, plays) are stepped: one step per sample.
    pub(crate) grid: Grid,
}

/// Squared correlation from which two signals are redundant.
const SAME: f64 = 0.998;

impl TermInputs {
    /// Collects the signals that a term of a stage may depend on: all recorded signals except the
    /// stage's own output. The simulator's noise-free prediction of that output (`own`, all trials
    /// concatenated) is used instead. A signal that correlates too closely with a previous one is
    /// dropped.
    pub(crate) fn of(
        simulator: &dyn Simulator,
        roles: &SampleRoles,
        stage: usize,
        own: Vec<f64>,
    ) -> Result<Self, GapError> {
        let spec = &simulator.stages()[stage];
        let (trials, dt_s) = (simulator.trials(), simulator.dt_s());
        let ranges = TrialSpec::ranges(trials);
        let grid = Grid::samples(dt_s).map_err(|e| GapError::simulator(e.to_string()))?;
        let first_s = trials.first().map_or(0.0, |t| t.start_s);
        let fitted = || roles.of_role(Role::Fit);
        let end_s = |s: &Segment| {
            let trial = &ranges[s.trial];
            trials[s.trial].start_s - first_s + (s.to - trial.start) as f64 * dt_s
        };
        let longest = fitted().map(|s| s.to - s.from).max().unwrap_or(1);
        let mut inputs = Self {
            signals: Vec::new(),
            starts_s: trials.iter().map(|t| t.start_s - first_s).collect(),
            trial_s: longest as f64 * dt_s,
            session_s: fitted().map(end_s).fold(dt_s, f64::max),
            recorded_s: SampleRoles::not_tested(trials).into_iter().max().unwrap_or(0) as f64
                * dt_s,
            trials: ranges,
            grid,
        };
        let mut all = recorded(simulator);
        all.retain(|s| s.name != spec.channel && s.values.len() >= own.len());
        all.push(Recorded::measured(&spec.channel, &spec.unit, own));
        for signal in all {
            let Some(signal) = Signal::of(signal, roles, dt_s) else { continue };
            if inputs.signals.iter().all(|other| alike(other, &signal, roles) < SAME) {
                inputs.signals.push(signal);
            }
        }
        Ok(inputs)
    }

    /// Returns the number of samples in the first `trials` trials.
    pub(crate) fn samples(&self, trials: usize) -> usize {
        self.trials[..trials].last().map_or(0, |t| t.end)
    }

    /// Returns the indices of the signals that are commands (`commands` true) or are not.
    pub(crate) fn of_kind(&self, commands: bool) -> Vec<usize> {
        (0..self.signals.len()).filter(|&i| self.signals[i].spec.is_command == commands).collect()
    }

    /// Returns the quantile `share` (0 to 1) of x over the fitted samples.
    pub(crate) fn quantile(&self, signal: usize, share: f64, roles: &SampleRoles) -> f64 {
        let x = &self.signals[signal].x;
        let mut sorted: Vec<f64> =
            roles.of_role(Role::Fit).flat_map(|s| &x[s.from..s.to]).copied().collect();
        sorted.sort_by(f64::total_cmp);
        let at = (share * (sorted.len().max(1) - 1) as f64) as usize;
        sorted.get(at).copied().unwrap_or(share)
    }
}

/// Returns every signal that a missing term may depend on: the recorded signals that the
/// description lists. If it lists none, the signals are the inputs of the stages, each named after
/// the channel of the previous stage. If there are no such inputs either, the only signal is the
/// motion.
fn recorded(simulator: &dyn Simulator) -> Vec<Recorded> {
    let known = &simulator.record().signals;
    if !known.is_empty() {
        return known.clone();
    }
    let fed = (1..simulator.stages().len()).filter_map(|stage| {
        let before = &simulator.stages()[stage - 1];
        let input = simulator.input(stage)?;
        Some(Recorded::measured(&before.channel, &before.unit, input))
    });
    let fed: Vec<Recorded> = fed.collect();
    let motion = simulator.motion();
    match fed.is_empty() {
        true => vec![Recorded::measured("motion", motion.unit, motion.values.to_vec())],
        false => fed,
    }
}

impl Signal {
    /// Scales a signal and computes its rate; `None` if the signal is constant over the fitted
    /// samples.
    fn of(recorded: Recorded, roles: &SampleRoles, dt_s: f64) -> Option<Self> {
        let Recorded { name, unit, mut values, is_command } = recorded;
        let (low, high) =
            ends(roles.of_role(Role::Fit).flat_map(|part| &values[part.from..part.to]));
        if !(high - low > 0.0 && (high - low).is_finite()) {
            return None;
        }
        let (offset, scale) = if is_command { (0.0, 1.0) } else { (low, high - low) };
        values.iter_mut().for_each(|x| *x = (*x - offset) / scale);
        let mut v = rates(&values, roles, dt_s);
        let (mut sum, mut count) = (0.0, 0.0);
        for segment in roles.of_role(Role::Fit) {
            sum += v[segment.from..segment.to].iter().map(|v| v * v).sum::<f64>();
            count += (segment.to - segment.from) as f64;
        }
        let rate = (sum / f64::max(count, 1.0)).sqrt().max(f64::MIN_POSITIVE);
        v.iter_mut().for_each(|v| *v /= rate);
        let spec = SignalScale { name, unit, offset, scale, rate_per_s: rate, is_command };
        Some(Self { spec, x: values, v })
    }
}

/// Computes central differences within the test part and, separately, within the rest, 1/s.
fn rates(x: &[f64], roles: &SampleRoles, dt_s: f64) -> Vec<f64> {
    let mut out = vec![0.0; x.len()];
    let mut parts: Vec<(usize, bool, Range<usize>)> = Vec::new();
    for s in &roles.segments {
        let is_test = s.role == Role::Test;
        match parts.last_mut() {
            Some((trial, tested, range))
                if *trial == s.trial && *tested == is_test && range.end == s.from =>
            {
                range.end = s.to;
            }
            _ => parts.push((s.trial, is_test, s.from..s.to)),
        }
    }
    for (_, _, range) in parts {
        out[range.clone()].copy_from_slice(&central_differences(&x[range], dt_s));
    }
    out
}

/// Returns the squared correlation of two signals over the fitted samples.
fn alike(a: &Signal, b: &Signal, roles: &SampleRoles) -> f64 {
    let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for s in roles.of_role(Role::Fit) {
        for (a, b) in a.x[s.from..s.to].iter().zip(&b.x[s.from..s.to]) {
            n += 1.0;
            x += a;
            y += b;
            xx += a * a;
            yy += b * b;
            xy += a * b;
        }
    }
    let own = (xx - x * x / n) * (yy - y * y / n);
    if own > 0.0 { (xy - x * y / n).powi(2) / own } else { 0.0 }
}

/// Differentiates an evenly sampled signal by central differences, one-sided at both ends; the rate
/// of a single sample is 0.
pub(super) fn central_differences(x: &[f64], dt_s: f64) -> Vec<f64> {
    let rate = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(x.len() - 1));
        if b > a { (x[b] - x[a]) / ((b - a) as f64 * dt_s) } else { 0.0 }
    };
    (0..x.len()).map(rate).collect()
}

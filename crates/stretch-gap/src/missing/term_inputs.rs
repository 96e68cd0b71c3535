//! Recorded signals as terms use them: each scaled, so that no term depends on a unit.
//!
//! ```text
//! x = (signal - offset)/scale      0 .. 1 over the samples that are fitted; a command as it is
//! v = (dx/dt)/rate                 of root mean square 1 there
//! ```
//!
//! Scales are computed from fitted samples only. Memories begin anew in every trial and are causal.
//! Rates are differences within the fitted part or within the test part. Therefore nothing that is
//! fitted has seen a test sample.

use std::ops::Range;

use stretch_effects::Grid;

use stretch_data::ends;

use crate::problem::{
    error::GapError,
    record_facts::Recorded,
    sample_roles::{Role, SampleRoles},
    simulator::Simulator,
};

/// A scaled signal.
#[derive(Debug, Clone)]
pub(crate) struct Signal {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) offset: f64,
    pub(crate) scale: f64,
    /// Unit of v, 1/s.
    pub(crate) rate: f64,
    pub(crate) is_command: bool,
    /// x, all trials concatenated.
    pub(crate) x: Vec<f64>,
    /// v, the same.
    pub(crate) v: Vec<f64>,
}

impl Signal {
    /// x about which a law is odd or even: the zero of a signal that passes through zero, otherwise
    /// the middle of its range.
    pub(crate) fn centre(&self) -> f64 {
        let zero = -self.offset / self.scale;
        if (0.0..=1.0).contains(&zero) { zero } else { 0.5 }
    }
}

/// Signals, trials and clocks of a session.
#[derive(Debug, Clone)]
pub(crate) struct TermInputs {
    pub(crate) signals: Vec<Signal>,
    /// Samples of each trial.
    pub(crate) trials: Vec<Range<usize>>,
    /// Session time of each trial's first sample, relative to the first trial, s.
    pub(crate) starts_s: Vec<f64>,
    /// Longest fitted stretch and length of the session up to the last fitted sample, s: the units
    /// of time.
    pub(crate) trial_s: f64,
    pub(crate) session_s: f64,
    /// One step per sample.
    pub(crate) grid: Grid,
}

/// Squared correlation above which two signals are redundant.
const SAME: f64 = 0.998;

impl TermInputs {
    /// Signals that may act in a stage: everything recorded except its own channel. The model's
    /// noise-free prediction of that channel (`own`, all trials concatenated) takes its place.
    pub(crate) fn of(
        simulator: &dyn Simulator,
        roles: &SampleRoles,
        stage: usize,
        own: Vec<f64>,
    ) -> Result<Self, GapError> {
        let spec = &simulator.stages()[stage];
        let (trials, dt_s) = (simulator.trials(), simulator.dt_s());
        let mut ranges = Vec::new();
        let mut begin = 0;
        for trial in trials {
            ranges.push(begin..begin + trial.samples);
            begin += trial.samples;
        }
        let grid = Grid::samples(dt_s).map_err(|e| GapError::simulator(e.to_string()))?;
        let first_s = trials.first().map_or(0.0, |t| t.start_s);
        let fitted = || roles.of_role(Role::Fit);
        let end_s = |s: &crate::problem::sample_roles::Segment| {
            let trial = &ranges[s.trial];
            trials[s.trial].start_s - first_s + (s.to - trial.start) as f64 * dt_s
        };
        let longest = fitted().map(|s| s.to - s.from).max().unwrap_or(1);
        let mut inputs = Self {
            signals: Vec::new(),
            starts_s: trials.iter().map(|t| t.start_s - first_s).collect(),
            trial_s: longest as f64 * dt_s,
            session_s: fitted().map(end_s).fold(dt_s, f64::max),
            trials: ranges,
            grid,
        };
        let mut all = recorded(simulator);
        all.retain(|s| s.name != spec.channel && s.values.len() >= begin);
        all.push(Recorded::measured(&spec.channel, &spec.unit, own));
        for signal in all {
            let Some(signal) = Signal::of(signal, roles, dt_s) else { continue };
            if inputs.signals.iter().all(|other| alike(other, &signal, roles) < SAME) {
                inputs.signals.push(signal);
            }
        }
        Ok(inputs)
    }

    /// Samples of the first `trials` trials.
    pub(crate) fn samples(&self, trials: usize) -> usize {
        self.trials[..trials].last().map_or(0, |t| t.end)
    }

    /// Indices of signals that are commands, or that are not.
    pub(crate) fn of_kind(&self, commands: bool) -> Vec<usize> {
        (0..self.signals.len()).filter(|&i| self.signals[i].is_command == commands).collect()
    }

    /// x at a quantile of the fitted samples.
    pub(crate) fn quantile(&self, signal: usize, share: f64, roles: &SampleRoles) -> f64 {
        let x = &self.signals[signal].x;
        let mut sorted: Vec<f64> =
            roles.of_role(Role::Fit).flat_map(|s| &x[s.from..s.to]).copied().collect();
        sorted.sort_by(f64::total_cmp);
        let at = (share * (sorted.len().max(1) - 1) as f64) as usize;
        sorted.get(at).copied().unwrap_or(share)
    }
}

/// Everything that a missing term may be a function of: the signals that the record lists, or else
/// the inputs of the stages, named after the previous channel, or else the motion.
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
    /// The signal with its rate; `None` if it does not move in the fitted samples.
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
        Some(Self { name, unit, offset, scale, rate, is_command, x: values, v })
    }
}

/// Central differences within the test part and within the rest, 1/s.
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

/// Squared correlation over the fitted samples.
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

/// The rate of a signal that was sampled at equal times: central differences, one-sided at both ends; a single sample has no rate.
pub(super) fn central_differences(x: &[f64], dt_s: f64) -> Vec<f64> {
    let rate = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(x.len() - 1));
        if b > a { (x[b] - x[a]) / ((b - a) as f64 * dt_s) } else { 0.0 }
    };
    (0..x.len()).map(rate).collect()
}

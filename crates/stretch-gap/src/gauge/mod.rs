//! A gauge alone beside a reference: a rig of one stage.

use stretch_data::{Trial, unit};
use stretch_sim::{CATALOGUE, Effect, EffectSet, Gauge, GaugeSpec, Scale, Start};

use crate::{
    dice::Dice,
    error::GapError,
    simulator::{
        EffectParameterSpec, EffectSpec, Model, Motion, ParameterSpec, Run, Simulator, StageSpec,
        TrialSpec,
    },
};

/// Any stretch sensor with a reference: y = offset + gain e, e the reference over its range in the fit trials.
#[derive(Debug)]
pub struct GaugeSimulator {
    stages: Vec<StageSpec>,
    parameters: Vec<ParameterSpec>,
    effects: Vec<EffectSpec>,
    rows: Vec<&'static dyn Effect>,
    trials: Vec<TrialSpec>,
    reference: Vec<f64>,
    signal: Vec<f64>,
    unit: String,
    spec: GaugeSpec,
    reference_sd: f64,
    dt_s: f64,
    notes: Vec<String>,
}

impl GaugeSimulator {
    /// Binds a gauge to trials (with the session time each began, and whether it is a test trial) and two of their
    /// columns. Effects called in `without` are left out. `mains_hum` takes no part yet.
    ///
    /// # Errors
    /// Columns that are missing, dead, or hold too few numbers; names in `without` that nobody knows.
    pub fn new(
        trials: &[(Trial, f64, bool)],
        reference: &str,
        signal: &str,
        without: &[String],
    ) -> Result<Self, GapError> {
        for name in without {
            if stretch_sim::effect_named(name).is_none() {
                let names = CATALOGUE.iter().map(|e| e.name());
                let nearest = stretch_data::nearest(name, names).map(str::to_owned);
                return Err(GapError::UnknownEffect { name: name.clone(), nearest });
            }
        }
        let too_little = || GapError::TooLittle {
            what: "there is no trial to fit with 100 samples".into(),
            hint: "give a longer recording".into(),
        };
        let first = trials.iter().find(|t| !t.2 && t.0.len() >= 100).ok_or_else(too_little)?;
        let dt_s = first.0.rate_hz().map_or(0.01, |rate| 1.0 / rate);
        let (mut xs, mut ys, mut specs, mut notes) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for (trial, start_s, is_test) in trials {
            let column = |name: &str| {
                trial.channel(name).map(<[f64]>::to_vec).ok_or_else(|| GapError::MissingColumn {
                    trial: trial.name.clone(),
                    column: name.into(),
                    needs: "a diagnosis of a gauge alone needs",
                })
            };
            let (mut x, mut y) = (column(reference)?, column(signal)?);
            let missing = bridge(&mut x) + bridge(&mut y);
            if missing > 0 {
                notes.push(format!("{}: {missing} missing values were interpolated", trial.name));
            }
            if !is_test {
                low = x.iter().copied().fold(low, f64::min);
                high = x.iter().copied().fold(high, f64::max);
            }
            specs.push(TrialSpec {
                name: trial.name.clone(),
                samples: x.len(),
                start_s: *start_s,
                is_test: *is_test,
            });
            xs.extend(x);
            ys.extend(y);
        }
        for (name, values) in [(reference, &xs), (signal, &ys)] {
            let span = values
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
            if span.1 <= span.0 {
                return Err(GapError::Implausible {
                    column: name.into(),
                    found: format!("{} in every sample", span.0),
                    hint: "the channel is dead: check the sensor and its cable".into(),
                });
            }
        }
        let (offset, gain) = line(&xs, &ys, low, high - low);
        let spread =
            ys.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        let sd = 3.0 * (spread.1 - spread.0);
        let unit_of = |name: &str| unit(name).unwrap_or("").to_owned();
        let flat = |name: &str, nominal: f64| ParameterSpec {
            name: name.into(),
            unit: unit_of(signal),
            nominal,
            sd,
            least: f64::NEG_INFINITY,
            wander: None,
            per_trial_sd: None,
            is_evidence: false,
        };
        let (effects, rows) = entries(without);
        Ok(Self {
            stages: vec![StageSpec {
                name: "sensing".into(),
                channel: signal.into(),
                unit: unit_of(signal),
                parameters: vec![0, 1],
                noise: None,
            }],
            parameters: vec![flat("offset", offset), flat("gain", gain)],
            effects,
            rows,
            trials: specs,
            reference_sd: noise(&xs),
            reference: xs,
            signal: ys,
            unit: unit_of(reference),
            spec: GaugeSpec { zero: low, span: high - low, offset, gain, pressure_scale: None },
            dt_s,
            notes,
        })
    }

    /// What was noticed while it was read.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

impl Simulator for GaugeSimulator {
    fn stages(&self) -> &[StageSpec] {
        &self.stages
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn effects(&self) -> &[EffectSpec] {
        &self.effects
    }

    fn trials(&self) -> &[TrialSpec] {
        &self.trials
    }

    fn dt_s(&self) -> f64 {
        self.dt_s
    }

    fn measured(&self, _stage: usize) -> &[f64] {
        &self.signal
    }

    fn motion(&self) -> Motion<'_> {
        Motion { values: &self.reference, unit: &self.unit, falling: "falling", rising: "rising" }
    }

    fn sensor(&self) -> Option<usize> {
        Some(0)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        let Model { parameters, effects } = run.model;
        let spec = GaugeSpec { offset: parameters[0], gain: parameters[1], ..self.spec };
        let mut set = EffectSet::new();
        for (index, values) in effects {
            set.push(self.rows[*index], values)?;
        }
        let gauge = Gauge::new(spec, &set, self.dt_s)?;
        let mut memory = gauge.memory();
        let mut from = 0;
        for (i, trial) in self.trials[..run.trials].iter().enumerate() {
            let mut input = self.reference[from..from + trial.samples].to_vec();
            if let Some(seed) = run.shake {
                let mut dice = Dice::new(seed, i as u64);
                input.iter_mut().for_each(|x| *x += self.reference_sd * dice.gauss());
            }
            let start = if i == 0 { Start::Settled } else { Start::Carried { rest_s: 0.0 } };
            let own = &mut out[from..from + trial.samples];
            gauge.run(&mut memory, start, trial.start_s, &input, &[], own)?;
            from += trial.samples;
        }
        match out.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(GapError::NotFinite { stage: "sensing".into() }),
        }
    }
}

/// Effects that can act in a gauge alone, in units of e and of the signal's span.
fn entries(without: &[String]) -> (Vec<EffectSpec>, Vec<&'static dyn Effect>) {
    let able = CATALOGUE.iter().filter(|e| {
        Gauge::accepts(**e, false)
            && e.name() != "mains_hum"
            && !without.iter().any(|name| name == e.name())
    });
    able.map(|&effect| {
        let parameters: Vec<EffectParameterSpec> = effect
            .parameters()
            .iter()
            .map(|p| {
                let (min, max, _) = Gauge::range(p);
                EffectParameterSpec {
                    name: p.name.into(),
                    unit: if matches!(p.unit, "strain" | "mm" | "V") { "1" } else { p.unit }.into(),
                    min,
                    max,
                    off: p.off.map(|off| off * max / p.max),
                    is_log: p.scale == Scale::Log,
                    is_fitted: true,
                    form: None,
                }
            })
            .collect();
        let spec = EffectSpec {
            name: effect.name().into(),
            stage: effect.stage().name().into(),
            touches: vec![0],
            starts: starts(effect, &parameters),
            parameters,
            is_between_trials: matches!(effect.name(), "thermal_drift" | "gauge_softening"),
            twins: Vec::new(),
        };
        (spec, effect as &'static dyn Effect)
    })
    .unzip()
}

/// Strengths at their typical value and a fifth of it, of both signs where the range has both; shapes at a sixth, a
/// half and five sixths of their range in equal ratios.
fn starts(effect: &dyn Effect, specs: &[EffectParameterSpec]) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new()];
    for (p, spec) in effect.parameters().iter().zip(specs) {
        let typical = Gauge::range(p).2;
        let values: Vec<f64> = match spec.off {
            None => [1.0, 3.0, 5.0]
                .map(|k| spec.min * (spec.max / spec.min.max(1e-12)).powf(k / 6.0))
                .into(),
            Some(_) => [typical, 0.2 * typical, -typical, -0.2 * typical]
                .into_iter()
                .filter(|v| (spec.min..=spec.max).contains(v) && *v != 0.0)
                .collect(),
        };
        all = all
            .iter()
            .flat_map(|start| values.iter().map(|v| [start.as_slice(), &[*v]].concat()))
            .collect();
    }
    all
}

/// Straight lines over missing values; how many there were.
fn bridge(values: &mut [f64]) -> usize {
    let known: Vec<usize> = (0..values.len()).filter(|&i| values[i].is_finite()).collect();
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else { return 0 };
    let (head, tail) = (values[first], values[last]);
    values[..first].fill(head);
    values[last + 1..].fill(tail);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        let (from, step) = (values[a], (values[b] - values[a]) / (b - a) as f64);
        for i in a + 1..b {
            values[i] = from + step * (i - a) as f64;
        }
    }
    values.len() - known.len()
}

/// Offset and gain of the straight line of y over (x - zero)/span.
fn line(x: &[f64], y: &[f64], zero: f64, span: f64) -> (f64, f64) {
    let n = x.len() as f64;
    let e = |x: f64| (x - zero) / span;
    let (me, my) = (x.iter().map(|x| e(*x)).sum::<f64>() / n, y.iter().sum::<f64>() / n);
    let (mut ee, mut ey) = (0.0, 0.0);
    for (x, y) in x.iter().zip(y) {
        ee += (e(*x) - me).powi(2);
        ey += (e(*x) - me) * (y - my);
    }
    let gain = if ee > 0.0 && ey != 0.0 { ey / ee } else { 1.0 };
    (my - gain * me, gain)
}

/// Noise of a record from the median of its second differences.
fn noise(values: &[f64]) -> f64 {
    let mut sizes: Vec<f64> = values.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.get(sizes.len() / 2).map_or(0.0, |m| m / 0.6745 / 6f64.sqrt())
}

//! A gauge alone: a stretch sensor with a reference, without the rest of the rig. It is a simulator of one stage.

mod experiments;
mod facts;
mod fixed;
mod session;
mod source;

use std::ops::Range;

use stretch_data::SessionTrial;
use stretch_gap::{
    Description, DescriptionSpec, GapError, Line, Model, Noise, ParameterSpec, Run, Simulator,
    StageSpec, TrialSpec,
};
use stretch_sim::{
    Alone, Catalogue, Effect, EffectSet, Gauge, GaugeRig, GaugeSpec, Start, Tolerance,
};

use facts::{facts, unit_of};
use session::GaugeSession;

use crate::{
    bench::{
        acting::{Acting, FitRecord, lines},
        specs::{Place, shown, spec as spec_of},
        trials::session_s,
    },
    error::ProblemError,
    rig::smooth::{Draws, Smoothed, unscheduled},
};

/// Index of the offset among the parameters.
const OFFSET: usize = 0;
/// Index of the gain.
const GAIN: usize = 1;
/// Index of the initial hysteresis state. At the start of the session, the memories of the gauge are as after a motion
/// from below (1), as after a motion from above (-1), or settled (0).
const INITIAL_STATE: usize = 2;

/// The data from which a [`GaugeSimulator`] is built.
#[derive(Debug, Clone, Copy)]
pub struct GaugeSetup<'a> {
    /// Trials, each with both columns; a column `pressure_kpa` is used if every trial has one.
    pub trials: &'a [SessionTrial],
    /// Column of the reference: the quantity that the gauge measures.
    pub reference: &'a str,
    /// Column of the signal: the output of the gauge.
    pub signal: &'a str,
    /// The nominal gauge; without a rig, zero, span, offset and gain are estimated from the
    /// recording.
    pub rig: Option<&'a GaugeRig>,
    /// Effects that are looked for; effects that the gauge already has are left out.
    pub catalogue: &'a Catalogue,
}

/// Any stretch sensor with a reference: y = offset + gain e. Here e is the reference as a share of its range in the fit
/// trials.
///
/// Offset and gain are free unless a rig file (`kind = "gauge"`) gives them; the rig file's effects act in every run.
/// Effects of the catalogue act on e in place of the strain, on 1 + (y - offset)/gain in place of the resistance, and
/// on (y - offset)/gain in place of the voltage. The reference is smoothed according to its noise. The part of that
/// noise that reaches the signal counts as noise of the signal. Noise is estimated from second differences, so that
/// only changes from sample to sample count as noise. Errors that last longer count as a gap between simulator and
/// recording.
///
/// ```
/// use stretch_data::{Channel, SessionTrial, Trial};
/// use stretch_problem::{GaugeSetup, GaugeSimulator};
/// use stretch_gap::{Options, VerdictKind, diagnose};
/// use stretch_sim::Catalogue;
/// // A sensor that shows 0.05 s late what a rod does.
/// let rod = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
/// let time_s: Vec<f64> = (0..4000).map(|i| 0.01 * i as f64).collect();
/// let noise = |i: usize| 1e-3 * ((i * i * 7919) % 1000) as f64 / 1000.0;
/// let channel = |name: &str, values| Channel { name: name.into(), values };
/// let length = time_s.iter().map(|t| rod(*t)).collect();
/// let signal = time_s.iter().enumerate().map(|(i, t)| 0.02 * rod(t - 0.05) + noise(i)).collect();
/// let channels = vec![channel("rod_mm", length), channel("s1", signal)];
/// let trial = Trial { name: "rod.csv".into(), time_s, channels };
/// let trials = [SessionTrial::new(trial)];
/// let gauge = GaugeSimulator::new(&GaugeSetup {
///     trials: &trials,
///     reference: "rod_mm",
///     signal: "s1",
///     rig: None,
///     catalogue: &Catalogue::default(),
/// })?;
/// let (diagnosis, _) = diagnose(&gauge, &Options::default(), &|_| (), &|| false)?;
/// assert_eq!(diagnosis.verdict, VerdictKind::Effect);
/// assert_eq!(diagnosis.named, ["channel_skew"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct GaugeSimulator {
    about: Description,
    /// The gauge as shipped, with the effects that the gauge already has.
    nominal: GaugeRig,
    rows: Vec<&'static Effect>,
    session: GaugeSession,
    /// The smoothed reference of each trial, which drives the gauge.
    inputs: Vec<Smoothed>,
    draws: Draws,
    /// Column of the reference.
    reference: String,
    reference_noise: Noise,
    /// Noise of the signal, one standard deviation.
    noise: f64,
    /// Range of the signal.
    spread: f64,
    /// The measured signal from which effects may be estimated.
    found_in: FitRecord,
    notes: Vec<String>,
}

impl GaugeSimulator {
    /// Binds a gauge to trials and two of their columns. Effects of the catalogue that can act in a
    /// gauge and that this gauge does not have are looked for.
    ///
    /// # Errors
    /// Columns that are missing, dead, hold too few numbers or look swapped.
    pub fn new(setup: &GaugeSetup<'_>) -> Result<Self, ProblemError> {
        let GaugeSetup { trials, reference, signal, rig, catalogue } = *setup;
        let session = GaugeSession::read(trials, reference, signal)?;
        let nominal = nominal(&session, rig);
        let (least, greatest) = session.range(&session.signal);
        let (reference_noise, noise) =
            (session.noise(&session.reference), session.noise(&session.signal).sd());
        let smooth = |range: Range<usize>| {
            let allowed = unscheduled(range.len());
            Smoothed::of(&session.reference[range], reference_noise.sd(), &allowed)
        };
        let inputs: Vec<Smoothed> =
            TrialSpec::ranges(&session.trials).into_iter().map(smooth).collect();
        let alone = alone(&session);
        let has_pressure = nominal.spec.pressure_scale.is_some();
        let is_missing = |e: &&Effect| nominal.effects.find(e.name).is_none();
        let place = |effect: &Effect| Place {
            touches: vec![0],
            search: Gauge::search(effect, &alone),
            unit: Gauge::unit,
        };
        let missing = catalogue.iter().filter(|e| Gauge::accepts(e, has_pressure) && is_missing(e));
        let mut notes = session.notes.clone();
        let (rows, places) = shown(missing.map(|e| (e, place(e))), session.dt_s, &mut notes);
        let effects =
            rows.iter().zip(places).map(|(effect, place)| spec_of(effect, place)).collect();
        let stage =
            StageSpec::new("sensing", signal, unit_of(signal), &[OFFSET, GAIN, INITIAL_STATE]);
        let parameters = parameters(&nominal, signal, rig.is_some());
        let (trials, dt_s) = (session.trials.clone(), session.dt_s);
        let about = DescriptionSpec { stages: vec![stage], parameters, effects, trials, dt_s };
        let about = Description::new(about)?;
        let known = facts(&about, reference, &session, &inputs);
        Ok(Self {
            about: about.with_record(known)?,
            rows,
            inputs,
            reference: reference.into(),
            draws: Draws::new(),
            reference_noise,
            noise,
            spread: greatest - least,
            found_in: FitRecord::of(&session.trials, &session.signal, dt_s),
            notes,
            session,
            nominal,
        })
    }

    /// Notes from reading the recordings, in sentences.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn nominal(&self, model: &Model) -> GaugeSpec {
        GaugeSpec {
            offset: model.parameters[OFFSET],
            gain: model.parameters[GAIN],
            ..self.nominal.spec
        }
    }

    /// The signal over the trials of a run.
    fn signal(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), ProblemError> {
        let acting = Acting::of(&self.nominal.effects, &self.rows, run.model)?;
        let gauge = Gauge::new(self.nominal(run.model), &acting.inside, self.about.dt_s)?;
        let mut memory = gauge.memory();
        // The motion of the gauge before the session is unknown.
        let mut start = Start::Hysteresis(run.model.parameters[INITIAL_STATE]);
        let mut from = 0;
        for (i, trial) in self.session.trials[..run.trials].iter().enumerate() {
            let to = from + trial.samples;
            let input = match run.input_noise {
                None => self.inputs[i].values.clone(),
                Some(seed) => self.draws.with_noise(&self.inputs, &self.reference_noise, seed, i),
            };
            let pressure = self.session.pressure.get(from..to).unwrap_or(&[]);
            gauge.run(&mut memory, start, trial.start_s, &input, pressure, &mut out[from..to])?;
            let record = self.found_in.of_trial(i, self.noise, self.spread);
            acting.follow(record, &mut out[from..to]);
            let next = self.session.trials.get(i + 1).map_or(f64::INFINITY, |t| t.start_s);
            let rest_s = (next - trial.start_s - trial.samples as f64 * self.about.dt_s).max(0.0);
            start = Start::Carried { rest_s };
            from = to;
        }
        match out.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(ProblemError::NotFinite { stage: "sensing".into() }),
        }
    }
}

impl Simulator for GaugeSimulator {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, _stage: usize) -> &[f64] {
        &self.session.signal
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(self.signal(run, out)?)
    }

    fn lines(&self, _stage: usize, model: &Model) -> Vec<Line> {
        lines(&self.nominal.effects, &self.rows, model, self.spread)
    }
}

/// The gauge of a rig file. Without a rig file it is a gauge that is estimated from the recording, with offset and gain
/// free.
fn nominal(session: &GaugeSession, rig: Option<&GaugeRig>) -> GaugeRig {
    let (low, high) = session.range(&session.reference);
    let (least, greatest) = session.range(&session.signal);
    let scale = (!session.pressure.is_empty()).then(|| session.range(&session.pressure).1);
    let pressure_scale = scale.filter(|scale| *scale > 0.0);
    if let Some(rig) = rig {
        let mut rig = rig.clone();
        rig.spec.pressure_scale = rig.spec.pressure_scale.or(pressure_scale);
        return rig;
    }
    let mut spec =
        GaugeSpec { zero: low, span: high - low, offset: 0.0, gain: 1.0, pressure_scale };
    (spec.offset, spec.gain) = line(session, &spec);
    let free = Tolerance::Absolute(3.0 * (greatest - least));
    GaugeRig { spec, offset: free, gain: free, effects: EffectSet::new() }
}

fn parameters(rig: &GaugeRig, signal: &str, is_evidence: bool) -> Vec<ParameterSpec> {
    let parameter = |name: &str, nominal: f64, tolerance: Tolerance| ParameterSpec {
        is_evidence,
        ..ParameterSpec::new(name, unit_of(signal), nominal).within(tolerance.sd(nominal))
    };
    vec![
        parameter("offset", rig.spec.offset, rig.offset),
        parameter("gain", rig.spec.gain, rig.gain),
        ParameterSpec {
            is_evidence: false,
            ..ParameterSpec::new("initial_state", "1", 0.0).within(1.0 / 3.0)
        },
    ]
}

fn alone(session: &GaugeSession) -> Alone {
    let longest = session.fitted().max_by_key(ExactSizeIterator::len).unwrap_or(0..0);
    Alone {
        session_s: session_s(&session.trials, session.dt_s),
        lag_s: lag_s(&session.reference[longest.clone()], &session.signal[longest], session.dt_s),
    }
}

/// Offset and gain of the straight line of the signal over e, in the trials that are fitted.
fn line(session: &GaugeSession, spec: &GaugeSpec) -> (f64, f64) {
    let pairs = || {
        session.fitted().flat_map(|r| {
            let e = session.reference[r.clone()].iter().map(|x| (x - spec.zero) / spec.span);
            e.zip(&session.signal[r])
        })
    };
    let (n, e, y) = pairs().fold((0.0, 0.0, 0.0), |(n, a, b), (e, y)| (n + 1.0, a + e, b + y));
    let (e, y) = (e / n, y / n);
    let (ee, ey) = pairs()
        .fold((0.0, 0.0), |(ee, ey), (x, z)| (ee + (x - e) * (x - e), ey + (x - e) * (z - y)));
    let gain = if ee > 0.0 && ey != 0.0 { ey / ee } else { 1.0 };
    (y - gain * e, gain)
}

/// Longest lag that is looked for, s.
const REACH_S: f64 = 1.0;

/// Time by which `y` trails `x`, s: the lag within [`REACH_S`] at which `x` and `y` correlate best.
fn lag_s(x: &[f64], y: &[f64], dt_s: f64) -> f64 {
    let reach = ((REACH_S / dt_s) as usize).min(x.len() / 4);
    if reach == 0 {
        return 0.0;
    }
    let centre = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let middle = centre(&y[reach..y.len() - reach]);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = |shift: usize| {
        let there = centre(&x[shift..shift + middle.len()]);
        let power = dot(&there, &there).max(f64::MIN_POSITIVE);
        dot(&there, &middle).powi(2) / power
    };
    let best = (0..=2 * reach).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(reach);
    (reach as f64 - best as f64) * dt_s
}

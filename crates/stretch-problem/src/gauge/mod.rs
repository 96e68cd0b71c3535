//! A gauge alone: a stretch sensor with a reference, without the rest of the rig. It is a simulator of one stage.

mod experiments;
mod facts;
mod fixed;
mod session;
mod source;

use stretch_data::{SessionTrial, unit_of};
use stretch_gap::{
    Description, GapError, Line, Model, Noise, ParameterSpec, Run, Simulator, StageSpec,
};
use stretch_metrics::lag;
use stretch_sim::{
    Alone, Catalogue, Effect, EffectSet, Gauge, GaugeRig, GaugeSpec, Start, Tolerance,
};

use facts::facts;
use session::{REFERENCE, SIGNAL, noise, pressure};

use crate::{
    bench::{
        Bench, Place,
        columns::Columns,
        smooth::{MeasuredInput, Smoothed, unscheduled},
        straight_line,
    },
    error::ProblemError,
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
/// assert_eq!(diagnosis.verdict(), VerdictKind::Effect);
/// assert_eq!(diagnosis.named(), ["channel_skew"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct GaugeSimulator {
    bench: Bench,
    /// The gauge as shipped.
    spec: GaugeSpec,
    /// Tolerances of offset and gain.
    tolerances: [Tolerance; 2],
    /// The smoothed reference, which drives the gauge.
    input: MeasuredInput,
}

impl GaugeSimulator {
    /// Binds a gauge to trials and two of their columns. Effects of the catalogue that can act in a
    /// gauge and that this gauge does not have are looked for.
    ///
    /// # Errors
    /// Columns that are missing, dead, hold too few numbers or look swapped.
    pub fn new(setup: &GaugeSetup<'_>) -> Result<Self, ProblemError> {
        let GaugeSetup { trials, reference, signal, rig, catalogue } = *setup;
        let columns = session::read(trials, reference, signal)?;
        let is_evidence = rig.is_some();
        let rig = nominal(&columns, rig);
        let [x, y] = [REFERENCE, SIGNAL].map(|column| &columns.values[column]);
        let (least, greatest) = columns.range(y);
        let [x_noise, y_noise] = [x, y].map(|values| noise(&columns, values));
        let input = smoothed(&columns, x, x_noise);
        let alone = alone(&columns, rig.spec.gain);
        let has_pressure = rig.spec.pressure_scale.is_some();
        let place = |effect: &'static Effect| {
            let (touches, search) = (vec![0], Gauge::search(effect, &alone));
            (effect, Place { touches, search, unit: Gauge::unit })
        };
        let stages = vec![StageSpec::new(
            "sensing",
            signal,
            &unit_of(signal),
            &[OFFSET, GAIN, INITIAL_STATE],
        )];
        let parameters = parameters(&rig, signal, is_evidence);
        let candidates = catalogue.iter().filter(|e| Gauge::accepts(e, has_pressure)).map(place);
        let sensor = (y_noise.sd(), greatest - least);
        let GaugeRig { spec, offset, gain, effects } = rig;
        let known = |bench: &Bench| facts(bench, input.values());
        let described = (stages, parameters);
        let bench = Bench::new(described, columns, effects, candidates, sensor, known)?;
        Ok(Self { bench, spec, tolerances: [offset, gain], input })
    }

    /// The gauge with the offset and the gain of a model.
    fn tuned(&self, model: &Model) -> GaugeSpec {
        let [offset, gain] = [OFFSET, GAIN].map(|index| model.parameters[index]);
        GaugeSpec { offset, gain, ..self.spec }
    }

    /// The signal over the trials of a run.
    fn signal(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), ProblemError> {
        let Columns { trials, ranges, dt_s, .. } = &self.bench.columns;
        let acting = self.bench.acting(run.model)?;
        let gauge = Gauge::new(self.tuned(run.model), &acting.inside, *dt_s)?;
        let pressure = pressure(&self.bench.columns);
        let mut memory = gauge.memory();
        // The motion of the gauge before the session is unknown.
        let mut start = Start::Hysteresis(run.model.parameters[INITIAL_STATE]);
        for (i, trial) in trials[..run.trials].iter().enumerate() {
            let own = &mut out[ranges[i].clone()];
            let input = self.input.trial(i, run.input_noise);
            let pressure = pressure.get(ranges[i].clone()).unwrap_or(&[]);
            gauge.run(&mut memory, start, trial.start_s, &input, pressure, own)?;
            acting.follow(self.bench.record(i), own);
            let next = trials.get(i + 1).map_or(f64::INFINITY, |t| t.start_s);
            let rest_s = (next - trial.start_s - trial.samples as f64 * dt_s).max(0.0);
            start = Start::Carried { rest_s };
        }
        Ok(())
    }
}

impl Simulator for GaugeSimulator {
    fn description(&self) -> &Description {
        &self.bench.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.bench.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(self.signal(run, out)?)
    }

    fn lines(&self, _stage: usize, model: &Model) -> Vec<Line> {
        self.bench.lines(model)
    }
}

/// The reference, smoothed as far as its noise allows.
fn smoothed(columns: &Columns, reference: &[f64], noise: Noise) -> MeasuredInput {
    let smooth = |range: &std::ops::Range<usize>| {
        Smoothed::of(&reference[range.clone()], noise.sd(), &unscheduled(range.len()))
    };
    MeasuredInput::new(columns.ranges.iter().map(smooth).collect(), noise)
}

/// The gauge of a rig file. Without a rig file it is a gauge that is estimated from the recording, with offset and gain
/// free.
fn nominal(columns: &Columns, rig: Option<&GaugeRig>) -> GaugeRig {
    let [(low, high), (least, greatest)] =
        [REFERENCE, SIGNAL].map(|column| columns.range(&columns.values[column]));
    let pressure = pressure(columns);
    let scale = (!pressure.is_empty()).then(|| columns.range(pressure).1);
    let pressure_scale = scale.filter(|scale| *scale > 0.0);
    if let Some(rig) = rig {
        let mut rig = rig.clone();
        rig.spec.pressure_scale = rig.spec.pressure_scale.or(pressure_scale);
        return rig;
    }
    let mut spec =
        GaugeSpec { zero: low, span: high - low, offset: 0.0, gain: 1.0, pressure_scale };
    (spec.offset, spec.gain) = line(columns, &spec);
    let free = Tolerance::Absolute(3.0 * (greatest - least));
    GaugeRig { spec, offset: free, gain: free, effects: EffectSet::new() }
}

fn parameters(rig: &GaugeRig, signal: &str, is_evidence: bool) -> Vec<ParameterSpec> {
    let parameter = |name: &str, nominal: f64, tolerance: Tolerance| ParameterSpec {
        is_evidence,
        ..ParameterSpec::new(name, &unit_of(signal), nominal).within(tolerance.sd(nominal))
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

/// Longest lag that is looked for, s.
const REACH_S: f64 = 1.0;

/// The length of the session, and the time by which the signal trails the reference.
fn alone(columns: &Columns, gain: f64) -> Alone {
    let longest = columns.fitted().max_by_key(ExactSizeIterator::len).unwrap_or(0..0);
    let reach = ((REACH_S / columns.dt_s) as usize).min(longest.len() / 4);
    let [x, y] = [REFERENCE, SIGNAL].map(|column| &columns.values[column][longest.clone()]);
    // The signal may fall while the reference rises.
    let rising: Vec<f64> = y.iter().map(|y| gain.signum() * y).collect();
    let samples = lag(x, &rising, reach).map_or(0.0, |lag| lag.samples);
    Alone { session_s: columns.session_s(), lag_s: samples * columns.dt_s }
}

/// Offset and gain of the straight line of the signal over e, in the trials that are fitted.
fn line(columns: &Columns, spec: &GaugeSpec) -> (f64, f64) {
    let [x, y] = [REFERENCE, SIGNAL].map(|column| &columns.values[column]);
    let e = |x: &f64| (x - spec.zero) / spec.span;
    let pairs =
        || columns.fitted().flat_map(|r| x[r.clone()].iter().map(e).zip(y[r].iter().copied()));
    straight_line(pairs, 1.0)
}

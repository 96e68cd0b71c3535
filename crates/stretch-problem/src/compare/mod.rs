//! Compares two recordings of the same quantity. The first recording plays the simulator of the
//! second one, with a gain, an offset, a delay and a clock rate as its parameters.

mod alignment;
mod numbers;

use std::sync::Arc;

use stretch_data::{
    Channel, EvenSession, EvenTrial, SessionTrial, Trial, column_meant, ends, listed, unit, unit_of,
};
use stretch_effects::{ClockDrift, Grid, Operator, Span};
use stretch_gap::{Noise, ParameterShift, SliceGap, units_of_factor};
use stretch_sim::Tolerance;

use crate::{
    bench::{
        columns::shortest,
        shortened::shortened,
        smooth::{MeasuredInput, Smoothed, unscheduled},
    },
    black_box::{
        Ask, BlackBox, Checked, Parameter, ProblemSpec, RecordedSession, Source, StageEntry,
        closure,
    },
    error::ProblemError,
    examine::Examined,
    fix::COVERS,
    problem::Problem,
};
use alignment::{LATE, Likeness, aligned, base_s, merged, reach, too_short};
pub use numbers::{Compared, Estimate, Octave};

/// Tolerance of the clock rate, s/s: good recorders differ by 1e-4, time stamps of a rounded rate by more.
const CLOCK: f64 = 1e-3;
/// Least number of common samples.
const LEAST: usize = 200;
/// Least correlation of two recordings of one motion.
const ALIKE: f64 = 0.5;
/// Smallest noise, as a share of the range: interpolation between samples is no more accurate.
const FLOOR: f64 = 1e-4;
/// Parameters of each compared column.
const PARAMETERS: [&str; 4] = ["gain", "offset", "delay", "clock"];

/// Two recordings of the same quantities on one clock.
///
/// ```
/// use stretch_data::{Channel, Trial};
/// use stretch_gap::{Options, RandomGenerator};
/// use stretch_problem::Pair;
/// let mut random = RandomGenerator::new(1, 0);
/// let knee = |t: f64| 40.0 + 20.0 * (1.3 * t).sin() + 10.0 * (3.1 * t).sin();
/// let mut log = |name: &str, of: &dyn Fn(f64) -> f64| {
///     let time_s: Vec<f64> = (0..4000).map(|i| 0.01 * f64::from(i)).collect();
///     let values = time_s.iter().map(|t| of(*t) + 0.05 * random.gauss()).collect();
///     Trial { name: name.into(), time_s, channels: vec![Channel { name: "knee_deg".into(), values }] }
/// };
/// let (a, b) = (log("a.csv", &knee), log("b.csv", &|t| 1.7 * knee(t - 0.035)));
/// let pair = Pair::new(&a, &b, &[])?;
/// let problem = pair.problem()?;
/// let examined = problem.examine(&Options::default(), false, &|_| (), &|| false)?;
/// let [knee] = &pair.compared(&examined)[..] else { panic!() };
/// assert!((knee.gain.value - 1.7).abs() < 0.01 && (knee.delay_s.value - 0.035).abs() < 0.002);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Pair {
    names: [String; 2],
    /// Compared columns, of the first and of the second recording.
    columns: Vec<[String; 2]>,
    /// Columns of the first recording, by part. A part extends those of the second recording by
    /// `margin` samples on both sides.
    parts: Vec<Vec<Vec<f64>>>,
    margin: usize,
    grid: Grid,
    /// The second recording as a problem.
    spec: ProblemSpec,
    /// Delay of the second recording that the alignment removed, s.
    shift_s: f64,
    /// Correlation of each column at the best lag.
    correlations: Vec<f64>,
    /// Whether the two columns are equal in every sample.
    are_equal: Vec<bool>,
    /// Middle of the session, s. The delay is that in the middle.
    middle_s: f64,
}

impl Pair {
    /// Brings two recordings onto one clock: the time in which both were recorded, at the sample
    /// times of the slower one. The recordings are shifted if this makes them much more alike.
    ///
    /// `columns` are the compared columns, each as `column` or `first=second`. If there are none,
    /// all columns with the same name are compared, except those that are constant or not alike.
    ///
    /// # Errors
    /// Columns that are missing, constant or not alike, and recordings without a common time.
    pub fn new(a: &Trial, b: &Trial, columns: &[String]) -> Result<Self, ProblemError> {
        let chosen = chosen(a, b, columns)?;
        let (shift_s, mut notes) = aligned(a, b, &chosen)?;
        let base_s = base_s(a, b);
        let both = [SessionTrial::new(merged(a, b, &chosen, base_s + shift_s))];
        let (trials, cut) = shortened(&both, chosen.len())?;
        notes.extend(cut);
        let asked: Vec<&str> = trials[0].trial.channels.iter().map(|c| c.name.as_str()).collect();
        let session = EvenSession::new(&trials, &asked, shortest(&trials))?;
        notes.extend_from_slice(session.notes());
        let dt_s = session.dt_s();
        let samples = |t: &EvenTrial| t.columns()[0].len();
        let longest = session.trials().iter().map(samples).max().unwrap_or(0);
        let margin = reach(dt_s, LATE.0).min(longest / 8);
        let is_long = |t: &&EvenTrial| samples(t) >= shortest(&trials) + 2 * margin;
        let kept: Vec<&EvenTrial> = session.trials().iter().filter(is_long).collect();
        let is_enough = kept.iter().map(|t| samples(t)).sum::<usize>() >= LEAST;
        let last = kept.last().filter(|_| is_enough);
        let last = last.ok_or_else(|| too_short(a, b, longest as f64 * dt_s))?;
        let trial = |part: &&EvenTrial| {
            let time_s = (0..samples(part) - 2 * margin).map(|i| i as f64 * dt_s).collect();
            let trial = Trial { name: part.name().to_owned(), time_s, channels: Vec::new() };
            let start_s = part.start_s() + margin as f64 * dt_s;
            SessionTrial { start_s, ..SessionTrial::new(trial) }
        };
        let mut pair = Self {
            names: [a.name.clone(), b.name.clone()],
            columns: Vec::new(),
            parts: vec![Vec::new(); kept.len()],
            margin,
            grid: Grid::samples(dt_s)?,
            spec: ProblemSpec {
                wrap: vec!["output.all".into()],
                // the parameters delay and clock do the same
                without: vec!["skew".into(), "clock_drift".into()],
                trials: kept.iter().map(trial).collect(),
                ..ProblemSpec::default()
            },
            shift_s,
            correlations: Vec::new(),
            are_equal: Vec::new(),
            middle_s: 0.5 * (last.start_s() + samples(last) as f64 * dt_s),
        };
        let mut unlike = Vec::new();
        for (at, names) in chosen.iter().enumerate() {
            let turn = session.turns()[2 * at].zip(session.turns()[2 * at + 1]);
            let [mut xs, ys] = [0, 1]
                .map(|i| kept.iter().map(|t| t.columns()[2 * at + i].clone()).collect::<Vec<_>>());
            for (x, y) in xs.iter_mut().zip(&ys) {
                // unwrapped angles begin at any turn
                let turns = turn.map_or(0.0, |(turn, _)| turn * ((y[0] - x[0]) / turn).round());
                x.iter_mut().for_each(|x| *x += turns);
            }
            unlike.extend(pair.add(names, chosen.len() == 1, &xs, &ys).err());
        }
        if pair.columns.is_empty() || (!columns.is_empty() && !unlike.is_empty()) {
            let hint =
                "compare recordings of one motion, or choose other columns with --signal A=B";
            return Err(ProblemError::Refused(format!("{}; {hint}", listed(&unlike))));
        }
        notes.extend(unlike.into_iter().map(|unlike| format!("{unlike}; they are left out")));
        pair.spec.trials[0].notes = notes;
        Ok(pair)
    }

    /// Adds a column, given by parts, unless the recordings show no common motion.
    fn add(
        &mut self,
        names: &[String; 2],
        is_alone: bool,
        xs: &[Vec<f64>],
        ys: &[Vec<f64>],
    ) -> Result<(), String> {
        let (x, y, dt_s) = (xs.concat(), ys.concat(), self.grid.dt_s());
        let likeness = Likeness::of(&x, &y, self.margin);
        if likeness.r.abs() < ALIKE {
            let [a, b] = [0, 1].map(|i| named(&self.names[i], &names[i]));
            let r = likeness.r;
            return Err(format!("{a} and {b} do not show the same motion (correlation {r:.2})"));
        }
        // Otherwise, an effect that smooths the noise of the first column would close a gap.
        let noise = Noise::of_differences(xs.iter().map(Vec::as_slice), dt_s);
        let smooth = |x: &Vec<f64>| Smoothed::of(x, noise.sd(), &unscheduled(x.len()));
        let smooth = MeasuredInput::new(xs.iter().map(smooth).collect(), noise.clone());
        let values = smooth.values();
        let removed = x.iter().zip(&values).map(|(x, smooth)| (x - smooth).powi(2)).sum::<f64>();
        let kept = (noise.sd().powi(2) - removed / x.len() as f64).max(0.0).sqrt();
        let line = likeness.line(&values, &y);
        self.spec.stages.push(line.stage(&names[1], &y, kept, dt_s));
        self.spec.parameters.extend(line.parameters(&names[1], is_alone, dt_s));
        self.columns.push(names.clone());
        self.correlations.push(likeness.r);
        self.are_equal.push(x == y);
        for (at, y) in ys.iter().enumerate() {
            self.parts[at].push(smooth.trial(at, None));
            let values = y[self.margin..y.len() - self.margin].to_vec();
            let channel = Channel { name: names[1].clone(), values };
            self.spec.trials[at].trial.channels.push(channel);
        }
        Ok(())
    }

    /// The second recording as a problem without its source.
    pub fn spec(&self) -> &ProblemSpec {
        &self.spec
    }

    /// The first recording as the source of the problem.
    pub fn source(&self, session: &RecordedSession) -> Arc<dyn Source> {
        let (pair, session) = (self.clone(), session.clone());
        Arc::new(closure(move |ask: &Ask<'_>| {
            let [gain, offset, delay_s, rate] =
                std::array::from_fn(|i| ask.parameters[PARAMETERS.len() * ask.stage + i]);
            let clock = ClockDrift::new(delay_s - rate * pair.middle_s, rate, &pair.grid);
            let mut out = Vec::new();
            for (part, to) in pair.parts.iter().zip(&session.trials[..ask.trials]) {
                let mut signal = part[ask.stage].clone();
                let start_s = to.start_s - pair.margin as f64 * pair.grid.dt_s();
                let span = Span { start_s, ..Span::whole(&pair.grid) };
                clock.run(&span, &mut [], &mut signal);
                let kept = pair.margin..pair.margin + to.samples.len();
                out.extend(signal[kept].iter().map(|x| gain * x + offset));
            }
            Ok(out)
        }))
    }

    /// The problem that compares the recordings.
    ///
    /// # Errors
    /// Those of [`Checked::new`].
    pub fn problem(&self) -> Result<Problem, ProblemError> {
        let checked = Checked::new(self.spec.clone())?;
        let source = self.source(checked.session());
        Ok(Problem::from(BlackBox::new(checked, source)).named(self.names.join(" and ")))
    }

    /// The numbers of a comparison, by column.
    pub fn compared(&self, examined: &Examined) -> Vec<Compared> {
        (0..self.columns.len()).map(|stage| self.compared_column(examined, stage)).collect()
    }

    fn compared_column(&self, examined: &Examined, stage: usize) -> Compared {
        let diagnosis = &examined.diagnosis;
        let [a, b] = self.columns[stage].clone();
        let own = &self.spec.parameters[PARAMETERS.len() * stage..][..PARAMETERS.len()];
        let shifts = own.iter().map(|p| diagnosis.parameters.iter().find(|s| s.name == p.name));
        let shifts: Vec<Option<&ParameterShift>> = shifts.collect();
        let estimate = |at: usize, by: f64| {
            let (value, sd) = shifts[at].map_or((own[at].value, 0.0), |s| (s.fitted, s.sd));
            let value = value + by;
            Estimate { value, interval: [value - COVERS * sd, value + COVERS * sd] }
        };
        let evidence = &examined.evidence.stages[stage];
        let trials = self.spec.trials.iter().map(|t| &t.trial.channels[stage].values);
        let measured: Vec<f64> = trials.flatten().copied().collect();
        let rms = |simulated: &[f64]| {
            let squares = measured.iter().zip(simulated).map(|(m, s)| (m - s).powi(2));
            (squares.sum::<f64>() / measured.len() as f64).sqrt()
        };
        let is_octave = |slice: &&SliceGap| {
            slice.by == "frequency" && slice.stage == diagnosis.location.stages[stage].stage
        };
        let times = |excess: f64| (1.0 + excess).max(0.0).sqrt();
        let octave = |slice: &SliceGap| Octave {
            frequencies: slice.slice.clone(),
            left: times(slice.excess),
            interval: slice.excess_ci.map(times),
        };
        let gain = estimate(0, 0.0);
        let (low, high) = ends(&measured);
        let mut compared = Compared {
            unit: unit_of(&b),
            units: units_of_factor(gain.value, [&unit_of(&a), &unit_of(&b)]),
            gain,
            offset: estimate(1, 0.0),
            delay_s: estimate(2, self.shift_s),
            clock_rate: estimate(3, 0.0),
            correlation: self.correlations[stage],
            range: high - low,
            difference: rms(&evidence.raw),
            left: rms(&evidence.retuned),
            noise: evidence.noise,
            octaves: diagnosis.location.slices.iter().filter(is_octave).map(octave).collect(),
            sentence: String::new(),
            a,
            b,
        };
        compared.sentence = match self.are_equal[stage] {
            true => format!(
                "{} equals {} in every sample.",
                named(&self.names[1], &compared.b),
                named(&self.names[0], &compared.a)
            ),
            false => compared.in_words([&self.names[0], &self.names[1]]),
        };
        compared
    }
}

/// A rough line through two columns, from which noise and tolerances are estimated.
struct Line {
    gain: f64,
    offset: f64,
    left: Vec<f64>,
}

impl Line {
    fn stage(&self, column: &str, y: &[f64], kept_noise: f64, dt_s: f64) -> StageEntry {
        let (low, high) = ends(y);
        let noise = Noise::of_differences(std::iter::once(&self.left[..]), dt_s).sd();
        let noise = noise.hypot(self.gain * kept_noise);
        StageEntry {
            name: column.into(),
            output: column.into(),
            noise: Some(noise.max(FLOOR * (high - low))),
            ..StageEntry::default()
        }
    }

    /// The parameters of a column. Their tolerances are so wide that they hardly matter.
    fn parameters(&self, column: &str, is_alone: bool, dt_s: f64) -> [Parameter; 4] {
        let unit = unit_of(column);
        let (low, high) = ends(&self.left);
        let values = [
            (1.0, (self.gain - 1.0).abs().max(1.0), ""),
            (0.0, self.offset.abs().max(high - low), unit.as_str()),
            (0.0, reach(dt_s, LATE.0) as f64 * dt_s, "s"),
            (0.0, CLOCK, "s/s"),
        ];
        std::array::from_fn(|i| {
            let (value, sd, unit) = values[i];
            let name = PARAMETERS[i];
            Parameter {
                name: if is_alone { name.into() } else { format!("{column}.{name}") },
                unit: unit.into(),
                value,
                tolerance: Tolerance::Absolute(sd),
                stages: vec![column.into()],
                ..Parameter::default()
            }
        })
    }
}

/// A column of a recording, in words.
fn named(recording: &str, column: &str) -> String {
    format!("{column} of {recording}")
}

/// The columns that are compared: those asked for, or all with the same name, or the only ones.
fn chosen(a: &Trial, b: &Trial, asked: &[String]) -> Result<Vec<[String; 2]>, ProblemError> {
    let names = |trial: &Trial| trial.channels.iter().map(|c| c.name.clone()).collect::<Vec<_>>();
    let is_constant = |trial: &Trial, name: &str| {
        trial.channel(name).is_some_and(|values| values.iter().all(|x| *x == values[0]))
    };
    let mut out = Vec::new();
    for one in asked {
        let (first, second) = one.split_once('=').unwrap_or((one, one));
        let pair = [a.full_name(first).to_owned(), b.full_name(second).to_owned()];
        a.require(&pair[0])?;
        b.require(&pair[1])?;
        out.push(pair);
    }
    let (own, other) = (names(a), names(b));
    if asked.is_empty() {
        let stem = |name: &str| {
            unit(name).map_or(name, |unit| &name[..name.len() - unit.len()]).to_owned()
        };
        out.extend(own.iter().filter_map(|name| {
            let same = other.iter().find(|o| *o == name).map(String::as_str);
            let same = same.or_else(|| column_meant(&stem(name), other.iter().map(String::as_str)));
            Some([name.clone(), same?.to_owned()])
        }));
        if let (true, [first], [second]) = (out.is_empty(), &own[..], &other[..]) {
            out.push([first.clone(), second.clone()]);
        }
    }
    let constant = |[first, second]: &[String; 2]| {
        let first = is_constant(a, first).then(|| named(&a.name, first));
        first.or_else(|| is_constant(b, second).then(|| named(&b.name, second)))
    };
    let dead = out.iter().find_map(constant);
    if asked.is_empty() {
        out.retain(|pair| constant(pair).is_none());
    }
    match dead.filter(|_| out.is_empty() || !asked.is_empty()) {
        Some(dead) => Err(ProblemError::Refused(format!(
            "{dead} is constant: there is no motion to compare; choose another column with --signal A=B"
        ))),
        None if out.is_empty() => Err(ProblemError::Refused(format!(
            "{} and {} have no column with the same name: the first has {}, the second {}; choose with --signal A=B, as in --signal {}={}",
            a.name,
            b.name,
            listed(&own),
            listed(&other),
            own.first().map_or("A", String::as_str),
            other.first().map_or("B", String::as_str),
        ))),
        None => Ok(out),
    }
}

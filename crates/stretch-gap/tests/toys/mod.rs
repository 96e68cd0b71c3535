//! Simulators whose correct diagnosis is known: a line, a lag, an oscillator or a delay, alone or in a chain. Their
//! recordings are computed by the same equations with other parameters, hidden effects and noise of a known size. The
//! source of a recording is called the bench.
//!
//! A [`Toy`] is plain data: a test changes fields and then computes the recording. Everything that depends on the trait
//! [`Simulator`] is in this folder. The unit tests of the crate use it as well.
//!
//! ```text
//! let toy = Toy { hidden: vec![(0, Effect::Quadratic, vec![0.1])], ..Toy::of(&[Law::Line]) };
//! let (diagnosis, evidence) = toy.measured(1).diagnosed();
//! ```

#![allow(dead_code, unused_imports)] // The integration tests and the unit tests each use only a part of this module.

mod laboratory;
mod laws;
mod simulator;

pub(crate) use laboratory::levels;
pub(crate) use laws::{Effect, Law};
pub(crate) use simulator::Measured;
use stretch_gap::{
    Description, DescriptionSpec, Diagnosis, Noise, Note, NoteCode, ParameterSpec, RandomGenerator,
    SlowDrift, StageSpec, TrialSpec,
};

/// The texts of the notes with a code.
pub(crate) fn noted(told: &Diagnosis, code: NoteCode) -> Vec<String> {
    told.notes.iter().filter(|note| note.code == code).map(Note::to_string).collect()
}

/// A simulator and its bench.
#[derive(Debug, Clone)]
pub(crate) struct Toy {
    /// Laws of the stages. The first stage is driven by the column `x`, every other by the measured output of the stage
    /// before.
    pub(crate) laws: Vec<Law>,
    /// Nominal parameters of all stages in order, with tolerances.
    pub(crate) parameters: Vec<ParameterSpec>,
    /// True values of the parameters.
    pub(crate) truth: Vec<f64>,
    /// Effects that the simulator may lack, each with its stage.
    pub(crate) catalogue: Vec<(usize, Effect)>,
    /// Effects of the bench, each with its stage and its values.
    pub(crate) hidden: Vec<(usize, Effect, Vec<f64>)>,
    /// Parameters that change on the bench: index, and the values that are added at every sample of all trials.
    pub(crate) courses: Vec<(usize, Vec<f64>)>,
    /// Standard deviation of the noise of every output.
    pub(crate) noise: f64,
    /// Noise that the simulator states, as a multiple of the true noise; `None` if it is estimated from the recording.
    pub(crate) stated: Option<f64>,
    /// Slow drift of the recorder that the simulator describes.
    pub(crate) recorder_drift: Option<SlowDrift>,
    /// Standard deviation of the noise of the recorded `x`.
    pub(crate) input_noise: f64,
    /// Number of samples of every trial, and whether it is a test trial.
    pub(crate) trials: Vec<(usize, bool)>,
    /// Sample time, s.
    pub(crate) dt_s: f64,
    /// Step of integration, s.
    pub(crate) step_s: f64,
    /// Factors on the values of `x` and of the outputs in the recording: 1000 changes volts to millivolts.
    pub(crate) units: [f64; 2],
    /// Budget of runs; `None` if runs are not counted.
    pub(crate) budget: Option<usize>,
    /// For each sample of all trials concatenated, whether it was lost (not measured); empty if all were measured.
    pub(crate) is_lost: Vec<bool>,
    /// Stages whose first parameter is shared with another stage: the stage, and the index of the shared parameter.
    pub(crate) shared: Vec<(usize, usize)>,
    /// How some runs fail.
    pub(crate) fails: Option<Fails>,
    /// Session time of the first trial, s.
    pub(crate) begins_s: f64,
}

/// How a simulator may fail.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Fails {
    /// Values of a parameter above a limit are refused.
    Above(usize, f64),
    /// The output is NaN.
    NotFinite,
    /// The output is NaN if a run has this effect and covers at least this number of trials.
    With(Effect, usize),
    /// The simulator is gone after this number of runs.
    GoneAfter(usize),
}

/// Session time from the start of a trial to the start of the next, s.
const APART_S: f64 = 60.0;

impl Toy {
    /// Creates a toy without effects that agrees with its bench, except for noise of 0.01. It has three trials of 10 s
    /// for fitting and one for testing.
    pub(crate) fn of(laws: &[Law]) -> Self {
        let named = |i: usize, p: ParameterSpec| {
            let own = p.name.rsplit('.').next().unwrap_or_default();
            ParameterSpec { name: format!("{}.{own}", stage_name(laws, i)), ..p }
        };
        let stages = laws.iter().enumerate();
        let parameters: Vec<ParameterSpec> = stages
            .flat_map(|(i, law)| law.parameters().into_iter().map(move |p| named(i, p)))
            .collect();
        Self {
            laws: laws.to_vec(),
            truth: parameters.iter().map(|p| p.nominal).collect(),
            parameters,
            catalogue: Vec::new(),
            hidden: Vec::new(),
            courses: Vec::new(),
            noise: 0.01,
            stated: Some(1.0),
            recorder_drift: None,
            input_noise: 0.0,
            trials: vec![(1000, false), (1000, false), (1000, false), (1000, true)],
            dt_s: 0.01,
            step_s: 0.0025,
            units: [1.0; 2],
            budget: None,
            is_lost: Vec::new(),
            shared: Vec::new(),
            fails: None,
            begins_s: 0.0,
        }
    }

    /// The same toy with some effects of the first stage in its catalogue.
    pub(crate) fn may_lack(self, effects: &[Effect]) -> Self {
        Self { catalogue: effects.iter().map(|effect| (0, *effect)).collect(), ..self }
    }

    /// The same toy with effects of the first stage on its bench.
    pub(crate) fn hiding(self, effects: &[(Effect, &[f64])]) -> Self {
        let hidden = effects.iter().map(|(effect, values)| (0, *effect, values.to_vec()));
        Self { hidden: hidden.collect(), ..self }
    }

    /// The same toy, with parameters of the bench that differ from the nominal ones by these numbers of tolerances.
    pub(crate) fn off_by(mut self, tolerances: &[f64]) -> Self {
        for ((truth, p), off) in self.truth.iter_mut().zip(&self.parameters).zip(tolerances) {
            *truth = p.nominal + off * p.sd;
        }
        self
    }

    /// Samples of all trials.
    pub(crate) fn samples(&self) -> usize {
        self.trials.iter().map(|(samples, _)| samples).sum()
    }

    /// Index of a parameter by its name, `line.gain`.
    pub(crate) fn parameter(&self, name: &str) -> usize {
        self.parameters.iter().position(|p| p.name == name).expect("a parameter of that name")
    }

    /// Name of an effect in the catalogue: its own name in the first stage, with the number of the stage in the others.
    pub(crate) fn name(stage: usize, effect: Effect) -> String {
        if stage == 0 { effect.name().to_owned() } else { format!("{}_{stage}", effect.name()) }
    }

    /// The description of the simulator, in the units of the toy.
    pub(crate) fn description(&self) -> Description {
        let stages = (0..self.laws.len()).map(|i| {
            let name = stage_name(&self.laws, i);
            let mut stage = StageSpec::new(&name, &format!("y{i}"), "u", &self.own(i));
            stage.recorder_drift = self.recorder_drift;
            stage.noise = self.stated.map(|times| Noise::known(times * self.noise * self.units[1]));
            stage
        });
        let trials = self.trials.iter().enumerate().map(|(i, (samples, is_test))| {
            TrialSpec::new(&format!("trial {i}"), *samples, self.start_s(i), *is_test)
        });
        let effects = self.catalogue.iter();
        Description::new(DescriptionSpec {
            stages: stages.collect(),
            parameters: self.parameters.iter().map(|p| self.in_units(p)).collect(),
            effects: effects.map(|(stage, effect)| effect.spec(*stage)).collect(),
            trials: trials.collect(),
            dt_s: self.dt_s,
        })
        .expect("a description that holds together")
    }

    /// Converts a parameter to the units of the toy.
    fn in_units(&self, p: &ParameterSpec) -> ParameterSpec {
        let unit = laws::unit(&p.unit, self.units);
        let mut p = p.clone();
        for value in [&mut p.nominal, &mut p.sd, &mut p.least, &mut p.greatest] {
            *value *= unit;
        }
        for value in [&mut p.per_trial_sd, &mut p.per_tick_sd].into_iter().flatten() {
            *value *= unit;
        }
        if let Some(drift) = &mut p.drift {
            drift.sd *= unit;
        }
        p
    }

    /// Computes the recording of the bench for a seed. In each trial, `x` is a sum of four tones within -1..1.
    pub(crate) fn measured(&self, seed: u64) -> Measured {
        let x = self.trials.iter().enumerate().flat_map(|(trial, (samples, _))| {
            let mut random = RandomGenerator::new(seed, 100 + trial as u64);
            let tones: Vec<[f64; 2]> = (0..4)
                .map(|k| [0.5 + 1.1 * f64::from(k) + 0.7 * random.unit(), 6.3 * random.unit()])
                .collect();
            let at = move |i: usize, dt_s: f64| {
                let t = dt_s * i as f64;
                0.25 * tones.iter().map(|[w, p]| (w * t + p).sin()).sum::<f64>()
            };
            let dt_s = self.dt_s;
            (0..*samples).map(move |i| at(i, dt_s)).collect::<Vec<f64>>()
        });
        self.driven_by(x.collect(), seed)
    }

    /// Computes the recording of the bench for the given input, which is within -1..1.
    pub(crate) fn driven_by(&self, x: Vec<f64>, seed: u64) -> Measured {
        assert_eq!(x.len(), self.samples(), "one sample of x for each of the trials");
        let mut random = RandomGenerator::new(seed, 7);
        let mut outputs: Vec<Vec<f64>> = Vec::new();
        for stage in 0..self.laws.len() {
            let input = outputs.last().unwrap_or(&x);
            let mut y = self.of_bench(stage, input);
            y.iter_mut().for_each(|y| *y += self.noise * random.gauss());
            outputs.push(y);
        }
        let x = x.iter().map(|x| self.units[0] * (x + self.input_noise * random.gauss())).collect();
        let outputs = outputs.into_iter().map(|y| y.iter().map(|y| self.units[1] * y).collect());
        Measured::new(self.clone(), x, outputs.collect())
    }

    /// Computes the noise-free output of a stage of the bench.
    fn of_bench(&self, stage: usize, input: &[f64]) -> Vec<f64> {
        let own = self.own(stage);
        let parameters: Vec<f64> = own.iter().map(|p| self.truth[*p]).collect();
        let effects: Vec<(Effect, &[f64])> = self
            .hidden
            .iter()
            .filter(|(s, _, _)| *s == stage)
            .map(|(_, effect, values)| (*effect, values.as_slice()))
            .collect();
        let mut out = vec![0.0; input.len()];
        for (trial, range) in self.ranges().into_iter().enumerate() {
            let courses: Vec<(usize, &[f64])> = self
                .courses
                .iter()
                .filter_map(|(p, course)| {
                    Some((own.iter().position(|q| q == p)?, &course[range.clone()]))
                })
                .collect();
            let bench = laws::Plant {
                parameters: &parameters,
                courses: &courses,
                effects: &effects,
                dt_s: self.dt_s,
                step_s: self.step_s,
                start_s: self.start_s(trial),
            };
            bench.run(self.laws[stage], &input[range.clone()], &mut out[range]);
        }
        out
    }

    /// Indices of a stage's parameters.
    pub(crate) fn own(&self, stage: usize) -> Vec<usize> {
        let count = |laws: &[Law]| laws.iter().map(|law| law.parameters().len()).sum();
        let from: usize = count(&self.laws[..stage]);
        let mut own: Vec<usize> = (from..from + self.laws[stage].parameters().len()).collect();
        if let Some((_, other)) = self.shared.iter().find(|(s, _)| *s == stage) {
            own[0] = *other;
        }
        own
    }

    /// Session time of a trial's first sample, s.
    fn start_s(&self, trial: usize) -> f64 {
        self.begins_s + APART_S * trial as f64
    }

    /// Range of the samples of every trial.
    pub(crate) fn ranges(&self) -> Vec<std::ops::Range<usize>> {
        let mut end = 0;
        let one = |(samples, _): &(usize, bool)| {
            end += samples;
            end - samples..end
        };
        self.trials.iter().map(one).collect()
    }
}

/// Name of a stage: that of its law, with the number of the stage if an earlier stage has the same law.
fn stage_name(laws: &[Law], stage: usize) -> String {
    let name = laws[stage].name();
    if laws[..stage].contains(&laws[stage]) { format!("{name}_{stage}") } else { name.to_owned() }
}

/// Draws an Ornstein-Uhlenbeck process (slow drift) with a standard deviation, a correlation time in s, a number of
/// samples and a sample time.
pub(crate) fn slow(
    sd: f64,
    correlation_s: f64,
    (samples, dt_s): (usize, f64),
    seed: u64,
) -> Vec<f64> {
    let mut random = RandomGenerator::new(seed, 55);
    let kept = (-dt_s / correlation_s).exp();
    let mut x = random.gauss();
    let next = |_| {
        x = kept * x + (1.0 - kept * kept).sqrt() * random.gauss();
        sd * x
    };
    (0..samples).map(next).collect()
}

/// Returns the smallest count that a binomial variable of `n` draws with probability `p` exceeds with a probability of
/// at most `chance`. Tests that count over seeds allow this count.
pub(crate) fn binomial_bound(n: usize, p: f64, chance: f64) -> usize {
    let (mut each, mut within) = ((1.0 - p).powi(n as i32), 0.0);
    for k in 0..=n {
        within += each;
        if 1.0 - within <= chance {
            return k;
        }
        each *= (n - k) as f64 / (k + 1) as f64 * p / (1.0 - p);
    }
    n
}

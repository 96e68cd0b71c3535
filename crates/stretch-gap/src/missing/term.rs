//! Terms that a simulator may lack: products of functions of recorded signals, which reach the
//! output directly or through a filter.
//!
//! A term is dimensionless, and its coefficient has the unit of the stage's output. Terms are
//! serialised ([`serde`]) together with the scales of their signals, so that they can be added to a
//! simulator.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stretch_effects::{Backlash, MeanReversion, Operator, Span, Start};

use crate::missing::term_inputs::{Signal, TermInputs};

/// A function of one signal's scaled rate v.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RateForm {
    /// v
    Linear,
    /// |v|
    Magnitude,
    /// v^2
    Square,
    /// v |v|
    SignedSquare,
    /// sign(v) sqrt|v|
    SignedRoot,
    /// tanh(v/0.1): a smooth sign, because a hard sign would switch with the noise.
    Sign,
    /// tanh(v/0.1) exp(-|v|/0.3): friction that vanishes once the contact slides.
    Striction,
    /// max(0, v)
    Rising,
}

/// `AT_REST` is the size of v below which its sign is uncertain. `SLIDING` is the scale of v over
/// which striction decays. v has a root mean square of 1.
const AT_REST: f64 = 0.1;
const SLIDING: f64 = 0.3;
/// Smallest movement in the opposite direction that counts as a turn, as a share of the signal's
/// range.
const TURN: f64 = 0.01;

/// One factor of a term. `signal` is an index into the proposal's signals; x is the scaled signal
/// and v its scaled rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the equation of each variant defines its fields")]
pub enum Factor {
    /// max(0, x)^power
    Power { signal: usize, power: f64 },
    /// (x - at)^power; odd or even about `at`.
    Centred { signal: usize, at: f64, power: i32 },
    /// max(0, x - at)^power
    Above { signal: usize, at: f64, power: f64 },
    /// max(0, at - x)^power
    Below { signal: usize, at: f64, power: f64 },
    /// exp(-max(0, x)/width)
    Low { signal: usize, width: f64 },
    /// exp(-max(0, 1 - x)/width)
    High { signal: usize, width: f64 },
    /// sin(2 pi turns x)
    Sine { signal: usize, turns: f64 },
    /// cos(2 pi turns x)
    Cosine { signal: usize, turns: f64 },
    /// A function of v.
    Rate { signal: usize, form: RateForm },
    /// Difference between v and its previous value; 0 at a trial's start.
    Bend { signal: usize },
    /// x - play(x, width). The play starts each trial at rest; width is half the backlash.
    Play { signal: usize, width: f64 },
    /// x - lag(x, tau), a first-order lag that starts each trial settled.
    Lag { signal: usize, tau_s: f64 },
    /// x(t - delay) - x(t)
    Late { signal: usize, delay_s: f64 },
    /// Greatest x of the trial so far, minus x.
    Peak { signal: usize },
    /// Direction of motion (-1, 0 or 1) times 1 - exp(-d/width); d is the greatest distance since
    /// the last turn.
    Turned { signal: usize, width: f64 },
    /// Distance travelled in the trial so far, in ranges, to a power.
    Travel { signal: usize, power: f64 },
    /// exp(-travel/width), with the distance travelled in the trial so far.
    TravelFade { signal: usize, width: f64 },
    /// (t/T)^power; t is the time in the trial, T the length of the longest fitted segment.
    Time { power: f64 },
    /// exp(-t/tau); t is the time in the trial.
    TimeFade { tau_s: f64 },
    /// (t/T)^power; t is the time in the session, T the session time of the last fitted sample.
    Session { power: f64 },
}

/// How a product of factors g reaches the output.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the equation of each variant defines its fields")]
pub enum Passage {
    /// Unchanged.
    Direct,
    /// Through a first-order lag, z' = (g - z)/tau, with z = 0 at a trial's start.
    Lag { tau_s: f64 },
    /// Through an integrator that leaks while valves are open: z' = g/tau - (sum of commands)
    /// z/tau, with z = 0 at a trial's start. A negative sum counts as 0.
    Leak { tau_s: f64 },
}

/// A term: a product of factors, and how it reaches the output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Term {
    /// Factors that are multiplied; an empty product is 1.
    pub factors: Vec<Factor>,
    /// How the product reaches the output.
    pub passage: Passage,
}

impl Term {
    pub(crate) fn new(factors: &[Factor], passage: Passage) -> Self {
        Self { factors: factors.to_vec(), passage }
    }

    /// Returns the values of the term over the first `trials` trials.
    pub(crate) fn values(&self, inputs: &TermInputs, trials: usize) -> Vec<f64> {
        let mut out = vec![1.0; inputs.samples(trials)];
        for factor in &self.factors {
            factor.multiply(inputs, trials, &mut out);
        }
        self.passage.pass(inputs, trials, &mut out);
        out
    }

    /// Returns the shapes (widths, times, knees) that may be refined.
    pub(crate) fn shapes(&self) -> Vec<f64> {
        self.clone().shapes_mut().into_iter().map(|(x, _)| *x).collect()
    }

    /// Returns the longest time constant or delay of the term, s; 0 if it has none.
    pub(crate) fn longest_s(&self) -> f64 {
        let mut copy = self.clone();
        let times = copy.shapes_mut().into_iter().filter(|(_, is_time)| *is_time);
        times.fold(0.0, |longest, (x, _)| longest.max(*x))
    }

    /// Returns the term with another value for one shape; an index beyond the last shape changes
    /// nothing.
    pub(crate) fn with_shape(&self, index: usize, value: f64) -> Self {
        let mut copy = self.clone();
        copy.shapes_mut().into_iter().skip(index).take(1).for_each(|(shape, _)| *shape = value);
        copy
    }

    /// Returns each shape, and whether it is a time in s.
    fn shapes_mut(&mut self) -> Vec<(&mut f64, bool)> {
        let factors = self.factors.iter_mut().filter_map(|f| match f {
            Factor::Centred { at, .. } | Factor::Above { at, .. } | Factor::Below { at, .. } => {
                Some((at, false))
            }
            Factor::Low { width, .. }
            | Factor::High { width, .. }
            | Factor::Play { width, .. }
            | Factor::Turned { width, .. }
            | Factor::TravelFade { width, .. } => Some((width, false)),
            Factor::Sine { turns, .. } | Factor::Cosine { turns, .. } => Some((turns, false)),
            Factor::Lag { tau_s, .. } | Factor::TimeFade { tau_s } => Some((tau_s, true)),
            Factor::Late { delay_s, .. } => Some((delay_s, true)),
            _ => None,
        });
        let passage = match &mut self.passage {
            Passage::Direct => None,
            Passage::Lag { tau_s } | Passage::Leak { tau_s } => Some((tau_s, true)),
        };
        factors.chain(passage).collect()
    }
}

impl RateForm {
    fn of(self, v: f64) -> f64 {
        match self {
            Self::Linear => v,
            Self::Magnitude => v.abs(),
            Self::Square => v * v,
            Self::SignedSquare => v * v.abs(),
            Self::SignedRoot => v.abs().sqrt().copysign(v),
            Self::Sign => (v / AT_REST).tanh(),
            Self::Striction => (v / AT_REST).tanh() * (-v.abs() / SLIDING).exp(),
            Self::Rising => v.max(0.0),
        }
    }
}

impl Factor {
    /// Multiplies `out`, the values of a term over the first `trials` trials, by this factor.
    fn multiply(self, inputs: &TermInputs, trials: usize, out: &mut [f64]) {
        for trial in 0..trials {
            let range = inputs.trials[trial].clone();
            self.in_trial(inputs, trial, &mut out[range]);
        }
    }

    /// Returns the index of its signal; `None` for a function of time.
    pub(super) fn signal(self) -> Option<usize> {
        match self {
            Self::Power { signal, .. }
            | Self::Centred { signal, .. }
            | Self::Above { signal, .. }
            | Self::Below { signal, .. }
            | Self::Low { signal, .. }
            | Self::High { signal, .. }
            | Self::Sine { signal, .. }
            | Self::Cosine { signal, .. }
            | Self::Rate { signal, .. }
            | Self::Bend { signal }
            | Self::Play { signal, .. }
            | Self::Lag { signal, .. }
            | Self::Late { signal, .. }
            | Self::Peak { signal }
            | Self::Turned { signal, .. }
            | Self::Travel { signal, .. }
            | Self::TravelFade { signal, .. } => Some(signal),
            Self::Time { .. } | Self::TimeFade { .. } | Self::Session { .. } => None,
        }
    }

    fn in_trial(self, inputs: &TermInputs, trial: usize, out: &mut [f64]) {
        let range = inputs.trials[trial].clone();
        let dt_s = inputs.grid.dt_s();
        let own = self.signal().map(|signal| &inputs.signals[signal]);
        let of = |values: fn(&Signal) -> &[f64]| own.map_or(&[][..], |s| &values(s)[range.clone()]);
        let (x, v) = (of(|s| &s.x), of(|s| &s.v));
        let first = x.first().copied().unwrap_or(0.0);
        let mut each = |of: &mut dyn FnMut(usize) -> f64| {
            out.iter_mut().enumerate().for_each(|(i, out)| *out *= of(i));
        };
        match self {
            Self::Power { power, .. } => each(&mut |i| raised(x[i].max(0.0), power)),
            Self::Centred { at, power, .. } => each(&mut |i| (x[i] - at).powi(power)),
            Self::Above { at, power, .. } => each(&mut |i| raised((x[i] - at).max(0.0), power)),
            Self::Below { at, power, .. } => each(&mut |i| raised((at - x[i]).max(0.0), power)),
            Self::Low { width, .. } => each(&mut |i| (-x[i].max(0.0) / width).exp()),
            Self::High { width, .. } => each(&mut |i| (-(1.0 - x[i]).max(0.0) / width).exp()),
            Self::Sine { turns, .. } => each(&mut |i| (TAU * turns * x[i]).sin()),
            Self::Cosine { turns, .. } => each(&mut |i| (TAU * turns * x[i]).cos()),
            Self::Rate { form, .. } => each(&mut |i| form.of(v[i])),
            Self::Bend { .. } => each(&mut |i| if i > 0 { v[i] - v[i - 1] } else { 0.0 }),
            Self::Play { width, .. } => {
                let play = ran(&Backlash::hard(width), inputs, x);
                each(&mut |i| x[i] - play[i]);
            }
            Self::Lag { tau_s, .. } => {
                let lag = lagged(inputs, x, tau_s, first);
                each(&mut |i| x[i] - lag[i]);
            }
            Self::Late { delay_s, .. } => each(&mut |i| late(x, i, delay_s / dt_s) - x[i]),
            Self::Peak { .. } => {
                let mut most = f64::NEG_INFINITY;
                each(&mut |i| {
                    most = most.max(x[i]);
                    most - x[i]
                });
            }
            Self::Turned { width, .. } => {
                let mut turns = Turns::at(first);
                each(&mut |i| turns.follow(x[i], width));
            }
            Self::Travel { power, .. } => {
                let mut travel = Travel::default();
                each(&mut |i| raised(travel.follow(x, i), power));
            }
            Self::TravelFade { width, .. } => {
                let mut travel = Travel::default();
                each(&mut |i| (-travel.follow(x, i) / width).exp());
            }
            Self::Time { power } => each(&mut |i| raised(i as f64 * dt_s / inputs.trial_s, power)),
            Self::TimeFade { tau_s } => each(&mut |i| (-(i as f64) * dt_s / tau_s).exp()),
            Self::Session { power } => {
                let start_s = inputs.starts_s[trial].max(0.0);
                each(&mut |i| raised((start_s + i as f64 * dt_s) / inputs.session_s, power));
            }
        }
    }
}

/// Returns x^power for x >= 0; common powers are computed without a logarithm, which is slower.
fn raised(x: f64, power: f64) -> f64 {
    match power {
        1.0 => x,
        2.0 => x * x,
        3.0 => x * x * x,
        0.5 => x.sqrt(),
        _ => libm::pow(x, power),
    }
}

/// Returns sample `i` of x delayed by `by` samples, with linear interpolation. Before the start of
/// x, its first value is used.
fn late(x: &[f64], i: usize, by: f64) -> f64 {
    let at = (i as f64 - by).max(0.0);
    let (whole, share) = (at as usize, at.fract());
    let next = x[(whole + 1).min(i)];
    x[whole] + share * (next - x[whole])
}

fn ran(operator: &dyn Operator, inputs: &TermInputs, x: &[f64]) -> Vec<f64> {
    let mut out = x.to_vec();
    let mut cells = vec![0.0; operator.cells()];
    operator.begin(Start::Settled, x.first().copied().unwrap_or(0.0), &mut cells);
    operator.run(&Span::whole(&inputs.grid), &mut cells, &mut out);
    out
}

fn lagged(inputs: &TermInputs, x: &[f64], tau_s: f64, first: f64) -> Vec<f64> {
    let lag = MeanReversion::new(tau_s, 0.0, &inputs.grid);
    let mut cells = [0.0; MeanReversion::CELLS];
    lag.begin(Start::Settled, first, &mut cells);
    let mut out = x.to_vec();
    lag.run(&Span::whole(&inputs.grid), &mut cells, &mut out, |_, z| z);
    out
}

/// State of `Factor::Turned`.
struct Turns {
    turn: f64,
    furthest: f64,
    way: f64,
}

impl Turns {
    fn at(x: f64) -> Self {
        Self { turn: x, furthest: x, way: 0.0 }
    }

    fn follow(&mut self, x: f64, width: f64) -> f64 {
        if self.way == 0.0 {
            self.way = if (x - self.turn).abs() > TURN { (x - self.turn).signum() } else { 0.0 };
            self.furthest = x;
        } else if self.way * (x - self.furthest) > 0.0 {
            self.furthest = x;
        } else if self.way * (self.furthest - x) > TURN {
            (self.turn, self.furthest, self.way) = (self.furthest, x, -self.way);
        }
        self.way * (1.0 - (-(self.furthest - self.turn).abs() / width).exp())
    }
}

/// Distance travelled so far, up and down. Movements smaller than `TURN` do not count.
#[derive(Default)]
struct Travel {
    held: Option<f64>,
    sum: f64,
}

impl Travel {
    fn follow(&mut self, x: &[f64], i: usize) -> f64 {
        let held = self.held.unwrap_or(x[0]);
        // A play (backlash) of half-width `TURN` removes noise at rest.
        let next = stretch_core::arithmetic::play(held, x[i], TURN);
        self.sum += (next - held).abs();
        self.held = Some(next);
        self.sum
    }
}

impl Passage {
    fn pass(self, inputs: &TermInputs, trials: usize, values: &mut [f64]) {
        let dt_s = inputs.grid.dt_s();
        for range in &inputs.trials[..trials] {
            let own = &mut values[range.clone()];
            match self {
                Self::Direct => {}
                Self::Lag { tau_s } => {
                    let z = lagged(inputs, own, tau_s, 0.0);
                    own.copy_from_slice(&z);
                }
                Self::Leak { tau_s } => {
                    let open: Vec<&[f64]> = inputs
                        .signals
                        .iter()
                        .filter(|s| s.spec.is_command)
                        .map(|s| &s.x[range.clone()])
                        .collect();
                    let mut z = 0.0;
                    for (i, g) in own.iter_mut().enumerate() {
                        // This update is exact if the openings and g are constant between samples.
                        let opening: f64 = open.iter().map(|o| o[i]).sum();
                        let rate = opening.max(0.0) / tau_s;
                        let kept = (-rate * dt_s).exp();
                        let grown = if rate > 0.0 { (1.0 - kept) / rate } else { dt_s };
                        z = kept * z + grown * *g / tau_s;
                        *g = z;
                    }
                }
            }
        }
    }
}

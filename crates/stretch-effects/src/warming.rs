//! A gain that warms up.

use alloc::{boxed::Box, vec, vec::Vec};

use crate::{
    effect::{Acts, Effect, Live, pairs},
    fading::Times,
    grid::Grid,
    kind::Kind,
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// Warming after switching on: y = x (1 + h (1 - mean of exp(-t/tau))), t since the trial's start.
/// Remembers what is still to warm up, one number a time constant.
///
/// ```
/// use stretch_effects::{Grid, Operator, Span, Start, Times, Warming};
/// let grid = Grid::samples(0.1)?;
/// let heats = Warming::new(0.02, Times { tau_s: 1.0, spread: 1.0 }, &grid);
/// let (mut cells, mut gain) = ([0.0], vec![1.0; 200]);
/// heats.begin(Start::Settled, 1.0, &mut cells);
/// heats.run(&Span::whole(&grid), &mut cells, &mut gain);
/// assert_eq!(gain[0], 1.0);
/// assert!((gain[10] - (1.0 + 0.02 * (1.0 - (-1.0_f64).exp()))).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Warming {
    h: f64,
    /// Time constants.
    count: usize,
    /// What a piece of time leaves, one time constant after the other.
    decays: Vec<f64>,
}

impl Warming {
    /// By a share `h` in the end, with these time constants, on a grid.
    pub fn new(h: f64, times: Times, grid: &Grid) -> Self {
        let taus = times.all();
        let left = |step: &f64| taus.iter().map(|tau| libm::exp(-step / tau)).collect::<Vec<_>>();
        Self { h, count: taus.len(), decays: grid.steps().iter().flat_map(left).collect() }
    }
}

impl Operator for Warming {
    fn cells(&self) -> usize {
        self.count
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells.fill(1.0);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let count = self.count as f64;
        span.each(signal.len(), |step, i| {
            if let Some(step) = step {
                let decays = &self.decays[step * self.count..];
                cells.iter_mut().zip(decays).for_each(|(left, decay)| *left *= decay);
            }
            signal[i] *= 1.0 + self.h * (1.0 - cells.iter().sum::<f64>() / count);
        });
    }
}

/// A gain that warms up from a trial's start.
pub static WARMING: Kind = Kind {
    name: "warming",
    title: "warming up",
    words: "its gain warms up in every trial",
    equation: "y = x (1 + h (1 - mean of exp(-t/(tau_s {1/spread, 1, spread})))), t since the trial began",
    parameters: |e, _| {
        vec![
            EffectParameter::sized("h", "1", -0.3..=0.3),
            EffectParameter::shaped("tau_s", "s", 20.0 * e.dt_s..=e.trial_s.max(40.0 * e.dt_s)),
            EffectParameter::formed("spread", "1", 1.0..=8.0, 1.6).log(),
        ]
    },
    operator: |v, _, grid| Box::new(Warming::new(v[0], Times { tau_s: v[1], spread: v[2] }, grid)),
    sketch: Some(|v, _, signals| {
        let x = signals.x.clone();
        let sketch = match v[2] {
            1.0 => {
                let body = "let y = x * (1 + H * (1 - s.left))
                    s.left = s.left * exp(-DT / TAU)";
                Sketch::of(x, body).cells(["left"], "1", "1")
            }
            _ => {
                let body = "let y = x * (1 + H * (1 - (s.p + s.q + s.r) / 3))
                    s.p = s.p * exp(-DT * SPREAD / TAU)
                    s.q = s.q * exp(-DT / TAU)
                    s.r = s.r * exp(-DT / (TAU * SPREAD))";
                Sketch::of(x, body).cells(["p", "q", "r"], "1", "1").with("SPREAD", v[2], "1")
            }
        };
        sketch.with_all(&[("H", v[0], "1"), ("TAU", v[1], "s"), ("DT", signals.dt_s, "s")])
    }),
    twins: &["gain_drift"],
    ..Kind::PLAIN
};

/// The excitation warms the gauge.
pub(crate) static SELF_HEATING: Effect = Effect {
    name: "self_heating",
    title: "the gauge's self-heating",
    words: "the gauge warms up in its own current",
    equation: "R -> R (1 + h (1 - mean of exp(-t/(tau {1/spread, 1, spread})))), t since the trial's start",
    parameters: &[
        EffectParameter::strength("h", "1", -0.05, 0.05, 0.01),
        EffectParameter::shape("tau", "s", 1.0, 60.0, 8.0),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    acts: Acts::at(&WARMING, Place::Resistance),
    alone: |_, search| search.reach_from(0.15),
    starts: Some(|_| pairs(0.003, [1.5, 5.0, 15.0, 45.0])),
    live: Some(Live { drifts: true, ..Live::BY_CURVE }),
    ..Effect::PLAIN
};

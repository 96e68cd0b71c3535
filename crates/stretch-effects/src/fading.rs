//! Fading memory with one time constant or several: relaxation, and gains that warm up.

use alloc::{boxed::Box, format, vec, vec::Vec};

use stretch_core::Fading;

use crate::{
    effect::{Acts, Effect, Live, pairs},
    extent::Extent,
    grid::Grid,
    kind::{Kind, Side, Signals},
    lowpass::MeanReversion,
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// One time constant, or three of equal weight around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// The middle time constant, s.
    pub tau_s: f64,
    /// Ratio of each time constant to the next shorter one; 1 gives a single time constant.
    pub spread: f64,
}

impl Times {
    /// Returns the time constants: tau, or tau {1/spread, 1, spread}.
    ///
    /// ```
    /// use stretch_effects::Times;
    /// assert_eq!(Times { tau_s: 3.0, spread: 1.0 }.all(), [3.0]);
    /// assert_eq!(Times { tau_s: 3.0, spread: 2.0 }.all(), [1.5, 3.0, 6.0]);
    /// ```
    pub fn all(self) -> Vec<f64> {
        let Self { tau_s, spread } = self;
        if spread == 1.0 {
            return [tau_s].into();
        }
        [tau_s / spread, tau_s, tau_s * spread].into()
    }
}

/// Relaxation (creep if the share is negative): y = x + share (x - mean of mean_rev(x, tau)). Here mean_rev(x, tau) is
/// x behind a first-order lag, and the mean is taken over the time constants.
///
/// A step of the input appears in the output as 1 + share and fades to 1.
///
/// ```
/// use stretch_effects::{FadingMemory, Grid, Operator, Span, Start, Times};
/// let grid = Grid::samples(0.01)?;
/// let relaxes = FadingMemory::new(0.5, Times { tau_s: 0.1, spread: 1.6 }, 1.0, &grid);
/// let mut cells = vec![0.0; relaxes.cells()];
/// let mut signal = vec![1.0; 500];
/// relaxes.begin(Start::Settled, 0.0, &mut cells);
/// relaxes.run(&Span::whole(&grid), &mut cells, &mut signal);
/// assert!(signal[1] > 1.4 && (signal[499] - 1.0).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FadingMemory {
    share: f64,
    lags: Vec<MeanReversion>,
}

impl FadingMemory {
    /// A memory that makes up `share` of the output, with these time constants, for signals sampled on `grid`. `reach` is the stroke of the input, which scales the state
    /// that an unrecorded motion leaves.
    pub fn new(share: f64, times: Times, reach: f64, grid: &Grid) -> Self {
        let lags = times.all().into_iter().map(|tau| MeanReversion::new(tau, reach, grid));
        Self { share, lags: lags.collect() }
    }
}

impl Operator for FadingMemory {
    fn cells(&self) -> usize {
        self.lags.len() * MeanReversion::CELLS
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (lag, own) in self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            lag.begin(start, first, own);
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if let [lag] = self.lags.as_slice() {
            return lag.run(span, cells, signal, |x, z| x + self.share * (x - z));
        }
        let share = self.share / self.lags.len() as f64;
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            let all = self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS));
            let apart: f64 = all.map(|(lag, own)| x - lag.step(step, own, x)).sum();
            signal[i] = x + share * apart;
        });
    }
}

/// Relaxation with one time constant, or three.
pub static RELAXATION: Kind = Kind {
    name: "relaxation",
    title: "relaxation",
    words: "it overshoots a quick change and relaxes, or creeps after it",
    equation: "y = x + c (x - mean of mean_rev(x, tau_s {1/spread, 1, spread}))",
    usual: &[Side::Output],
    parameters: |e, _| {
        let longest = (0.5 * e.trial_s).max(20.0 * e.dt_s);
        vec![
            EffectParameter::sized("c", "1", -0.5..=0.6),
            EffectParameter::shaped("tau_s", "s", 4.0 * e.dt_s..=longest),
            EffectParameter::formed("spread", "1", 1.0..=8.0, 1.6).log(),
        ]
    },
    operator: |v, e, grid| {
        Box::new(FadingMemory::new(v[0], Times { tau_s: v[1], spread: v[2] }, e.span(), grid))
    },
    sketch: Some(sketch),
    twins: &["lag"],
    ..Kind::PLAIN
};

/// Writes the code. Each lag is exact for an input that is linear between samples: with k = exp(-DT/tau) and m = (1 -
/// k) tau/DT the update is z = k z + (m - k) last + (1 - m) x.
fn sketch(v: &[f64], _: &Extent, signals: &Signals) -> Sketch {
    let one = |z: &str, t: &str| {
        format!(
            "let k{z} = exp(-DT / ({t}))
            let m{z} = (1 - k{z}) * ({t}) / DT
            s.{z} = k{z} * s.{z} + (m{z} - k{z}) * s.last + (1 - m{z}) * x\n"
        )
    };
    let of = |lags: &str, mean: &str| {
        let body = format!("{lags}s.last = x\nlet y = x + SHARE * (x - {mean})");
        Sketch::of(signals.x.clone(), body).with_all(&[("SHARE", v[0], "1"), ("TAU", v[1], "s")])
    };
    let sketch = match v[2] {
        1.0 => of(&one("z", "TAU"), "s.z").remembering(["z", "last"]),
        spread => {
            let lags = one("p", "TAU / SPREAD") + &one("q", "TAU") + &one("r", "TAU * SPREAD");
            let sketch = of(&lags, "(s.p + s.q + s.r) / 3").with("SPREAD", spread, "1");
            sketch.remembering(["p", "q", "r", "last"])
        }
    };
    sketch.with("DT", signals.dt_s, "s")
}

/// Relaxation of the gauge after a quick change of strain.
pub(crate) static GAUGE_RELAXATION: Effect = Effect {
    name: "gauge_relaxation",
    title: "the gauge's relaxation",
    words: "the gauge relaxes (or overshoots) after a change of strain",
    equation: "e -> e + c (e - mean of mean_rev(e, tau {1/spread, 1, spread}))",
    parameters: &[
        EffectParameter::strength("c", "1", -0.3, 0.6, 0.1),
        EffectParameter::shape("tau", "s", 0.02, 4.0, 0.3),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    acts: Acts::at(&RELAXATION, Place::Strain),
    twins: &["amplifier_lowpass"],
    // Gauges that are not metal foils relax more slowly, and by a larger share of a step.
    alone: |_, search| {
        search.reach(0.6);
        search.ranges[1][1] = 20.0;
        let slow = search.starts.last().map(|s| [&[s[0], 10.0], &s[2..]].concat());
        search.starts.extend(slow);
    },
    starts: Some(|_| pairs(0.05, [0.03, 0.1, 0.35, 1.2, 3.5])),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("c", "1", -0.8, 1.5, 0.1),
            EffectParameter::shape("tau", "s", 0.01, 40.0, 0.3),
            EffectParameter::form("spread", "1", 1.0, 10.0, Form { neutral: 1.6, usual: 1.6 })
                .log(),
        ],
        set: |v, _, map| {
            let (share, taus_s) = (v[0], [v[1] / v[2], v[1], v[1] * v[2]]);
            map.relaxation = Some(Fading { share, taus_s });
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// Warming after switching on: y = x (1 + h (1 - mean of exp(-t/tau))), t since the trial's start. The memory is the
/// remaining part exp(-t/tau), one value for each time constant.
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
    /// Number of time constants.
    count: usize,
    /// Decay factors over each grid step, one time constant after the other.
    decays: Vec<f64>,
}

impl Warming {
    /// A warming by a final share `h` with these time constants, on a grid.
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

/// A gain that warms up from the trial's start.
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

/// Warming of the gauge by its excitation current.
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

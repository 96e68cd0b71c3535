//! Delays, time offsets between channels, and clocks that drift.

use alloc::{boxed::Box, format, vec};

use crate::{
    effect::{Acts, Effect, Live, each},
    grid::Grid,
    kind::{Family, Kind, Side, Signals},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::{Quantity, Sketch},
};

/// The time by which samples are late.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SkewSpec {
    /// Delay at the trial's start, s.
    pub skew_s: f64,
    /// Growth of the delay, s/s, as between two clocks of different rates.
    pub rate: f64,
    /// Initial condition: before the first value arrives, the output is `1 - empty` times that value. If `empty` is 0,
    /// the first value is held; if it is 1, the output is zero.
    pub empty: f64,
}

/// Reads a signal at the time `skew_s + rate t` before every sample, with t since the trial began. It interpolates with
/// cubics through four nodes (Lagrange), and linearly next to an end. After the end the last value is held. Before the
/// start the output is `1 - empty` times the first value.
///
/// ```
/// use stretch_effects::{Grid, Skew, SkewSpec};
/// let line: Vec<f64> = (0..100).map(f64::from).collect();
/// let mut shown = vec![0.0; 100];
/// Skew::new(&Grid::samples(0.01)?, SkewSpec { skew_s: 0.025, ..Default::default() }).sample(&line, &mut shown);
/// assert!((shown[50] - 47.5).abs() < 1e-9 && shown[0] == 0.0);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Skew {
    grid: Grid,
    spec: SkewSpec,
    at_start: Reading,
}

/// How the value of one sample is interpolated from the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    /// Node before the reading time, relative to the sample's own node.
    offset: isize,
    /// Weights of the node before that one, the node itself, and the two nodes after it.
    weights: [f64; 4],
    /// Position of the reading time between the node and the next one, from 0 to 1.
    share: f64,
}

impl Skew {
    /// A skew for the samples of a grid.
    pub fn new(grid: &Grid, spec: SkewSpec) -> Self {
        Self { grid: grid.clone(), spec, at_start: Reading::new(grid, spec.skew_s) }
    }

    /// Computes the samples from a value at every node.
    pub fn sample(&self, nodes: &[f64], samples: &mut [f64]) {
        let pieces = self.grid.pieces();
        if nodes.is_empty() {
            return;
        }
        if self.spec.rate == 0.0 {
            for (i, out) in samples.iter_mut().enumerate() {
                *out = self.at_start.of(nodes, i * pieces, self.spec.empty);
            }
            return;
        }
        for (i, out) in samples.iter_mut().enumerate() {
            let late_s = self.spec.skew_s + self.spec.rate * (i as f64 * self.grid.dt_s());
            *out = Reading::new(&self.grid, late_s).of(nodes, i * pieces, self.spec.empty);
        }
    }
}

/// Each call expects the samples of a whole trial.
impl Operator for Skew {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let nodes = signal.to_vec();
        self.sample(&nodes, signal);
    }
}

impl Reading {
    fn new(grid: &Grid, skew_s: f64) -> Self {
        let pieces = grid.pieces();
        let samples = libm::floor(-skew_s / grid.dt_s());
        // Time after that sample, less than one sample time.
        let mut after = (-skew_s - samples * grid.dt_s()).clamp(0.0, grid.dt_s());
        let mut piece = 0;
        while piece + 1 < pieces && after >= grid.steps()[piece] {
            after -= grid.steps()[piece];
            piece += 1;
        }
        let step = |i: usize| grid.steps()[i % pieces];
        let here = step(piece);
        let share = (after / here).clamp(0.0, 1.0);
        let t = share * here;
        let nodes = [-step(piece + pieces - 1), 0.0, here, here + step(piece + 1)];
        let weights = core::array::from_fn(|i| {
            (0..4).filter(|j| *j != i).map(|j| (t - nodes[j]) / (nodes[i] - nodes[j])).product()
        });
        // The cast saturates: with a skew longer than any trial, an end value is held throughout.
        let offset =
            (samples as isize).saturating_mul(pieces as isize).saturating_add(piece as isize);
        Self { offset, weights, share }
    }

    /// Returns the value of the sample whose own node is `own`.
    #[inline]
    fn of(&self, nodes: &[f64], own: usize, empty: f64) -> f64 {
        let last = nodes.len() as isize - 1;
        let node = (own as isize).saturating_add(self.offset);
        if node >= 1 && node + 2 <= last {
            let around = &nodes[node as usize - 1..node as usize + 3];
            let [a, b, c, d] = self.weights;
            a * around[0] + b * around[1] + (c * around[2] + d * around[3])
        } else if node < 0 {
            (1.0 - empty) * nodes[0]
        } else if node >= last {
            nodes[last as usize]
        } else {
            let [x, y] = [nodes[node as usize], nodes[node as usize + 1]];
            x + self.share * (y - x)
        }
    }
}

/// A delay (dead time).
pub static DELAY: Kind = Kind {
    name: "delay",
    title: "a delay",
    words: "it acts after a dead time",
    equation: "y(t) = x(t - delay_s), and (1 - empty) x(0) before x(0) arrives",
    usual: &[Side::Input],
    parameters: |e, _| {
        // The recording does not contain the command before its start. That command may have been the first value,
        // zero, or between.
        let empty = EffectParameter::formed("empty", "1", 0.0..=1.0, 0.0);
        vec![EffectParameter::sized("delay_s", "s", 0.0..=e.late_s()), empty]
    },
    starts: Some(|e| {
        let late = [0.05, 0.2, 0.6].map(|k| k * e.late_s());
        late.iter().flat_map(|&late| [vec![late, 0.0], vec![late, 1.0]]).collect()
    }),
    operator: |v, _, grid| {
        Box::new(Skew::new(grid, SkewSpec { skew_s: v[0], rate: 0.0, empty: v[1] }))
    },
    sketch: Some(|v, _, signals| {
        sketch(SkewSpec { skew_s: v[0], rate: 0.0, empty: v[1] }, signals)
    }),
    twins: &["skew", "lag", "second_order_lag"],
    family: Some((Family::Late, |v| v[0])),
    ..Kind::PLAIN
};

/// A time offset of samples that are taken with a separate clock.
pub static SKEW: Kind = Kind {
    name: "skew",
    title: "a time offset",
    words: "it is sampled earlier or later than the rest, by a separate clock",
    equation: "y(t) = x(t - skew_s - rate t), t since the trial began",
    usual: &[Side::Output],
    parameters: |e, _| {
        let late = e.late_s();
        let rate = EffectParameter::formed("rate", "s/s", -1e-3..=1e-3, 0.0);
        vec![EffectParameter::sized("skew_s", "s", -late..=late), rate]
    },
    starts: Some(|e| [-0.2, -0.03, 0.03, 0.1, 0.5].map(|k| vec![k * e.late_s(), 0.0]).into()),
    operator: |v, _, grid| {
        Box::new(Skew::new(grid, SkewSpec { skew_s: v[0], rate: v[1], empty: 0.0 }))
    },
    sketch: Some(|v, _, signals| {
        sketch(SkewSpec { skew_s: v[0], rate: v[1], empty: 0.0 }, signals)
    }),
    twins: &["delay", "lag", "second_order_lag", "clock_drift"],
    family: Some((Family::Late, |v| v[0])),
    ..Kind::PLAIN
};

/// Writes the code, which needs the whole recording.
fn sketch(SkewSpec { skew_s, rate, empty }: SkewSpec, signals: &Signals) -> Sketch {
    read_at("SKEW + RATE * i * DT", signals)
        .with_all(&[("SKEW", skew_s, "s"), ("RATE", rate, "s/s"), ("EMPTY", empty, "1")])
        .with("DT", signals.dt_s, "s")
}

/// Writes the code, without its constants, that reads a recording at some time before each of its samples.
pub(crate) fn read_at(late: &str, signals: &Signals) -> Sketch {
    let body = format!(
        "let early = -({late}) / DT
        let whole = floor(early)
        let u = early - whole
        let k = i + whole
        var y = (1 - EMPTY) * v[0]
        if k >= n - 1
        y = v[n - 1]
        else
        if (k >= 1) and (k <= n - 3)
        y = u * (1 - u) * (u - 2) / 6 * v[k - 1] + (u + 1) * (u - 1) * (u - 2) / 2 * v[k]
        y = y + (u + 1) * u * (2 - u) / 2 * v[k + 1] + (u + 1) * u * (u - 1) / 6 * v[k + 2]
        else
        if k >= 0
        y = v[k] + u * (v[k + 1] - v[k])
        end
        end
        end"
    );
    Sketch::of(signals.x.clone().named("v").record(), body)
        .beside(Quantity::COUNT)
        .beside(Quantity::new("i", "1", "index of the sample to return, from 0"))
}

/// Time offset between the bridge and the length.
pub(crate) static CHANNEL_SKEW: Effect = Effect {
    name: "channel_skew",
    title: "the time offset between signal and reference",
    words: "the signal is sampled earlier or later than the reference",
    equation: "the signal shows the reference of skew_s + rate t earlier, t since the trial began, first and last value held",
    parameters: &[
        EffectParameter::strength("skew_s", "s", -0.1, 0.2, 0.02),
        EffectParameter::form("rate", "s/s", -5e-4, 5e-4, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::at(&SKEW, Place::Sampling),
    twins: &["amplifier_lowpass"],
    // If two recorders are started by hand, the offset may be large.
    alone: |alone, search| {
        search.reach(1.0);
        let more = [alone.lag_s, 0.9 * alone.lag_s, -0.15, 0.2];
        search.starts.extend(more.map(|skew_s| vec![skew_s, 0.0]));
    },
    // A constant delay of either sign, and two clocks of different rates.
    starts: Some(|_| {
        let mut all = each([-0.02, -0.004, 0.004, 0.02, 0.08]);
        all.extend([-1e-4, 1e-4].map(|rate| vec![0.002, rate]));
        all
    }),
    live: Some(Live {
        parameters: &[EffectParameter::strength("skew_s", "s", -1.0, 1.0, 0.0)],
        set: |v, _, map| map.skew_s = v[0],
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// Samples taken with a clock of another rate: y(t) = x(t - skew - rate t), with t since the session began, so that the
/// delay continues from trial to trial.
///
/// ```
/// use stretch_effects::{ClockDrift, Grid, Operator, Span};
/// let grid = Grid::samples(0.01)?;
/// let clock = ClockDrift::new(0.0, 1e-3, &grid);
/// let mut line: Vec<f64> = (0..200).map(|i| 0.01 * f64::from(i)).collect();
/// clock.run(&Span { start_s: 60.0, ..Span::whole(&grid) }, &mut [], &mut line);
/// // A minute after the session began it is 60 ms late.
/// assert!((line[100] - (1.0 - 0.061)).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ClockDrift {
    skew_s: f64,
    rate: f64,
    grid: Grid,
}

impl ClockDrift {
    /// A clock that is late by `skew_s` when the session begins, and by `rate` more in every second.
    pub fn new(skew_s: f64, rate: f64, grid: &Grid) -> Self {
        Self { skew_s, rate, grid: grid.clone() }
    }
}

/// Each call expects the samples of a whole trial.
impl Operator for ClockDrift {
    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let skew_s = self.skew_s + self.rate * span.start_s;
        let spec = SkewSpec { skew_s, rate: self.rate, empty: 0.0 };
        Skew::new(&self.grid, spec).run(span, cells, signal);
    }
}

/// A clock that drifts.
pub static CLOCK_DRIFT: Kind = Kind {
    name: "clock_drift",
    title: "a clock that drifts",
    words: "it is sampled by a clock that runs too fast or too slow, ever earlier or later than the rest",
    equation: "y(t) = x(t - skew_s - rate t), t since the session began",
    usual: &[Side::Output],
    parameters: |e, _| {
        let late = e.late_s();
        // The greatest rate is derived from the longest delay and the session's duration, within the errors of real
        // clocks.
        let most = (REACH * late / e.session_s.max(e.dt_s)).clamp(LEAST, MOST);
        let skew = EffectParameter::sized("skew_s", "s", -late..=late);
        vec![EffectParameter::sized("rate", "s/s", -most..=most), skew]
    },
    starts: Some(|e| {
        let rates = [-0.5, -0.1, -0.02, 0.02, 0.1, 0.5].map(|k| k * e.late_s() / e.session_s);
        rates.map(|rate| vec![rate, 0.0]).into()
    }),
    operator: |v, _, grid| Box::new(ClockDrift::new(v[1], v[0], grid)),
    sketch: Some(|v, _, signals| {
        read_at("SKEW + RATE * t", signals)
            .beside(Quantity::SESSION_TIME)
            .with_all(&[("SKEW", v[1], "s"), ("RATE", v[0], "s/s"), ("EMPTY", 0.0, "1")])
            .with("DT", signals.dt_s, "s")
    }),
    twins: &["skew", "delay", "lag"],
    family: Some((Family::Late, |v| v[1])),
    drifts: true,
    ..Kind::PLAIN
};

/// Greatest delay at the end of a session, as a multiple of the longest constant delay that is searched.
const REACH: f64 = 5.0;
/// Bounds of the greatest clock error that is searched, s/s.
const LEAST: f64 = 1e-4;
const MOST: f64 = 0.05;

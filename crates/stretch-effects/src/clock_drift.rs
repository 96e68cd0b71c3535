//! A recorder whose clock runs too fast or too slow.

use alloc::{boxed::Box, vec};

use crate::{
    grid::Grid,
    kind::{Kind, Side},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Quantity,
    skew::{Skew, read_at},
    skew_spec::SkewSpec,
};

/// Samples by a clock of another pace: y(t) = x(t - skew - rate t), t since the session began, so that trials go on where the last one
/// ended.
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
    /// Late by `skew_s` when the session begins, and by `rate` more for every second of it.
    pub fn new(skew_s: f64, rate: f64, grid: &Grid) -> Self {
        Self { skew_s, rate, grid: grid.clone() }
    }
}

/// On samples of a whole trial.
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
        // What a trial may be late the whole session may, or what a bad quartz gives.
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
    drifts: true,
    ..Kind::PLAIN
};

/// How late the end of a session may be, in longest delays.
const REACH: f64 = 5.0;
/// Least and greatest error of a clock that is looked for, s/s.
const LEAST: f64 = 1e-4;
const MOST: f64 = 0.05;

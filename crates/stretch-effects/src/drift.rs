//! A gain that drifts.

use alloc::{boxed::Box, vec};

use crate::{
    effect::{Acts, Effect, each},
    kind::Kind,
    live::Live,
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::{Quantity, Sketch},
};

/// Drift of a gain with session time t: y = x (1 + d (1 - exp(-settle t))/settle), or x (1 + d t) where it never settles.
///
/// ```
/// use stretch_effects::{Drift, Grid, Operator, Span};
/// let grid = Grid::samples(1.0)?;
/// let after = |drift: Drift| {
///     let mut gain = [1.0];
///     drift.run(&Span { start_s: 2000.0, ..Span::whole(&grid) }, &mut [], &mut gain);
///     gain[0]
/// };
/// assert_eq!(after(Drift::straight(1e-4)), 1.2);
/// assert!((after(Drift { per_s: 1e-4, settle_per_s: 0.01 }) - 1.01).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Drift at the session's start, d, 1/s.
    pub per_s: f64,
    /// How fast it settles, 1/s; 0 for a straight line.
    pub settle_per_s: f64,
}

impl Drift {
    /// A drift that never settles.
    pub fn straight(per_s: f64) -> Self {
        Self { per_s, settle_per_s: 0.0 }
    }
}

impl Operator for Drift {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let times = (span.first_node..).map(|node| span.start_s + span.grid.time_s(node));
        if self.settle_per_s == 0.0 {
            for (x, t) in signal.iter_mut().zip(times) {
                *x *= 1.0 + self.per_s * t;
            }
            return;
        }
        let whole = self.per_s / self.settle_per_s;
        for (x, t) in signal.iter_mut().zip(times) {
            *x *= 1.0 - whole * libm::expm1(-self.settle_per_s * t);
        }
    }
}

/// A gain that drifts with session time.
pub static GAIN_DRIFT: Kind = Kind {
    name: "gain_drift",
    title: "drift of the gain",
    words: "its gain drifts with session time",
    equation: "y = x (1 + d (1 - exp(-settle_per_s t))/settle_per_s), t since the session began",
    parameters: |e, _| {
        let (most, session_s) = (0.3 / e.session_s, e.session_s);
        let settle = 0.1 / session_s..=10.0 / session_s;
        vec![
            EffectParameter::sized("d", "1/s", -most..=most),
            EffectParameter::formed("settle_per_s", "1/s", settle, 0.3 / session_s).log(),
        ]
    },
    operator: |v, _, _| Box::new(Drift { per_s: v[0], settle_per_s: v[1] }),
    sketch: Some(|v, _, signals| {
        let x = signals.x.clone();
        let sketch = match v[1] {
            0.0 => Sketch::of(x, "let y = x * (1 + D * t)").with("D", v[0], "1/s"),
            settle => {
                let body = "let y = x * (1 - D / SETTLE_PER_S * expm1(-SETTLE_PER_S * t))";
                let numbers = [("D", v[0], "1/s"), ("SETTLE_PER_S", settle, "1/s")];
                Sketch::of(x, body).with_all(&numbers)
            }
        };
        sketch.beside(Quantity::SESSION_TIME)
    }),
    twins: &["drift"],
    drifts: true,
    ..Kind::PLAIN
};

/// The gauge drifts while the session lasts.
pub(crate) static THERMAL_DRIFT: Effect = Effect {
    name: "thermal_drift",
    title: "the gauge's thermal drift",
    words: "the gauge drifts with time",
    equation: "R -> R (1 + d (1 - exp(-settle_per_s t))/settle_per_s), 1 + d t at 0; t since the session began",
    parameters: &[
        EffectParameter::strength("d", "1/s", -4e-4, 4e-4, 5e-5),
        EffectParameter::form(
            "settle_per_s",
            "1/s",
            5e-5,
            1.0 / 150.0,
            Form { neutral: 0.0, usual: 1.0 / 3e3 },
        )
        .log(),
    ],
    acts: Acts::at(&GAIN_DRIFT, Place::Resistance),
    // It takes at most half of the signal's span away over the session.
    alone: |alone, search| search.reach_from(0.5 / alone.session_s.max(1.0)),
    starts: Some(|_| each([2e-5])),
    live: Some(Live { drifts: true, ..Live::BY_CURVE }),
    ..Effect::PLAIN
};

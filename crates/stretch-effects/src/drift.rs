//! Constant offsets, and zeros and gains that drift with session time.

use alloc::{boxed::Box, vec};

use crate::{
    effect::{Acts, Effect, Live, each},
    kind::{Kind, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::{Quantity, Sketch},
};

/// An offset that changes linearly with session time t: y = x + at_start + per_s t.
///
/// ```
/// use stretch_effects::{Grid, Offset, Operator, Span};
/// let grid = Grid::samples(1.0)?;
/// let mut shown = [1.0, 1.0];
/// Offset { at_start: 0.5, per_s: 0.25 }.run(&Span { start_s: 2.0, ..Span::whole(&grid) }, &mut [], &mut shown);
/// assert_eq!(shown, [2.0, 2.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Offset {
    /// Offset at the session's start, in the unit of the signal.
    pub at_start: f64,
    /// Rate of the drift, units/s.
    pub per_s: f64,
}

impl Operator for Offset {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, node) in signal.iter_mut().zip(span.first_node..) {
            *x += self.at_start + self.per_s * (span.start_s + span.grid.time_s(node));
        }
    }
}

/// A constant offset.
pub static OFFSET: Kind = Kind {
    name: "offset",
    title: "an offset",
    words: "its zero is off",
    equation: "y = x + offset",
    usual: &[Side::Input],
    parameters: |e, unit| {
        vec![EffectParameter::sized("offset", unit, -0.3 * e.span()..=0.3 * e.span())]
    },
    operator: |v, _, _| Box::new(Offset { at_start: v[0], per_s: 0.0 }),
    sketch: Some(|v, _, signals| {
        let sketch = Sketch::of(signals.x.clone(), "let y = x + OFFSET");
        sketch.with("OFFSET", v[0], &signals.x.unit)
    }),
    twins: &["drift"],
    ..Kind::PLAIN
};

/// A zero that drifts.
pub static DRIFT: Kind = Kind {
    name: "drift",
    title: "drift of the zero",
    words: "its zero drifts with session time",
    equation: "y = x + offset + per_session t/session, t since the session began",
    usual: &[Side::Output],
    parameters: |e, unit| {
        let most = 0.3 * e.span();
        vec![
            EffectParameter::sized("per_session", unit, -most..=most),
            EffectParameter::formed("offset", unit, -most..=most, 0.0),
        ]
    },
    starts: Some(|e| [-0.05, 0.05].map(|k| vec![k * e.span(), 0.0]).into()),
    operator: |v, e, _| Box::new(Offset { at_start: v[1], per_s: v[0] / e.session_s }),
    sketch: Some(|v, e, signals| {
        let unit = &*signals.x.unit;
        Sketch::of(signals.x.clone(), "let y = x + OFFSET + PER_SESSION * t / SESSION")
            .beside(Quantity::SESSION_TIME)
            .with_all(&[("OFFSET", v[1], unit), ("PER_SESSION", v[0], unit)])
            .with("SESSION", e.session_s, "s")
    }),
    twins: &["offset"],
    drifts: true,
    ..Kind::PLAIN
};

/// Drift of a gain with session time t: y = x (1 + d (1 - exp(-settle t))/settle), or x (1 + d t) if `settle_per_s` is
/// 0.
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
    /// Rate of the drift at the session's start, d, 1/s.
    pub per_s: f64,
    /// Rate at which the drift settles, 1/s; 0 gives a straight line.
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

/// Thermal drift of the gauge during the session.
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
    // The gain changes by at most half over the session.
    alone: |alone, search| search.reach_from(0.5 / alone.session_s.max(1.0)),
    starts: Some(|_| each([2e-5])),
    live: Some(Live { drifts: true, ..Live::BY_CURVE }),
    ..Effect::PLAIN
};

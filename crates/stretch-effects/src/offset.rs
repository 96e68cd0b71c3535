//! A zero that is off, and wanders.

use alloc::{boxed::Box, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::{Quantity, Sketch},
};

/// An offset with session time t: y = x + at_start + per_s t.
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
    /// At the session's start, in the unit of the signal.
    pub at_start: f64,
    /// How it wanders, units/s.
    pub per_s: f64,
}

impl Operator for Offset {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, node) in signal.iter_mut().zip(span.first_node..) {
            *x += self.at_start + self.per_s * (span.start_s + span.grid.time_s(node));
        }
    }
}

/// A zero that is off.
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

/// A zero that wanders.
pub static DRIFT: Kind = Kind {
    name: "drift",
    title: "drift of the zero",
    words: "its zero wanders with session time",
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

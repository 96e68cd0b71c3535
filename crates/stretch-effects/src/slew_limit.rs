//! A channel that cannot change faster than a rate.

use alloc::{boxed::Box, format, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// Bounds the rate: y goes towards x by at most rate h in a step of length h. Remembers y.
///
/// ```
/// use stretch_effects::{Grid, Operator, SlewLimit, Span, Start};
/// let (mut cells, mut signal) = ([0.0], [0.0, 1.0, 1.0, 1.0, 0.875]);
/// let valve = SlewLimit { rate: 4.0 };
/// valve.begin(Start::Settled, signal[0], &mut cells);
/// valve.run(&Span::whole(&Grid::samples(0.125)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.5, 1.0, 1.0, 0.875]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlewLimit {
    /// Greatest rate, units/s, above 0.
    pub rate: f64,
}

impl Operator for SlewLimit {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        cells[0] = first;
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut y = cells[0];
        span.each(signal.len(), |step, i| {
            let most = step.map_or(f64::INFINITY, |step| self.rate * span.grid.steps()[step]);
            let apart = signal[i] - y;
            // Within reach it is the value itself, to the last bit.
            y = if apart.abs() <= most { signal[i] } else { y + most.copysign(apart) };
            signal[i] = y;
        });
        cells[0] = y;
    }
}

/// A greatest rate.
pub static SLEW_LIMIT: Kind = Kind {
    name: "slew_limit",
    title: "a limit of the rate",
    words: "it cannot change faster than a rate",
    equation: "|y'| <= rate, y follows x",
    usual: &[Side::Input, Side::Output],
    // At twice the quickest change that was seen nothing is limited.
    parameters: |e, unit| {
        let off = 2.0 * e.quickest.max(1e-9 * e.span() / e.dt_s);
        vec![EffectParameter::sized("rate", &format!("{unit}/s"), 0.01 * off..=off).off_at(off)]
    },
    starts: Some(|e| [0.45, 0.3, 0.15, 0.06].map(|k| vec![2.0 * k * e.quickest]).into()),
    operator: |v, _, _| Box::new(SlewLimit { rate: v[0] }),
    sketch: Some(|v, _, signals| {
        let body = "let most = RATE * DT
            s.at = max(s.at - most, min(s.at + most, x))
            let y = s.at";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[
                ("RATE", v[0], &*format!("{}/s", signals.x.unit)),
                ("DT", signals.dt_s, "s"),
            ])
            .remembering(["at"])
    }),
    twins: &["lag", "profile"],
    ..Kind::PLAIN
};

//! A converter's steps.

use alloc::{boxed::Box, vec};

use crate::{
    kind::Kind,
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// Rounds to steps: y = step round(x/step), halves away from zero.
///
/// ```
/// use stretch_effects::{Grid, Operator, Quantiser, Span};
/// let mut length_mm = [0.1, 0.4, -0.25];
/// Quantiser { step: 0.25 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut length_mm);
/// assert_eq!(length_mm, [0.0, 0.5, -0.25]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantiser {
    /// A step, in the unit of the signal.
    pub step: f64,
}

impl Operator for Quantiser {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for x in signal {
            *x = libm::round(*x / self.step) * self.step;
        }
    }
}

/// Steps.
pub static QUANTISATION: Kind = Kind {
    name: "quantisation",
    title: "quantisation",
    words: "it comes in steps",
    equation: "y = step round(x/step)",
    parameters: |e, unit| vec![EffectParameter::sized("step", unit, 0.0..=0.1 * e.span())],
    starts: Some(|e| vec![vec![e.lattice], vec![0.01 * e.span()]]),
    operator: |v, _, _| Box::new(Quantiser { step: v[0].max(1e-300) }),
    sketch: Some(|v, _, signals| {
        let body = "var y = STEP * floor(abs(x) / STEP + 0.5)
            if x < 0
            y = -y
            end";
        Sketch::of(signals.x.clone(), body).with("STEP", v[0], &signals.x.unit)
    }),
    ..Kind::PLAIN
};

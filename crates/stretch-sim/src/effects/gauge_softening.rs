//! The gauge softens as it is worked.

use stretch_operators::{Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The gauge softens as it is worked.
#[derive(Debug)]
pub(super) struct GaugeSoftening;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("m", "1", 0.0, 0.3, 0.1),
    EffectParameter::shape("n", "strain", 0.3, 20.0, 2.5),
];

impl Effect for GaugeSoftening {
    fn name(&self) -> &'static str {
        "gauge_softening"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "R - R0 -> (R - R0)(1 - m (1 - exp(-travel/n))), travel: summed abs strain change since the session began"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        let reversal = REVERSAL * around.strain_unit;
        Action::Resistance(Box::new(Softening {
            m: values[0],
            n: values[1],
            r0: around.resistance_zero,
            reversal,
        }))
    }
}

/// Reversals smaller than this strain do not travel: noise alone would go a long way.
const REVERSAL: f64 = 5e-4;

/// Remembers the travel, the strain reached, and the direction: +1, -1, or 0 before the first move.
#[derive(Debug)]
struct Softening {
    m: f64,
    n: f64,
    r0: f64,
    reversal: f64,
}

impl Softening {
    /// Counts a move to the strain `e`.
    #[inline]
    fn go(&self, cells: &mut [f64; 3], e: f64) -> bool {
        let [travel, reached, direction] = cells;
        let moved = e - *reached;
        let onward = moved * *direction > 0.0;
        let distance = moved.abs();
        if onward || distance > self.reversal {
            *travel += distance;
            *reached = e;
            if !onward {
                *direction = moved.signum();
            }
            return true;
        }
        false
    }
}

impl Operator for Softening {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        match start {
            Start::Settled => state = [0.0, first, 0.0],
            Start::Carried { .. } | Start::Wound(_) => {
                self.go(&mut state, first);
            }
        }
        cells.copy_from_slice(&state);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        let softened = |travel: f64| 1.0 + self.m * libm::expm1(-travel / self.n);
        let mut factor = softened(state[0]);
        for (r, e) in signal.iter_mut().zip(span.strain) {
            if self.go(&mut state, *e) {
                factor = softened(state[0]);
            }
            *r = self.r0 + (*r - self.r0) * factor;
        }
        cells.copy_from_slice(&state);
    }
}

//! The rubber of the muscle creeps.

use stretch_operators::{MeanReversion, Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The rubber of the muscle creeps.
#[derive(Debug)]
pub(super) struct MuscleCreep;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("c", "1", 0.0, 0.3, 0.1),
    EffectParameter::shape("tau", "s", 0.5, 40.0, 4.0),
];

impl Effect for MuscleCreep {
    fn name(&self) -> &'static str {
        "muscle_creep"
    }

    fn stage(&self) -> Stage {
        Stage::Muscle
    }

    fn equation(&self) -> &'static str {
        "k_s -> k_s + c (mean_rev(k_s, tau) - k_s)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        let lag = MeanReversion::new(values[1], around.contraction_stroke, around.grid);
        Action::StaticContraction(Box::new(Creep { c: values[0], lag }))
    }
}

#[derive(Debug)]
struct Creep {
    c: f64,
    lag: MeanReversion,
}

impl Operator for Creep {
    fn cells(&self) -> usize {
        MeanReversion::CELLS
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        self.lag.begin(start, first, cells);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        self.lag.run(span, cells, signal, |x, z| x + self.c * (z - x));
    }
}

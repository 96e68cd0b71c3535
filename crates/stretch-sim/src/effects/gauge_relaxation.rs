//! The gauge overshoots a quick strain and relaxes.

use stretch_operators::{MeanReversion, Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The gauge overshoots a quick strain and relaxes.
#[derive(Debug)]
pub(super) struct GaugeRelaxation;

static PARAMETERS: &[EffectParameter] = &[
    EffectParameter::strength("c", "1", -0.3, 0.6, 0.1),
    EffectParameter::shape("tau", "s", 0.02, 4.0, 0.3),
];

impl Effect for GaugeRelaxation {
    fn name(&self) -> &'static str {
        "gauge_relaxation"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "e -> e + c (e - mean_rev(e, tau))"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        let lag = MeanReversion::new(values[1], around.strain_stroke, around.grid);
        Action::Strain(Box::new(Relaxation { c: values[0], lag }))
    }
}

#[derive(Debug)]
struct Relaxation {
    c: f64,
    lag: MeanReversion,
}

impl Operator for Relaxation {
    fn cells(&self) -> usize {
        MeanReversion::CELLS
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        self.lag.begin(start, first, cells);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        self.lag.run(span, cells, signal, |x, z| x + self.c * (x - z));
    }
}

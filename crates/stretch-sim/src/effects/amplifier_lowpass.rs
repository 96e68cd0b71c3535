//! The amplifier is slow.

use stretch_operators::{MeanReversion, Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The amplifier is slow.
#[derive(Debug)]
pub(super) struct AmplifierLowpass;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("tau", "s", 0.0, 0.4, 0.05)];

impl Effect for AmplifierLowpass {
    fn name(&self) -> &'static str {
        "amplifier_lowpass"
    }

    fn stage(&self) -> Stage {
        Stage::Sensing
    }

    fn equation(&self) -> &'static str {
        "v -> mean_rev(v, tau)"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::Volts(Box::new(Lowpass(MeanReversion::new(
            values[0],
            around.volts_stroke,
            around.grid,
        ))))
    }
}

#[derive(Debug)]
struct Lowpass(MeanReversion);

impl Operator for Lowpass {
    fn cells(&self) -> usize {
        MeanReversion::CELLS
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        // Powered and settled before every trial, whatever came before.
        self.0.begin(Start::Settled, first, cells);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        self.0.run(span, cells, signal, |_, z| z);
    }
}

//! The catalogue's effects with the freedom of form that measured rigs ask for.
//!
//! An effect is named by what causes it, not by the curve it is written with: knees are sharper or softer, relaxation has
//! more than one time constant, loops turn sooner or later. Each effect here has its catalogue's name and parameters
//! and one more, its form; at the form's usual value it is the catalogue's own.

pub(crate) mod commands;
mod knees;
mod lags;
mod laws;
mod loops;
mod shapes;

use stretch_sim::Effect;

/// Effects that stand in for the catalogue's of the same name.
static FORMS: &[&dyn Effect] = &[
    &laws::SUPPLY_SAG,
    &commands::VALVE_DEADBAND,
    &laws::LEAK,
    &laws::CHAMBER_VOLUME,
    &loops::MUSCLE_HYSTERESIS,
    &lags::MUSCLE_CREEP,
    &lags::CROSSBEAM_INERTIA,
    &knees::SLEEVE_SLACK,
    &loops::SLEEVE_SLIP,
    &shapes::PRESSURE_CROSSTALK,
    &loops::GAUGE_HYSTERESIS,
    &lags::GAUGE_RELAXATION,
    &shapes::GAUGE_SOFTENING,
    &shapes::GAUGE_NONLINEARITY,
    &shapes::THERMAL_DRIFT,
    &lags::SELF_HEATING,
    &knees::AMPLIFIER_SATURATION,
    &lags::AMPLIFIER_LOWPASS,
    &commands::CHANNEL_SKEW,
    &shapes::POT_NONLINEARITY,
    &loops::POT_BACKLASH,
];

/// Names of the parameters that are forms.
pub(super) const NAMES: &[&str] = &[
    "knee", "spread", "second", "power", "skew", "softness", "gate", "outlet", "wobble", "rate",
    "settle_s", "damping", "bend", "lag_s",
];

/// The effect that stands in for one of the catalogue's.
pub(super) fn form_of(effect: &'static dyn Effect) -> &'static dyn Effect {
    FORMS.iter().copied().find(|f| f.name() == effect.name()).unwrap_or(effect)
}

/// A form: the catalogue's name, its parameters with one more, and how it acts.
#[derive(Clone, Copy)]
pub(super) struct Form {
    name: &'static str,
    stage: stretch_sim::Stage,
    equation: &'static str,
    parameters: &'static [stretch_sim::EffectParameter],
    needs: Option<&'static str>,
    action: fn(&[f64], &stretch_sim::Surroundings<'_>) -> stretch_sim::Action,
}

impl std::fmt::Debug for Form {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Form").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Effect for Form {
    fn name(&self) -> &'static str {
        self.name
    }

    fn stage(&self) -> stretch_sim::Stage {
        self.stage
    }

    fn equation(&self) -> &'static str {
        self.equation
    }

    fn parameters(&self) -> &'static [stretch_sim::EffectParameter] {
        self.parameters
    }

    fn action(
        &self,
        values: &[f64],
        around: &stretch_sim::Surroundings<'_>,
    ) -> stretch_sim::Action {
        (self.action)(values, around)
    }

    fn needs(&self) -> Option<&'static str> {
        self.needs
    }
}

/// A form that is walked in equal differences.
const fn linear(
    name: &'static str,
    min: f64,
    max: f64,
    typical: f64,
) -> stretch_sim::EffectParameter {
    stretch_sim::EffectParameter {
        scale: stretch_sim::Scale::Linear,
        ..stretch_sim::EffectParameter::shape(name, "1", min, max, typical)
    }
}

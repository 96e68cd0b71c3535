//! The amplifier's output is bounded.

use stretch_effects::Knees;

use crate::{
    effects::{Action, Effect, EffectParameter, Extent, Form, Need},
    sketch::knees,
    stage::Stage,
};

/// Rails that no signal reaches, V.
const LOW_V: f64 = 0.5;
const HIGH_V: f64 = 3.3;

/// The amplifier's output is bounded.
pub(super) static AMPLIFIER_SATURATION: Effect = Effect {
    name: "amplifier_saturation",
    words: "the amplifier runs into its limit",
    stage: Stage::Sensing,
    equation: "v cannot leave [v_lo, v_hi], soft knees of the width given",
    parameters: &[
        EffectParameter::strength("v_lo", "V", LOW_V, 2.2, 1.4).off_at(LOW_V),
        EffectParameter::strength("v_hi", "V", 1.2, HIGH_V, 2.1).off_at(HIGH_V),
        EffectParameter::form("knee", "V", 0.0005, 0.06, Form { neutral: 0.01, usual: 0.01 }).log(),
    ],
    action: |values, _| {
        let [low, high] = rails(values);
        Action::Volts(Box::new(Knees { low, high, width: values[2] }))
    },
    twins: &["sleeve_slack"],
    needs: Some(Need::Amplifier),
    starts: Some(starts),
    sketch: Some(|v, around| knees(rails(v), v[2], around.volts())),
    ..Effect::PLAIN
};

/// Those that are reached.
fn rails(values: &[f64]) -> [Option<f64>; 2] {
    let bound = |v: f64, off: f64| (v != off).then_some(v);
    [bound(values[0], LOW_V), bound(values[1], HIGH_V)]
}

/// A little inside of either end, with the usual knee and one as sharp as they come: from a soft one a fit does not find there.
fn starts(extent: &Extent) -> Vec<Vec<f64>> {
    let (low, high) = extent.volts;
    let within = [0.004, 0.015, 0.05, 0.15, 0.4];
    let with = |knee: f64| {
        let tops = within.map(|d| vec![LOW_V, (high - d).max(1.25), knee]);
        [tops, within.map(|d| vec![(low + d).max(0.51), HIGH_V, knee])].concat()
    };
    [with(0.01), with(0.15 * 0.01)].concat()
}

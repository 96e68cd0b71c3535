//! The sleeve goes slack: the gauge cannot be compressed.

use stretch_effects::Knees;

use crate::{
    effects::{Action, Effect, EffectParameter, Extent, Form},
    sketch::knees,
    stage::Stage,
};

/// The sleeve goes slack: the gauge cannot be compressed.
pub(super) static SLEEVE_SLACK: Effect = Effect {
    name: "sleeve_slack",
    words: "the sleeve goes slack when the muscle is short",
    stage: Stage::Sensing,
    equation: "e -> e_s + knee ln(1 + exp((e - e_s)/knee)): cannot fall below e_s",
    parameters: &[
        // Where the pre-stretch is not known, neither is where the sleeve goes slack: below nothing by the nominal rig's count.
        EffectParameter::strength("e_s", "strain", -0.05, 0.2, 0.08).off_at(-0.05),
        EffectParameter::form(
            "knee",
            "strain",
            0.0001,
            0.015,
            Form { neutral: 0.003, usual: 0.003 },
        )
        .log(),
    ],
    action: |values, _| {
        Action::Strain(Box::new(Knees { low: Some(values[0]), high: None, width: values[1] }))
    },
    twins: &["amplifier_saturation"],
    starts: Some(starts),
    sketch: Some(|v, around| knees([Some(v[0]), None], v[1], around.strain())),
    ..Effect::PLAIN
};

/// A little above the least strain, with the usual knee and one as sharp as they come: from a soft one a fit does not find there.
fn starts(extent: &Extent) -> Vec<Vec<f64>> {
    let above = [0.001, 0.004, 0.01, 0.03, 0.07].map(|above| (extent.strain + above).max(-0.049));
    let with = |knee: f64| above.map(|e_s| vec![e_s, knee]);
    [with(0.003), with(0.15 * 0.003)].concat()
}

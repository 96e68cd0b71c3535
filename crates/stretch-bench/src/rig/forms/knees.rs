//! Thresholds with a knee of any width.

use stretch_sim::{Action, EffectParameter, Operator, Span, Stage, soft_ceiling, soft_floor};

use super::Form;

pub(super) static SLEEVE_SLACK: Form = Form {
    name: "sleeve_slack",
    stage: Stage::Sensing,
    equation: "e -> e_s + knee ln(1 + exp((e - e_s)/knee))",
    parameters: &[
        // Where the pre-stretch is not known, neither is where the sleeve goes slack: below nothing by the nominal rig's count.
        EffectParameter {
            off: Some(-0.05),
            ..EffectParameter::strength("e_s", "strain", -0.05, 0.2, 0.08)
        },
        EffectParameter::shape("knee", "strain", 0.0001, 0.015, 0.003),
    ],
    needs: None,
    action: |v, around| {
        Action::Strain(Box::new(Rails {
            low: Some(v[0]),
            high: None,
            knee: v[1] * around.strain_unit,
        }))
    },
};

pub(super) static AMPLIFIER_SATURATION: Form = Form {
    name: "amplifier_saturation",
    stage: Stage::Sensing,
    equation: "v cannot leave [v_lo, v_hi], knees of the width given",
    parameters: &[
        EffectParameter { off: Some(0.5), ..EffectParameter::strength("v_lo", "V", 0.5, 2.2, 1.4) },
        EffectParameter { off: Some(3.3), ..EffectParameter::strength("v_hi", "V", 1.2, 3.3, 2.1) },
        EffectParameter::shape("knee", "V", 0.0005, 0.06, 0.01),
    ],
    needs: Some("an amplifier"),
    action: |v, _| {
        Action::Volts(Box::new(Rails {
            low: (v[0] != 0.5).then_some(v[0]),
            high: (v[1] != 3.3).then_some(v[1]),
            knee: v[2],
        }))
    },
};

#[derive(Debug)]
struct Rails {
    low: Option<f64>,
    high: Option<f64>,
    knee: f64,
}

impl Operator for Rails {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        if let Some(low) = self.low {
            signal.iter_mut().for_each(|x| *x = soft_floor(*x, low, self.knee));
        }
        if let Some(high) = self.high {
            signal.iter_mut().for_each(|x| *x = soft_ceiling(*x, high, self.knee));
        }
    }
}

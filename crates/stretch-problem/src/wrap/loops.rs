//! Wrappers that take another path on the way back, and those that take none at first.

use stretch_effects::{Backlash, BoucWen, DeadZone, Loops, PrandtlIshlinskii};

use super::kind::{
    Family,
    Side::{Input, Output},
    Wrapper, form, shape, strength,
};

pub(super) static DEAD_ZONE: Wrapper = Wrapper {
    name: "dead_zone",
    words: "small values do nothing",
    equation: "y = x - clamp(x, -w, w)",
    usual: &[Input],
    parameters: |e, unit| {
        let size = e.low.abs().max(e.high.abs());
        vec![strength("w", unit, 0.0, 0.5 * size), form("softness", "1", [0.0, 1.0], 0.0)]
    },
    operator: |v, _, _| Box::new(DeadZone { w: v[0], softness: v[1] }),
    starts: Some(|e| {
        let size = e.low.abs().max(e.high.abs());
        [0.02, 0.1, 0.25].map(|k| vec![k * size, 0.0]).into()
    }),
    twins: &["backlash"],
    ..Wrapper::PLAIN
};

pub(super) static BACKLASH: Wrapper = Wrapper {
    name: "backlash",
    words: "it has play: it follows once a gap is taken up",
    equation: "y = mean of play(x, w {1 - softness, 1, 1 + softness})",
    usual: &[Input, Output],
    parameters: |e, unit| {
        vec![strength("w", unit, 0.0, 0.2 * e.span()), form("softness", "1", [0.0, 0.6], 0.2)]
    },
    starts: Some(|e| [0.005, 0.03, 0.1].map(|k| vec![k * e.span(), 0.2]).into()),
    operator: |v, _, _| Box::new(Backlash::soft(v[0], v[1])),
    twins: &["hysteresis", "bouc_wen", "dead_zone"],
    family: Some((Family::Loop, |v| v[0])),
    ..Wrapper::PLAIN
};

pub(super) static HYSTERESIS: Wrapper = Wrapper {
    name: "hysteresis",
    words: "it takes another path on the way back (Prandtl-Ishlinskii)",
    equation: "y = x - h mean of (x - play(x, s {spread^2, spread, 1}))",
    usual: &[Output],
    parameters: |e, unit| {
        vec![
            strength("h", "1", 0.0, 0.6),
            shape("s", unit, 0.01 * e.span(), 0.5 * e.span()),
            form("spread", "1", [0.15, 0.95], 0.5),
        ]
    },
    operator: |v, _, _| Box::new(PrandtlIshlinskii::new(Loops { h: v[0], s: v[1], spread: v[2] })),
    twins: &["backlash", "bouc_wen"],
    family: Some((Family::Loop, |v| v[0] * v[1] * (1.0 + v[2] + v[2] * v[2]) / 3.0)),
    ..Wrapper::PLAIN
};

pub(super) static BOUC_WEN: Wrapper = Wrapper {
    name: "bouc_wen",
    words: "it turns back on a smooth loop (Bouc-Wen)",
    equation: "y = x - c u, du = dx/s (1 - u sign(dx)) where u dx > 0, else dx/s",
    usual: &[Output],
    parameters: |e, unit| {
        vec![
            strength("c", unit, -0.15 * e.span(), 0.15 * e.span()),
            shape("s", unit, 0.01 * e.span(), 0.5 * e.span()),
        ]
    },
    operator: |v, _, _| Box::new(BoucWen { c: v[0], s: v[1] }),
    twins: &["backlash", "hysteresis"],
    family: Some((Family::Loop, |v| v[0])),
    ..Wrapper::PLAIN
};

//! Wrappers that add something: friction, other channels, the mains.

use stretch_effects::{Crosstalk, Friction, Hum};

use super::kind::{
    Beside,
    Side::{self, Output},
    Wrapper, form, log_form, shape, strength,
};

/// Where friction is looked for: on forces and torques only, whichever side they are on.
const FORCES: &[Side] = &[Side::Input, Side::Output];

pub(super) static COULOMB: Wrapper = Wrapper {
    name: "coulomb_friction",
    words: "it rubs by direction, whatever the speed",
    equation: "y = x + f tanh(v/width)(1 + lopsided sign(v)) behind the stage, x - the same in front of it",
    usual: FORCES,
    beside: Beside::Velocity,
    parameters: |e, unit| {
        let v = e.beside_size();
        vec![
            strength("f", unit, 0.0, 0.5 * e.span()),
            log_form("width", "velocity", [1e-4 * v, 0.1 * v], 0.01 * v),
            form("lopsided", "1", [-0.5, 0.5], 0.0),
        ]
    },
    operator: |v, _, _| {
        Box::new(Friction { coulomb: v[0], width: v[1], lopsided: v[2], ..Friction::default() })
    },
    twins: &["stribeck_friction", "viscous_friction"],
    ..Wrapper::PLAIN
};

pub(super) static VISCOUS: Wrapper = Wrapper {
    name: "viscous_friction",
    words: "it rubs in proportion to the speed",
    equation: "y = x + b v behind the stage, x - b v in front of it",
    usual: FORCES,
    beside: Beside::Velocity,
    parameters: |e, unit| {
        let most = 0.5 * e.span() / e.beside_size().max(1e-300);
        vec![strength("b", &format!("{unit}/velocity"), -0.2 * most, most)]
    },
    operator: |v, _, _| Box::new(Friction { viscous: v[0], ..Friction::default() }),
    twins: &["coulomb_friction"],
    ..Wrapper::PLAIN
};

pub(super) static STRIBECK: Wrapper = Wrapper {
    name: "stribeck_friction",
    words: "it rubs more while it is slow",
    equation: "y = x + tanh(v/width) more exp(-(v/slow)^2) behind the stage, x - the same in front of it",
    usual: FORCES,
    beside: Beside::Velocity,
    parameters: |e, unit| {
        let v = e.beside_size();
        vec![
            strength("more", unit, 0.0, 0.5 * e.span()),
            shape("slow", "velocity", 0.01 * v, 0.5 * v),
            log_form("width", "velocity", [1e-4 * v, 0.1 * v], 0.01 * v),
        ]
    },
    operator: |v, _, _| {
        Box::new(Friction { more: v[0], slow: v[1], width: v[2], ..Friction::default() })
    },
    twins: &["coulomb_friction"],
    ..Wrapper::PLAIN
};

pub(super) static CROSSTALK: Wrapper = Wrapper {
    name: "crosstalk",
    words: "another channel talks across to it",
    equation: "y = x + c z (1 + bend z), z the other channel from its middle, over its span",
    usual: &[Output],
    beside: Beside::Another,
    parameters: |e, unit| {
        let most = 0.3 * e.span();
        vec![strength("c", unit, -most, most), form("bend", "1", [-0.6, 0.6], 0.0)]
    },
    starts: Some(|e| [-0.03, 0.03].map(|k| vec![k * e.span(), 0.0]).into()),
    operator: |v, e, _| {
        let [low, high] = e.beside;
        Box::new(Crosstalk { c: v[0], bend: v[1], middle: 0.5 * (low + high), span: high - low })
    },
    ..Wrapper::PLAIN
};

pub(super) static HUM: Wrapper = Wrapper {
    name: "hum",
    words: "it picks up the mains",
    equation: "y = x + a sin(2 pi f t + phase), the phase found in the record second by second",
    usual: &[Output],
    parameters: |e, unit| {
        let mut f = shape("f", "Hz", 50.0, 60.0);
        f.is_log = false;
        f.is_fitted = false;
        vec![strength("a", unit, 0.0, 0.1 * e.span()), f]
    },
    starts: Some(|e| {
        let one = |f: f64| [0.002, 0.02].map(|k| vec![k * e.span(), f]);
        [one(50.0), one(60.0)].concat()
    }),
    operator: |v, _, _| Box::new(Hum { a: v[0], f_hz: v[1], phase: std::f64::consts::FRAC_PI_4 }),
    is_found: true,
    least_rate_hz: 90.0,
    ..Wrapper::PLAIN
};

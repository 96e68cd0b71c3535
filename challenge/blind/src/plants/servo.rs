//! A servo: a motor of first order turns a load through a gearbox and a soft shaft.
//!
//! w' = (gain u - w)/tau and angle' = w/ratio, load' = (angle - load)/soft.

use super::label::Form;
use super::plant::{
    Action, Candidate, Parameter, PlantSpec, StageSpec, backlash, dead_zone, delay, drift, lag,
    relaxation, saturation,
};

/// Dry friction in the drive, rad/s: f tanh(w/width), larger at small speeds if the spread is not
/// zero.
fn friction(w: f64, f: f64, form: &Form, _: f64) -> f64 {
    let direction = 1.0 + form.asymmetry * w.signum();
    let slow = 1.0 + form.spread * (-(w / 6.0).powi(2)).exp();
    f * direction * slow * (w / (1.0 + 4.0 * form.softness)).tanh()
}

fn drag(w: f64, c: f64, form: &Form, _: f64) -> f64 {
    c * w * w.abs().powf(1.0 + form.softness) / 100f64.powf(1.0 + form.softness)
}

/// A supply whose voltage falls under load: the loss is proportional to u |u|. Not in the
/// catalogue.
fn sagging(_: f64, c: f64, _: &Form, u: f64) -> f64 {
    20.0 * c * u * u.abs() / 6.0
}

/// A magnetic force of the motor that varies like a sine of its speed. Not in the catalogue.
fn resonance(w: f64, c: f64, _: &Form, _: f64) -> f64 {
    c * (w / 9.0).sin()
}

pub(super) static SERVO: PlantSpec = PlantSpec {
    name: "servo",
    dt_s: 0.01,
    samples: 400,
    input: "command_V",
    input_unit: "V",
    span: (-6.0, 6.0),
    parameters: &[
        Parameter { name: "gain", unit: "rad/s/V", value: 20.0, tolerance: 0.05, stage: 0 },
        Parameter { name: "tau", unit: "s", value: 0.1, tolerance: 0.1, stage: 0 },
        Parameter { name: "ratio", unit: "1", value: 20.0, tolerance: 0.01, stage: 1 },
        Parameter { name: "soft", unit: "s", value: 0.05, tolerance: 0.1, stage: 1 },
    ],
    stages: [
        StageSpec {
            name: "motor",
            output: "speed_rad_s",
            unit: "rad/s",
            noise: 0.3,
            derivative: |x, u, p, taken| [(p[0] * u - taken - x[0]) / p[1], 0.0],
            rest: [0.0, 0.0],
            shown: 0,
            is_held: true,
        },
        StageSpec {
            name: "gear",
            output: "load_rad",
            unit: "rad",
            noise: 0.01,
            derivative: |x, w, p, _| [w / p[2], (x[0] - x[1]) / p[3]],
            rest: [0.0, 0.0],
            shown: 1,
            is_held: false,
        },
    ],
    candidates: &[
        Candidate::new("friction", 0, Action::Inside(friction), (0.0, 30.0)),
        Candidate::new("drag", 0, Action::Inside(drag), (0.0, 60.0)),
        Candidate::new("motor.input.delay", 0, Action::Before(delay), (0.0, 0.1)),
        Candidate::new("motor.input.dead_zone", 0, Action::Before(dead_zone), (0.0, 1.5)),
        Candidate::new("motor.input.saturation", 0, Action::Before(saturation), (6.5, 2.0)),
        Candidate::new("gear.output.backlash", 1, Action::Behind(backlash), (0.0, 0.3)),
        Candidate::new("gear.output.lag", 1, Action::Behind(lag), (0.0, 0.15)),
        Candidate::new("gear.output.drift", 1, Action::Behind(drift), (0.0, 0.4)),
        Candidate::new(
            "gear.output.relaxation",
            1,
            Action::Behind(|x, s, f, g| relaxation(x, s, 0.6, f, g)),
            (0.0, 0.4),
        ),
    ],
    foreign: &[
        Candidate::new("supply_sag", 0, Action::Inside(sagging), (0.0, 0.5)),
        Candidate::new("speed_ripple", 0, Action::Inside(resonance), (0.0, 25.0)),
    ],
    effects: "[[effect]]\nname = \"friction\"\nunit = \"rad/s\"\nrange = [0.0, 40.0]\noff = 0.0\nstages = [\"motor\"]\n\n\
              [[effect]]\nname = \"drag\"\nunit = \"rad/s\"\nrange = [0.0, 80.0]\noff = 0.0\nstages = [\"motor\"]\n",
};

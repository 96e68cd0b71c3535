//! A heated block and a probe in it: C T' = P - h (T - 20) and probe' = (T - probe)/tau.

use super::label::Form;
use super::plant::{
    Action, Candidate, Parameter, PlantSpec, StageSpec, dead_zone, delay, drift, hysteresis, lag,
    relaxation, saturation,
};

/// Radiation, W: c (T^4 - 293^4)/1e9 with the absolute temperature T. The exponent is 4 plus the
/// softness.
fn radiation(t: f64, c: f64, form: &Form, _: f64) -> f64 {
    let power = 4.0 + form.softness;
    let ratio = (t + 273.15) / 293.15;
    c * 293.15f64.powi(4) / 1e9 * (ratio.powf(power) - 1.0)
}

/// A fan that runs while the block is hot, W: the heat transfer coefficient rises at about 50 degC.
fn fan(t: f64, c: f64, form: &Form, _: f64) -> f64 {
    let width = 1.0 + 8.0 * form.softness + 4.0 * form.spread;
    c * (t - 20.0) / (1.0 + ((50.0 + 20.0 * form.asymmetry - t) / width).exp())
}

/// Melting: a part of the heat goes into a phase change near 45 degC. Not in the catalogue.
fn melting(t: f64, c: f64, _: &Form, p: f64) -> f64 {
    c * (p - 0.8 * (t - 20.0)) * (-((t - 45.0) / 6.0).powi(2)).exp()
}

/// A heater whose power falls while the block is hot. Not in the catalogue.
fn heater(t: f64, c: f64, _: &Form, p: f64) -> f64 {
    c * p * ((t - 20.0) / 60.0).powi(2)
}

pub(super) static THERMAL: PlantSpec = PlantSpec {
    name: "thermal",
    dt_s: 2.0,
    samples: 400,
    input: "heater_W",
    input_unit: "W",
    span: (0.0, 60.0),
    parameters: &[
        Parameter { name: "capacity", unit: "J/K", value: 120.0, tolerance: 0.05, stage: 0 },
        Parameter { name: "loss", unit: "W/K", value: 0.8, tolerance: 0.1, stage: 0 },
        Parameter { name: "probe_tau", unit: "s", value: 12.0, tolerance: 0.1, stage: 1 },
    ],
    stages: [
        StageSpec {
            name: "block",
            output: "block_degC",
            unit: "degC",
            noise: 0.1,
            derivative: |x, power, p, taken| [(power - taken - p[1] * (x[0] - 20.0)) / p[0], 0.0],
            rest: [20.0, 0.0],
            shown: 0,
            is_held: true,
        },
        StageSpec {
            name: "probe",
            output: "probe_degC",
            unit: "degC",
            noise: 0.1,
            derivative: |x, t, p, _| [(t - x[0]) / p[2], 0.0],
            rest: [20.0, 0.0],
            shown: 0,
            is_held: false,
        },
    ],
    candidates: &[
        Candidate::new("radiation", 0, Action::Inside(radiation), (0.0, 3.0)),
        Candidate::new("fan", 0, Action::Inside(fan), (0.0, 0.6)),
        Candidate::new("block.input.delay", 0, Action::Before(delay), (0.0, 20.0)),
        Candidate::new("block.input.dead_zone", 0, Action::Before(dead_zone), (0.0, 15.0)),
        Candidate::new("block.input.saturation", 0, Action::Before(saturation), (62.0, 25.0)),
        Candidate::new(
            "probe.output.hysteresis",
            1,
            Action::Behind(|x, s, f, _| hysteresis(x, s, 6.0, f)),
            (0.0, 0.6),
        ),
        Candidate::new("probe.output.lag", 1, Action::Behind(lag), (0.0, 30.0)),
        Candidate::new("probe.output.drift", 1, Action::Behind(drift), (0.0, 5.0)),
        Candidate::new(
            "probe.output.relaxation",
            1,
            Action::Behind(|x, s, f, g| relaxation(x, s, 80.0, f, g)),
            (0.0, 0.4),
        ),
    ],
    foreign: &[
        Candidate::new("melting", 0, Action::Inside(melting), (0.0, 0.8)),
        Candidate::new("heater_fade", 0, Action::Inside(heater), (0.0, 0.6)),
    ],
    effects: "[[effect]]\nname = \"radiation\"\nunit = \"1e-9 W/K^4\"\nrange = [0.0, 4.0]\noff = 0.0\nstages = [\"block\"]\n\n\
              [[effect]]\nname = \"fan\"\nunit = \"W/K\"\nrange = [0.0, 0.8]\noff = 0.0\nstages = [\"block\"]\n",
};

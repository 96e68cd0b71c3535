//! Effects of supply, valves, chamber, muscle and the crossbeam that it lifts.

use stretch_effects::{
    Action, Acts, DeadBand, Droop, Effect, EffectParameter, Form, Law, Place, Quantity, RigStage,
    Sketch, each,
    kinds::{HYSTERESIS, RELAXATION, SECOND_ORDER_LAG},
    pairs,
};

/// The supply pressure falls with the flow that is drawn from it.
pub(super) static SUPPLY_SAG: Effect = Effect {
    name: "supply_sag",
    title: "the supply's sag",
    words: "the supply pressure sags while air is drawn",
    stage: RigStage::Pneumatics,
    equation: "P_s -> P_s - y, y = mean_rev(r q_in, lag_s)",
    parameters: &[
        EffectParameter::strength("r", "Pa s/kg", 0.0, 4e8, 1e8),
        EffectParameter::form("lag_s", "s", 0.1, 1.5, Form { neutral: 0.5, usual: 0.5 }).log(),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Droop(Box::new(Sag { r: values[0], lag_s: values[1] })),
        sketch: Some(|v, _| {
            let state =
                "how far the supply has fallen: a state of the chamber's equations, 0 at rest";
            let rate = "rate of the droop; the valve sees P_s - droop";
            Sketch::of(Quantity::new("droop", "Pa", state), "let y = (R * flow - droop) / LAG")
                .beside(Quantity::new("flow", "kg/s", "mass flow through the inlet"))
                .giving(Quantity::new("y", "Pa/s", rate))
                .with_all(&[("R", v[0], "Pa s/kg"), ("LAG", v[1], "s")])
        }),
    },
    starts: Some(|_| each([3e7, 1.5e8])),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Sag {
    r: f64,
    lag_s: f64,
}

impl Droop for Sag {
    #[inline]
    fn rate(&self, droop_pa: f64, flow_kg_s: f64) -> f64 {
        (self.r * flow_kg_s - droop_pa) / self.lag_s
    }

    fn relaxed(&self, droop_pa: f64, rest_s: f64) -> f64 {
        droop_pa * libm::exp(-rest_s / self.lag_s)
    }
}

/// The valves act late.
pub(super) static VALVE_DELAY: Effect = Effect {
    name: "valve_delay",
    title: "the valves' delay",
    words: "the valves act late",
    stage: RigStage::Pneumatics,
    equation: "u(t) -> u(t - delay_s)",
    parameters: &[EffectParameter::strength("delay_s", "s", 0.0, 0.12, 0.03)],
    acts: Acts::Own {
        action: |values, _| Action::Delay(values[0]),
        sketch: Some(|v, around| delay_sketch(v[0], around.grid.dt_s())),
    },
    twins: &["crossbeam_inertia"],
    starts: Some(|_| each([0.004, 0.015, 0.05])),
    ..Effect::PLAIN
};

/// Returns the sketch (portable source code) of the delay: it looks up a valve's command at a time.
fn delay_sketch(delay_s: f64, dt_s: f64) -> Sketch {
    let body = "let k = floor((t - DELAY) / DT)
        var y = 0
        if k >= 0
        y = u[min(k, n - 1)]
        end";
    let commands = "commanded openings of a valve, each held for a sample";
    let opening = "opening that acts at that time; shut before the first command arrives";
    Sketch::of(Quantity::new("u", "1", commands).record(), body)
        .beside(Quantity::COUNT)
        .beside(Quantity::new("t", "s", "time since the trial began"))
        .giving(Quantity::new("y", "1", opening))
        .with_all(&[("DELAY", delay_s, "s"), ("DT", dt_s, "s")])
}

/// The valves stay shut below a smallest command.
pub(super) static VALVE_DEADBAND: Effect = Effect {
    name: "valve_deadband",
    title: "the valves' dead band",
    words: "the valves stay shut at small openings",
    stage: RigStage::Pneumatics,
    equation: "u -> max(0, (u - d(u))/(1 - d(1))), d(u) = u_db (1 - exp(-u/(u_db softness))) before u_eff; conductance times 1 - exp(-u/(u_db gate)); u_db times outlet at the outlet, times 2 - outlet at the inlet",
    parameters: &[
        EffectParameter::strength("u_db", "1", 0.0, 0.11, 0.03),
        EffectParameter::form("softness", "1", 0.02, 1.5, Form { neutral: 0.0, usual: 0.1 }).log(),
        EffectParameter::form("gate", "1", 0.001, 2.0, Form { neutral: 0.0, usual: 0.01 }).log(),
        EffectParameter::form("outlet", "1", 0.0, 2.0, Form { neutral: 1.0, usual: 1.0 }),
    ],
    acts: Acts::Own {
        action: |values, around| {
            let [inlet, outlet] = valves(values, around.least_opening);
            Action::Commands([Box::new(inlet), Box::new(outlet)])
        },
        sketch: Some(|values, around| dead_band_sketch(&valves(values, around.least_opening))),
    },
    starts: Some(|_| dead_band_starts()),
    ..Effect::PLAIN
};

/// Returns start values of a fit: abrupt and gradual dead bands, different bands of the two valves, and a gate that
/// lets the slowest ramp through as pulses.
fn dead_band_starts() -> Vec<Vec<f64>> {
    let mut all = each([0.001, 0.01, 0.04]);
    all.extend([0.02, 0.06].map(|u| vec![u, 1.0, 0.01, 1.0]));
    all.extend([0.01, 0.03].map(|u| vec![u, 1.0, 0.01, 1.9]));
    all.extend([0.001, 0.002, 0.005, 0.015].map(|u| vec![u, 0.5, 0.5, 1.0]));
    all
}

/// Returns the dead bands of inlet and outlet. The band of the outlet is the effect's band times `outlet`; the band of
/// the inlet is the effect's band times 2 - `outlet`.
fn valves(values: &[f64], least: f64) -> [DeadBand; 2] {
    let [u_db, softness, gate, outlet] = [0, 1, 2, 3].map(|i| values[i]);
    [2.0 - outlet, outlet].map(|share| DeadBand { u_db: share * u_db, softness, gate, least })
}

/// Returns the sketch (portable source code): one function for both valves, with a state for each.
fn dead_band_sketch(valves: &[DeadBand; 2]) -> Sketch {
    let DeadBand { softness, gate, least, .. } = valves[0];
    let shifted = match softness {
        0.0 => "y = max(0, (u - band) / (1 - band))",
        _ => {
            "let du = -band * expm1(-u / (band * SOFTNESS))
            let d1 = -band * expm1(-1 / (band * SOFTNESS))
            y = max(0, (u - du) / (1 - d1))"
        }
    };
    let gated = match gate {
        0.0 => "",
        _ => {
            "if (y > 0) and (u > 0)
            let share = -(U_MIN + (1 - U_MIN) * y) * expm1(-u / (band * GATE))
            y = min(1, max(0, (share - U_MIN) / (1 - U_MIN)))
            if share < U_MIN
            s.owed = s.owed + share / U_MIN
            if s.owed >= 1
            s.owed = s.owed - 1
            y = 1e-12
            end
            end
            end"
        }
    };
    let body = format!(
        "let band = side * OUTLET + (1 - side) * INLET
        var y = u
        if band > 0
        y = 0
        if u > 0
        {shifted}
        end
        {gated}
        end"
    );
    let side = "0 at the inlet, 1 at the outlet; each has a separate state";
    let mut sketch = Sketch::of(Quantity::new("u", "1", "commanded opening, 0 to 1"), body)
        .beside(Quantity::new("side", "1", side))
        .giving(Quantity::new("y", "1", "opening after the dead band"))
        .with_all(&[("INLET", valves[0].u_db, "1"), ("OUTLET", valves[1].u_db, "1")]);
    if softness != 0.0 {
        sketch = sketch.with("SOFTNESS", softness, "1");
    }
    if gate != 0.0 {
        let numbers = [("GATE", gate, "1"), ("U_MIN", least, "1")];
        sketch = sketch.with_all(&numbers).cells(["owed"], "1", "0");
    }
    sketch
}

/// Air leaks out of the chamber.
pub(super) static LEAK: Effect = Effect {
    name: "leak",
    title: "the chamber's leak",
    words: "air leaks from the chamber",
    stage: RigStage::Pneumatics,
    equation: "q_leak = c p (p/620 kPa)^(power - 1), p above the atmosphere",
    parameters: &[
        EffectParameter::strength("c", "kg/(s Pa)", 0.0, 2e-10, 5e-11),
        EffectParameter::form("power", "1", 0.4, 2.0, Form { neutral: 1.0, usual: 1.0 }),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Leak(Box::new(Leak { c: values[0], excess: values[1] - 1.0 })),
        sketch: Some(|v, _| leak_sketch([v[0], v[1]])),
    },
    starts: Some(|_| each([1e-11])),
    ..Effect::PLAIN
};

/// Pressure at which a leak with any exponent has the same flow as a linear leak, Pa.
const AT_PA: f64 = 620e3;

#[derive(Debug)]
struct Leak {
    c: f64,
    /// Exponent of the leak minus one.
    excess: f64,
}

impl Law for Leak {
    #[inline]
    fn at(&self, p: f64) -> f64 {
        if p <= 0.0 {
            return self.c * p;
        }
        // An approximation of the power without a transcendental function. Its flow agrees with the power law at zero
        // and at full pressure.
        let x = p / AT_PA;
        let shape = if self.excess >= 0.0 {
            1.0 + self.excess * (x - 1.0)
        } else {
            (1.0 - self.excess) / (1.0 - self.excess * x)
        };
        self.c * p * shape.max(0.0)
    }
}

fn leak_sketch([c, power]: [f64; 2]) -> Sketch {
    let shape = if power >= 1.0 {
        "1 + (POWER - 1) * (p / P_AT - 1)"
    } else {
        "(2 - POWER) / (1 - (POWER - 1) * p / P_AT)"
    };
    let body = format!(
        "var y = C * p
        if p > 0
        y = C * p * max(0, {shape})
        end"
    );
    let flow = "mass flow out of the chamber; subtract it from m' = q_in - q_out";
    Sketch::of(Quantity::new("p", "Pa", "pressure in the chamber above the atmosphere"), body)
        .giving(Quantity::new("y", "kg/s", flow))
        .with_all(&[("C", c, "kg/(s Pa)"), ("POWER", power, "1"), ("P_AT", AT_PA, "Pa")])
}

/// The chamber grows as the muscle contracts.
pub(super) static CHAMBER_VOLUME: Effect = Effect {
    name: "chamber_volume",
    title: "the chamber's growing volume",
    words: "the chamber's volume grows as the muscle contracts",
    stage: RigStage::Pneumatics,
    equation: "V = V0 (1 + g y (1 + bend (1 - y))), y = k/k_max, with the p dV/dt term",
    parameters: &[
        EffectParameter::strength("g", "1", 0.0, 3.0, 1.0),
        EffectParameter::form("bend", "1", -0.7, 0.7, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::Own {
        action: |values, _| Action::Volume(Box::new(Growth { g: values[0], bend: values[1] })),
        sketch: Some(|v, _| {
            let body = "let y = 1 + G * x * (1 + BEND * (1 - x))";
            let volume = "V/V0; p = m R T/V then contains the p dV/dt term";
            Sketch::of(Quantity::new("x", "1", "contraction k/k_max"), body)
                .giving(Quantity::new("y", "1", volume))
                .with_all(&[("G", v[0], "1"), ("BEND", v[1], "1")])
        }),
    },
    starts: Some(|_| each([0.1, 1.0])),
    ..Effect::PLAIN
};

#[derive(Debug)]
struct Growth {
    g: f64,
    bend: f64,
}

impl Law for Growth {
    #[inline]
    fn at(&self, y: f64) -> f64 {
        1.0 + self.g * y * (1.0 + self.bend * (1.0 - y))
    }
}

/// Friction in the braid: the static contraction depends on its history.
pub(super) static MUSCLE_HYSTERESIS: Effect = Effect {
    name: "muscle_hysteresis",
    title: "the muscle's hysteresis",
    words: "the muscle follows another path on the way back",
    stage: RigStage::Muscle,
    equation: "k_s -> k_s - h mean of (k_s - play(k_s, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        EffectParameter::form("spread", "1", 0.15, 0.95, Form { neutral: 0.5, usual: 0.5 }),
    ],
    acts: Acts::at(&HYSTERESIS, Place::StaticContraction),
    twins: &["muscle_creep"],
    starts: Some(|_| pairs(0.1, [0.007, 0.02, 0.05])),
    ..Effect::PLAIN
};

/// The rubber of the muscle creeps.
pub(super) static MUSCLE_CREEP: Effect = Effect {
    name: "muscle_creep",
    title: "the muscle's creep",
    words: "the muscle creeps on after the pressure has settled",
    stage: RigStage::Muscle,
    equation: "k_s -> k_s + c (mean of mean_rev(k_s, tau {1/spread, 1, spread}) - k_s)",
    parameters: &[
        EffectParameter::strength("c", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("tau", "s", 0.5, 40.0, 4.0),
        EffectParameter::form("spread", "1", 1.0, 8.0, Form { neutral: 1.0, usual: 1.6 }).log(),
    ],
    acts: Acts::with(&RELAXATION, Place::StaticContraction, |v, _| vec![-v[0], v[1], v[2]]),
    twins: &["muscle_hysteresis"],
    starts: Some(|_| pairs(0.05, [0.6, 2.0, 6.0, 20.0])),
    ..Effect::PLAIN
};

/// The crossbeam has a mass, on the spring of the muscle.
pub(super) static CROSSBEAM_INERTIA: Effect = Effect {
    name: "crossbeam_inertia",
    title: "the crossbeam's inertia",
    words: "the crossbeam's mass overshoots and rings",
    stage: RigStage::Muscle,
    equation: "k'' = (k_lag - k - dry k'/sqrt(k'^2 + (0.5 dry/m)^2))/m^2 - (2 damping + drag |k'|) k'/m behind the lag: natural frequency 1/(2 pi m)",
    parameters: &[
        EffectParameter::strength("m", "s", 0.0, 0.08, 0.02),
        EffectParameter::form("damping", "1", 0.1, 0.6, Form { neutral: 0.25, usual: 0.25 }),
        EffectParameter::form("drag", "s", 0.0, 1.25, Form { neutral: 0.0, usual: 0.1 }),
        EffectParameter::form("dry", "strain", 0.0, 0.002, Form { neutral: 0.0, usual: 0.0003 }),
    ],
    acts: Acts::at(&SECOND_ORDER_LAG, Place::MovingContraction),
    twins: &["valve_delay"],
    starts: Some(|_| each([0.003, 0.01, 0.03])),
    ..Effect::PLAIN
};

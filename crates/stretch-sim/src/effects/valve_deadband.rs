//! The valves stay shut below a smallest command.

use stretch_effects::{
    Action, Acts, DeadBand, Effect, EffectParameter, Form, Quantity, RigStage, Sketch, each,
};

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
        sketch: Some(|values, around| sketch(&valves(values, around.least_opening))),
    },
    starts: Some(|_| starts()),
    ..Effect::PLAIN
};

/// Hard and gradual bands, different valves, and a gate that lets the slowest ramp through as
/// pulses.
fn starts() -> Vec<Vec<f64>> {
    let mut all = each([0.001, 0.01, 0.04]);
    all.extend([0.02, 0.06].map(|u| vec![u, 1.0, 0.01, 1.0]));
    all.extend([0.01, 0.03].map(|u| vec![u, 1.0, 0.01, 1.9]));
    all.extend([0.001, 0.002, 0.005, 0.015].map(|u| vec![u, 0.5, 0.5, 1.0]));
    all
}

/// Inlet and outlet, of which the outlet's band is `outlet` times the effect's, and the inlet's 2 - `outlet` times.
fn valves(values: &[f64], least: f64) -> [DeadBand; 2] {
    let [u_db, softness, gate, outlet] = [0, 1, 2, 3].map(|i| values[i]);
    [2.0 - outlet, outlet].map(|share| DeadBand { u_db: share * u_db, softness, gate, least })
}

/// One function for both valves, with a state for each.
fn sketch(valves: &[DeadBand; 2]) -> Sketch {
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
    let side = "0 at the inlet, 1 at the outlet; each has a state of its own";
    let mut sketch = Sketch::of(Quantity::new("u", "1", "commanded opening, 0 to 1"), body)
        .beside(Quantity::new("side", "1", side))
        .giving(Quantity::new("y", "1", "opening as the valve takes it"))
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

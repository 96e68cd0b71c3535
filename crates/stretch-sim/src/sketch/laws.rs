//! Terms of the chamber's equations.

use super::{Quantity, Sketch};

/// Flow through a leak.
pub(crate) fn leak([c, power, at_pa]: [f64; 3]) -> Sketch {
    let shape = if power >= 1.0 {
        "1 + (POWER - 1) * (p / P_AT - 1)"
    } else {
        "(2 - POWER) / (1 - (POWER - 1) * p / P_AT)"
    };
    Sketch {
        inputs: vec![Quantity::new("p", "Pa", "pressure in the chamber above the atmosphere")],
        output: Quantity::new(
            "y",
            "kg/s",
            "mass flow out of the chamber; less it from the net inflow of m' = q_in - q_out",
        ),
        constants: Sketch::constants(&[
            ("C", c, "kg/(s Pa)"),
            ("POWER", power, "1"),
            ("P_AT", at_pa, "Pa"),
        ]),
        state: Vec::new(),
        body: format!(
            "var y = C * p
            if p > 0
            y = C * p * max(0, {shape})
            end"
        ),
    }
}

/// Volume of a chamber that grows with the contraction.
pub(crate) fn growth([g, bend]: [f64; 2]) -> Sketch {
    Sketch {
        inputs: vec![Quantity::new("x", "1", "contraction k/k_max")],
        output: Quantity::new("y", "1", "V/V0; p = m R T/V then has the p dV/dt term in it"),
        constants: Sketch::constants(&[("G", g, "1"), ("BEND", bend, "1")]),
        state: Vec::new(),
        body: "let y = 1 + G * x * (1 + BEND * (1 - x))".into(),
    }
}

/// Rate of the droop of a supply.
pub(crate) fn droop([r, lag_s]: [f64; 2]) -> Sketch {
    Sketch {
        inputs: vec![
            Quantity::new(
                "droop",
                "Pa",
                "how far the supply has fallen: a state of the chamber's equations, 0 at rest",
            ),
            Quantity::new("flow", "kg/s", "mass flow through the inlet"),
        ],
        output: Quantity::new("y", "Pa/s", "rate of the droop; the valve sees P_s - droop"),
        constants: Sketch::constants(&[("R", r, "Pa s/kg"), ("LAG", lag_s, "s")]),
        state: Vec::new(),
        body: "let y = (R * flow - droop) / LAG".into(),
    }
}

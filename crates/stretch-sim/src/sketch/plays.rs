//! What depends on the way that was gone: play, hysteresis, softening, pulses of a valve.

use super::{Quantity, Sketch, cells};

/// Prandtl-Ishlinskii hysteresis: a share, the largest half-width, and the ratio of each to the next larger one.
pub(crate) fn loops([h, s, spread]: [f64; 3], x: Quantity) -> Sketch {
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&[("H", h, "1"), ("S", s, x.unit), ("SPREAD", spread, "1")]),
        state: cells(["a", "b", "c"], x.unit, x.name),
        body: "let rb = S * SPREAD
            let ra = rb * SPREAD
            s.a = max(x - ra, min(x + ra, s.a))
            s.b = max(x - rb, min(x + rb, s.b))
            s.c = max(x - S, min(x + S, s.c))
            let y = x - H * (x - (s.a + s.b + s.c) / 3)"
            .into(),
    }
}

/// Play of a half-width, or three around it.
pub(crate) fn backlash([w, spread]: [f64; 2], x: Quantity) -> Sketch {
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&[("W", w, x.unit), ("SPREAD", spread, "1")]),
        state: cells(["a", "b", "c"], x.unit, x.name),
        body: "let ra = W * (1 - SPREAD)
            let rc = W * (1 + SPREAD)
            s.a = max(x - ra, min(x + ra, s.a))
            s.b = max(x - W, min(x + W, s.b))
            s.c = max(x - rc, min(x + rc, s.c))
            let y = (s.a + s.b + s.c) / 3"
            .into(),
    }
}

/// The numbers of a [`softening`].
pub(crate) struct Soft {
    pub(crate) m: f64,
    pub(crate) n: f64,
    pub(crate) tail: f64,
    pub(crate) zero: f64,
    pub(crate) reversal: f64,
}

/// A response that weakens with the strain travelled.
pub(crate) fn softening(soft: &Soft, x: Quantity, e: Quantity) -> Sketch {
    let Soft { m, n, tail, zero, reversal } = *soft;
    let lost = match tail {
        0.0 => "expm1(-s.travel / N)",
        _ => "expm1(-log1p(TAIL * s.travel / N) / TAIL)",
    };
    let mut state = cells(["travel"], e.unit, "0");
    state.extend(cells(["reached"], e.unit, e.name));
    state.extend(cells(["direction"], "1", "0"));
    let mut constants = vec![("M", m, "1"), ("N", n, e.unit)];
    if tail != 0.0 {
        constants.push(("TAIL", tail, "1"));
    }
    constants.extend([("ZERO", zero, x.unit), ("REVERSAL", reversal, e.unit)]);
    Sketch {
        inputs: vec![x, e],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state,
        body: format!(
            "let moved = e - s.reached
            if (moved * s.direction > 0) or (abs(moved) > REVERSAL)
            s.travel = s.travel + abs(moved)
            s.reached = e
            s.direction = moved / abs(moved)
            end
            let y = ZERO + (x - ZERO) * (1 + M * {lost})"
        ),
    }
}

/// The numbers of a [`dead_band`].
#[derive(Default)]
pub(crate) struct Band {
    pub(crate) u_db: f64,
    pub(crate) softness: f64,
    pub(crate) gate: f64,
    pub(crate) outlet: f64,
    pub(crate) least: f64,
}

/// Valves that stay shut up to a least command; one state a valve.
pub(crate) fn dead_band(band: &Band) -> Sketch {
    let Band { u_db, softness, gate, outlet, least } = *band;
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
    let mut constants = vec![("U_DB", u_db, "1"), ("OUTLET", outlet, "1")];
    constants.extend([("SOFTNESS", softness, "1")].iter().filter(|_| softness != 0.0));
    if gate != 0.0 {
        constants.extend([("GATE", gate, "1"), ("U_MIN", least, "1")]);
    }
    Sketch {
        inputs: vec![
            Quantity::new("u", "1", "commanded opening, 0 to 1"),
            Quantity::new(
                "side",
                "1",
                "0 at the inlet, 1 at the outlet; each has a state of its own",
            ),
        ],
        output: Quantity::new("y", "1", "opening as the valve takes it"),
        constants: Sketch::constants(&constants),
        state: if gate == 0.0 { Vec::new() } else { cells(["owed"], "1", "0") },
        body: format!(
            "let band = U_DB * (side * OUTLET + (1 - side) * (2 - OUTLET))
            var y = u
            if band > 0
            y = 0
            if u > 0
            {shifted}
            end
            {gated}
            end"
        ),
    }
}

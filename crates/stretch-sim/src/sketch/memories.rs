//! What fades, swings, warms or drifts.
//!
//! A lag is taken exactly for an input that is a straight line from sample to sample: with k = exp(-DT/tau) and m = (1 - k) tau/DT
//! it is z = k z + (m - k) last + (1 - m) x.

use super::{Quantity, Sketch, cells};

/// What a sample of the record is apart from the next, s.
const DT: &str = "DT";

/// Memory that fades with a time constant, or three: y = x + share (x - mean of the lags).
pub(crate) fn fading([share, tau, spread]: [f64; 3], dt_s: f64, x: Quantity) -> Sketch {
    let one = |z: &str, t: &str| {
        format!(
            "let k{z} = exp(-DT / ({t}))
            let m{z} = (1 - k{z}) * ({t}) / DT
            s.{z} = k{z} * s.{z} + (m{z} - k{z}) * s.last + (1 - m{z}) * x\n"
        )
    };
    let mut constants = vec![("SHARE", share, "1"), ("TAU", tau, "s")];
    let (state, lags, mean) = if spread == 1.0 {
        (cells(["z", "last"], x.unit, x.name), one("z", "TAU"), "s.z")
    } else {
        constants.push(("SPREAD", spread, "1"));
        let lags = one("p", "TAU / SPREAD") + &one("q", "TAU") + &one("r", "TAU * SPREAD");
        (cells(["p", "q", "r", "last"], x.unit, x.name), lags, "(s.p + s.q + s.r) / 3")
    };
    constants.push((DT, dt_s, "s"));
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state,
        body: format!("{lags}s.last = x\nlet y = x + SHARE * (x - {mean})"),
    }
}

/// A low-pass of one or two poles.
pub(crate) fn lowpass([tau, second]: [f64; 2], dt_s: f64, x: Quantity) -> Sketch {
    let mut constants = vec![("TAU", tau, "s")];
    let first = "let k = exp(-DT / (TAU * (1 - SECOND)))
            let m = (1 - k) * TAU * (1 - SECOND) / DT
            let before = s.z
            s.z = k * s.z + (m - k) * s.last + (1 - m) * x
            s.last = x\n";
    let (state, body) = if second == 0.0 {
        let body = "let k = exp(-DT / TAU)
            let m = (1 - k) * TAU / DT
            s.z = k * s.z + (m - k) * s.last + (1 - m) * x
            s.last = x
            let y = s.z";
        (cells(["z", "last"], x.unit, x.name), body.to_owned())
    } else {
        constants.push(("SECOND", second, "1"));
        let second = "let k2 = exp(-DT / (TAU * SECOND))
            let m2 = (1 - k2) * TAU * SECOND / DT
            s.w = k2 * s.w + (m2 - k2) * before + (1 - m2) * s.z
            let y = s.w";
        (cells(["z", "last", "w"], x.unit, x.name), format!("{first}{second}"))
    };
    constants.push((DT, dt_s, "s"));
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state,
        body,
    }
}

/// A mass on a spring: m^2 y'' = x - y - 2 damping m y'.
pub(crate) fn swinging([m, damping]: [f64; 2], dt_s: f64, x: Quantity) -> Sketch {
    let mut state = cells(["at", "last"], x.unit, x.name);
    state.extend(cells(["speed"], "1/s", "0"));
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&[("M", m, "s"), ("DAMPING", damping, "1"), (DT, dt_s, "s")]),
        state,
        body: "let w = sqrt(1 - DAMPING * DAMPING) / M
            let sn = exp(-DAMPING * DT / M) * sin(w * DT) / w
            let cs = exp(-DAMPING * DT / M) * cos(w * DT)
            let slope = (x - s.last) / DT
            let trail = 2 * DAMPING * M * slope
            let p = s.at - s.last + trail
            let q = s.speed - slope
            s.at = x - trail + (cs + DAMPING / M * sn) * p + sn * q
            s.speed = slope - sn / (M * M) * p + (cs - DAMPING / M * sn) * q
            s.last = x
            let y = s.at"
            .into(),
    }
}

/// A gain that warms up from a trial's start.
pub(crate) fn warming([h, tau, spread]: [f64; 3], dt_s: f64, x: Quantity) -> Sketch {
    let mut constants = vec![("H", h, "1"), ("TAU", tau, "s")];
    let (state, body) = if spread == 1.0 {
        let body = "let y = x * (1 + H * (1 - s.left))
            s.left = s.left * exp(-DT / TAU)";
        (cells(["left"], "1", "1"), body)
    } else {
        constants.push(("SPREAD", spread, "1"));
        let body = "let y = x * (1 + H * (1 - (s.p + s.q + s.r) / 3))
            s.p = s.p * exp(-DT * SPREAD / TAU)
            s.q = s.q * exp(-DT / TAU)
            s.r = s.r * exp(-DT / (TAU * SPREAD))";
        (cells(["p", "q", "r"], "1", "1"), body)
    };
    constants.push((DT, dt_s, "s"));
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state,
        body: body.into(),
    }
}

/// A gain that drifts with session time.
pub(crate) fn drifting([d, settle]: [f64; 2], x: Quantity) -> Sketch {
    let t = Quantity::new("t", "s", "time since the session began");
    let mut constants = vec![("D", d, "1/s")];
    let body = if settle == 0.0 {
        "let y = x * (1 + D * t)"
    } else {
        constants.push(("SETTLE_PER_S", settle, "1/s"));
        "let y = x * (1 - D / SETTLE_PER_S * expm1(-SETTLE_PER_S * t))"
    };
    Sketch {
        inputs: vec![x, t],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body: body.into(),
    }
}

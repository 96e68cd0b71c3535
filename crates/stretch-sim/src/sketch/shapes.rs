//! Curves without a memory.

use super::{Quantity, Sketch};

/// A scale that bends between two points.
pub(crate) fn bowed([c, skew]: [f64; 2], [zero, span]: [f64; 2], x: Quantity) -> Sketch {
    let constants =
        [("C", c, x.unit), ("SKEW", skew, "1"), ("ZERO", zero, x.unit), ("SPAN", span, x.unit)];
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body: "let u = (x - ZERO) / SPAN
            let y = x + C * 4 * u * (1 - u) * (1 + SKEW * (2 * u - 1))"
            .into(),
    }
}

/// A gain that bends with the strain.
pub(crate) fn bowed_gain([c, skew, scale]: [f64; 3], x: Quantity, e: Quantity) -> Sketch {
    let constants = [("C", c, "1"), ("SKEW", skew, "1"), ("SCALE", scale, e.unit)];
    Sketch {
        inputs: vec![x, e],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body: "let u = e / SCALE
            let y = x * (1 + C * 4 * u * (1 - u) * (1 + SKEW * (2 * u - 1)))"
            .into(),
    }
}

/// Bounds with soft knees, where there is one.
pub(crate) fn knees([low, high]: [Option<f64>; 2], width: f64, x: Quantity) -> Sketch {
    let mut constants = vec![("KNEE", width, x.unit)];
    let mut body = "var y = x\n".to_owned();
    if let Some(low) = low {
        constants.push(("LOW", low, x.unit));
        body += "let below = (y - LOW) / KNEE
            y = LOW + KNEE * (max(below, 0) + log1p(exp(-abs(below))))\n";
    }
    if let Some(high) = high {
        constants.push(("HIGH", high, x.unit));
        body += "let above = (HIGH - y) / KNEE
            y = HIGH - KNEE * (max(above, 0) + log1p(exp(-abs(above))))\n";
    }
    Sketch {
        inputs: vec![x],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body,
    }
}

/// A pressure that strains the gauge.
pub(crate) fn crosstalk([c, bend, scale_kpa]: [f64; 3], x: Quantity) -> Sketch {
    let p = Quantity::new("p", "kPa", "pressure above the atmosphere");
    let constants = [("C", c, x.unit), ("BEND", bend, "1"), ("P_REF", scale_kpa, "kPa")];
    Sketch {
        inputs: vec![x, p],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body: "let u = p / P_REF
            let y = x + C * u * (1 + BEND * (1 - u))"
            .into(),
    }
}

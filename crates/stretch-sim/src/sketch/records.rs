//! What acts on a record as a whole: delays, skews, hum.

use super::{Quantity, Sketch};

const COUNT: Quantity = Quantity::new("n", "1", "how many samples it has");

/// Samples that show a record of some time earlier.
pub(crate) fn skewed([skew_s, rate]: [f64; 2], dt_s: f64, v: Quantity) -> Sketch {
    Sketch {
        inputs: vec![
            Quantity { is_record: true, ..v },
            COUNT,
            Quantity::new("i", "1", "which sample is shown, from 0"),
        ],
        output: v.behind(),
        constants: Sketch::constants(&[
            ("SKEW", skew_s, "s"),
            ("RATE", rate, "s/s"),
            ("DT", dt_s, "s"),
        ]),
        state: Vec::new(),
        body: "let early = -(SKEW + RATE * i * DT) / DT
            let whole = floor(early)
            let u = early - whole
            let k = i + whole
            var y = v[0]
            if k >= n - 1
            y = v[n - 1]
            else
            if (k >= 1) and (k <= n - 3)
            y = u * (1 - u) * (u - 2) / 6 * v[k - 1] + (u + 1) * (u - 1) * (u - 2) / 2 * v[k]
            y = y + (u + 1) * u * (2 - u) / 2 * v[k + 1] + (u + 1) * u * (u - 1) / 6 * v[k + 2]
            else
            if k >= 0
            y = v[k] + u * (v[k + 1] - v[k])
            end
            end
            end"
        .into(),
    }
}

/// Commands that act late: what a valve is told at a time.
pub(crate) fn delayed(delay_s: f64, dt_s: f64) -> Sketch {
    Sketch {
        inputs: vec![
            Quantity::new("u", "1", "commanded openings of a valve, each held for a sample")
                .record(),
            COUNT,
            Quantity::new("t", "s", "time since the trial began"),
        ],
        output: Quantity::new(
            "y",
            "1",
            "opening that acts at that time; shut before the first command arrives",
        ),
        constants: Sketch::constants(&[("DELAY", delay_s, "s"), ("DT", dt_s, "s")]),
        state: Vec::new(),
        body: "let k = floor((t - DELAY) / DT)
            var y = 0
            if k >= 0
            y = u[min(k, n - 1)]
            end"
        .into(),
    }
}

/// Mains hum on samples.
pub(crate) fn hum([a, f_hz, phase]: [f64; 3], x: Quantity) -> Sketch {
    let constants = [("A", a, x.unit), ("F", f_hz, "Hz"), ("PHASE", phase, "rad")];
    Sketch {
        inputs: vec![x, Quantity::new("t", "s", "time since the session began")],
        output: x.behind(),
        constants: Sketch::constants(&constants),
        state: Vec::new(),
        body: "let turns = F * t
            let y = v + A * sin(6.283185307179586 * (turns - floor(turns)) + PHASE)"
            .into(),
    }
}

//! A link that a spring and a damper carry along.

use alloc::{boxed::Box, vec, vec::Vec};

use crate::{
    grid::Grid,
    kind::{Kind, Side},
    operator::{Operator, Span, Start},
    oscillator::turn,
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A link behind a flexible joint: a spring and a damper stand between the motor's side x and the link's side y,
///
/// ```text
/// m^2 y'' = x - y + 2 damping m (x' - y')
/// ```
///
/// exact for an input that is linear between nodes: about a ramp the link swings freely. It differs from an
/// [`Oscillator`](crate::Oscillator), whose damper stands between the mass and the ground, by following a ramp without trailing it, and by
/// passing on more of what is quick. Remembers position, velocity and the last input.
///
/// Source: Spong 1987, doi:10.1115/1.3143860.
///
/// ```
/// use stretch_effects::{FlexibleJoint, Grid, Operator, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let arm = FlexibleJoint::new(0.02, 0.3, &grid);
/// let (mut cells, mut signal) = ([0.0; 3], (0..500).map(|i| 0.1 * i as f64).collect::<Vec<_>>());
/// arm.begin(Start::Settled, 0.0, &mut cells);
/// arm.run(&Span::whole(&grid), &mut cells, &mut signal);
/// // It starts late and then moves with the motor.
/// assert!(signal[1] < 0.06 && (signal[499] - 49.9).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct FlexibleJoint {
    m: f64,
    /// For each piece of time its length, and how deflection and its rate go on.
    steps: Vec<(f64, [f64; 4])>,
}

impl FlexibleJoint {
    /// Of the time of a radian of the undamped swing, s (the natural frequency is 1/(2 pi m)), and a damping ratio below 1.
    pub fn new(m: f64, damping: f64, grid: &Grid) -> Self {
        let steps = grid.steps().iter().map(|&h| (h, turn(m, damping, h))).collect();
        Self { m, steps }
    }
}

impl Operator for FlexibleJoint {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        // After 20 m little of a swing is left.
        if !matches!(start, Start::Carried { rest_s } if rest_s < 20.0 * self.m) {
            cells[..2].copy_from_slice(&[first, 0.0]);
        }
        cells[2] = first;
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut y, mut velocity, mut last] = [cells[0], cells[1], cells[2]];
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            if let Some(step) = step {
                let (h, [a, b, c, d]) = self.steps[step];
                let slope = (x - last) / h;
                let (bent, rate) = (y - last, velocity - slope);
                y = x + (a * bent + b * rate);
                velocity = slope + (c * bent + d * rate);
            }
            last = x;
            signal[i] = y;
        });
        cells.copy_from_slice(&[y, velocity, last]);
    }
}

/// A flexible joint between motor and link.
pub static FLEXIBLE_JOINT: Kind = Kind {
    name: "flexible_joint",
    title: "a flexible joint",
    words: "a spring and a damper stand between the motor and the link that is measured",
    equation: "m_s^2 y'' = x - y + 2 damping m_s (x' - y')",
    usual: &[Side::Output],
    parameters: |e, _| {
        vec![
            EffectParameter::sized("m_s", "s", 0.0..=e.late_s()),
            EffectParameter::formed("damping", "1", 0.005..=0.95, 0.1).log(),
        ]
    },
    starts: Some(|e| [0.03, 0.12, 0.4].map(|k| vec![k * e.late_s(), 0.1]).into()),
    operator: |v, _, grid| Box::new(FlexibleJoint::new(v[0].max(1e-9), v[1], grid)),
    sketch: Some(|v, _, signals| {
        let body = "let w = sqrt(1 - DAMPING * DAMPING) / M
            let sn = exp(-DAMPING * DT / M) * sin(w * DT) / w
            let cs = exp(-DAMPING * DT / M) * cos(w * DT)
            let slope = (x - s.last) / DT
            let bent = s.at - s.last
            let rate = s.speed - slope
            s.at = x + (cs + DAMPING / M * sn) * bent + sn * rate
            s.speed = slope - sn / (M * M) * bent + (cs - DAMPING / M * sn) * rate
            s.last = x
            let y = s.at";
        let unit = match &*signals.x.unit {
            "1" => "1/s".into(),
            unit => alloc::format!("{unit}/s"),
        };
        Sketch::of(signals.x.clone(), body)
            .remembering(["at", "last"])
            .cells(["speed"], unit, "0")
            .with_all(&[("M", v[0], "s"), ("DAMPING", v[1], "1"), ("DT", signals.dt_s, "s")])
    }),
    twins: &["second_order_lag", "lag", "delay", "skew"],
    ..Kind::PLAIN
};

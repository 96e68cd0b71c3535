//! Masses on springs: a second-order lag, and a link behind a flexible joint.

use alloc::{boxed::Box, format, vec, vec::Vec};

use crate::{
    grid::Grid,
    kind::{Family, Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// The numbers of an [`Oscillator`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Inverse of the undamped angular natural frequency, s. The natural frequency is 1/(2 pi m).
    pub m: f64,
    /// Damping ratio, below 1.
    pub damping: f64,
    /// Damping that grows with the speed, as in a fluid: m y'' is reduced by drag |y'| y'; s over the signal's unit.
    pub drag: f64,
    /// Dry friction, as of a guide: the greatest distance from its rest position at which the mass may stay, in the
    /// signal's unit.
    pub dry: f64,
}

/// A damped mass on a spring; the input moves the other end of the spring:
/// m^2 y'' = x - y - 2 damping m y' - drag m |y'| y' - dry y'/sqrt(y'^2 + (0.5 dry/m)^2).
///
/// Without drag and dry friction the solution is exact for an input that is linear between nodes. Drag and dry friction
/// each act for half a step before and half a step after the linear part (Strang splitting, doi 10.1137/0705041). A
/// mass released from a deflection `dry` has the speed scale dry/m. Below half of this speed, dry friction is smoothed
/// to a viscous force, because a fit needs a continuous function. The memory is the position, the velocity and the
/// last input.
///
/// ```
/// use stretch_effects::{Grid, Operator, Oscillator, Span, Start, Swing};
/// let grid = Grid::samples(0.001)?;
/// let beam = Oscillator::new(Swing { m: 0.02, damping: 0.25, drag: 0.0, dry: 0.0 }, &grid);
/// let (mut cells, mut signal) = ([0.0; 3], vec![1.0; 2000]);
/// beam.begin(Start::Settled, 0.0, &mut cells);
/// beam.run(&Span::whole(&grid), &mut cells, &mut signal);
/// // A step overshoots by exp(-pi damping/sqrt(1 - damping^2)) = 44 %, then settles.
/// let top = signal.iter().copied().fold(0.0, f64::max);
/// assert!((top - 1.444).abs() < 2e-3 && (signal[1999] - 1.0).abs() < 1e-6);
/// // Dry friction takes the overshoot.
/// let rubbing = Oscillator::new(Swing { m: 0.02, damping: 0.25, drag: 0.0, dry: 0.2 }, &grid);
/// let (mut cells, mut signal) = ([0.0; 3], vec![1.0; 2000]);
/// rubbing.begin(Start::Settled, 0.0, &mut cells);
/// rubbing.run(&Span::whole(&grid), &mut cells, &mut signal);
/// assert!(signal.iter().copied().fold(0.0, f64::max) < 1.2 && (signal[1999] - 1.0).abs() < 0.01);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Oscillator {
    swing: Swing,
    /// Number of parts into which a grid step is divided; more than one with drag or dry friction.
    parts: usize,
    /// For each grid step: the length of a part, and the transition matrix of position and velocity about the steady
    /// response.
    steps: Vec<(f64, [f64; 4])>,
}

impl Oscillator {
    /// An oscillator on a grid.
    pub fn new(swing: Swing, grid: &Grid) -> Self {
        let Swing { m, damping, .. } = swing;
        let one = |h: f64| (h, turn(m, damping, h));
        let parts = if swing.drag == 0.0 && swing.dry == 0.0 { 1 } else { PARTS };
        let steps = grid.steps().iter().map(|&h| one(h / parts as f64)).collect();
        Self { swing, parts, steps }
    }
}

/// Returns the transition matrix of position and velocity of a free damped oscillation over a time `h`, row by row.
pub(crate) fn turn(m: f64, damping: f64, h: f64) -> [f64; 4] {
    let omega = libm::sqrt(1.0 - damping * damping) / m;
    let decay = libm::exp(-damping * h / m);
    let (sin, cos) = (libm::sin(omega * h) / omega, libm::cos(omega * h));
    [cos + damping / m * sin, sin, -sin / (m * m), cos - damping / m * sin].map(|x| decay * x)
}

/// Sets position, velocity and last input at the beginning of a trial: at rest, or still swinging after a short rest.
fn begin_swing(m: f64, start: Start, first: f64, cells: &mut [f64]) {
    // A rest of 20 m leaves less than 1 % of an oscillation with damping 0.25. After a longer rest the mass counts as
    // at rest.
    if !matches!(start, Start::Carried { rest_s } if rest_s < 20.0 * m) {
        cells[..2].copy_from_slice(&[first, 0.0]);
    }
    cells[2] = first;
}

impl Operator for Oscillator {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        begin_swing(self.swing.m, start, first, cells);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let Swing { m, damping, drag, dry } = self.swing;
        let [mut y, mut velocity, mut last] = [cells[0], cells[1], cells[2]];
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            if let Some(step) = step {
                let (h, [a, b, c, d]) = self.steps[step];
                let rise = (x - last) / self.parts as f64;
                let slowed = Slowed {
                    drag: 0.5 * drag * h / m,
                    dry: 0.5 * dry * h / (m * m),
                    slow: SLOW * dry / m,
                };
                let slope = rise / h;
                // The steady response to a ramp lags behind the ramp by 2 damping m slope.
                let trail = 2.0 * damping * m * slope;
                for part in 0..self.parts {
                    let from = last + part as f64 * rise;
                    let (position, relative) = (y - (from - trail), slowed.speed(velocity) - slope);
                    y = from + rise - trail + (a * position + b * relative);
                    velocity = slowed.speed(slope + (c * position + d * relative));
                }
            }
            last = x;
            signal[i] = y;
        });
        cells.copy_from_slice(&[y, velocity, last]);
    }
}

/// Number of parts of a grid step with drag or dry friction.
const PARTS: usize = 2;

/// Reduction of a speed by drag and dry friction over a time t.
struct Slowed {
    /// k t, where v' = -k |v| v has the solution v/(1 + k |v| t).
    drag: f64,
    /// f t, where v' = -f v/sqrt(v^2 + slow^2) has the solution v/(1 + f t/sqrt(v^2 + slow^2)) if the square root keeps
    /// its value at the start.
    dry: f64,
    slow: f64,
}

impl Slowed {
    fn speed(&self, speed: f64) -> f64 {
        // If both are zero, the speed is unchanged to the last bit.
        let dragged =
            if self.drag == 0.0 { speed } else { speed / (1.0 + self.drag * speed.abs()) };
        match self.dry {
            0.0 => dragged,
            dry => {
                let root = libm::sqrt(dragged * dragged + self.slow * self.slow);
                dragged / (1.0 + dry / root)
            }
        }
    }
}

/// Greatest dry friction that is searched, as a share of the signal's span.
const DRY: f64 = 0.1;
/// Speed below which dry friction is smoothed, as a share of dry/m.
const SLOW: f64 = 0.5;

/// A mass on a spring.
pub static SECOND_ORDER_LAG: Kind = Kind {
    name: "second_order_lag",
    title: "a second-order lag",
    words: "it follows like a mass on a spring",
    equation: "m_s^2 y'' = x - y - 2 damping m_s y' - drag m_s |y'| y' - dry y'/sqrt(y'^2 + (0.5 dry/m_s)^2)",
    usual: &[Side::Output],
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("m_s", "s", 0.0..=e.late_s()),
            EffectParameter::formed("damping", "1", 0.02..=0.95, 0.3).log(),
            // The greatest drag damps the quickest motion like a damping ratio of 1.
            EffectParameter::formed(
                "drag",
                "s",
                0.0..=2.0 / e.quickest.max(f64::MIN_POSITIVE),
                0.0,
            ),
            EffectParameter::formed("dry", unit, 0.0..=DRY * e.span(), 0.0),
        ]
    },
    starts: Some(|e| [0.03, 0.12, 0.4].map(|k| vec![k * e.late_s(), 0.3, 0.0, 0.0]).into()),
    operator: |v, _, grid| {
        let swing = Swing { m: v[0].max(1e-9), damping: v[1], drag: v[2], dry: v[3] };
        Box::new(Oscillator::new(swing, grid))
    },
    sketch: Some(|v, _, signals| {
        // The step has two parts, as in `Oscillator` with drag or dry friction.
        let part = |from: &str, to: &str, k: usize| {
            format!(
                "let d{k} = s.speed / (1 + half * abs(s.speed))
            let p{k} = s.at - ({from}) + trail
            let q{k} = d{k} / (1 + rub / sqrt(d{k} * d{k} + SLOW * SLOW)) - slope
            s.at = {to} - trail + (cs + DAMPING / M * sn) * p{k} + sn * q{k}
            let v{k} = slope - sn / (M * M) * p{k} + (cs - DAMPING / M * sn) * q{k}
            let e{k} = v{k} / (1 + half * abs(v{k}))
            s.speed = e{k} / (1 + rub / sqrt(e{k} * e{k} + SLOW * SLOW))"
            )
        };
        let body = format!(
            "let sn = exp(-DAMPING * DT / (2 * M)) * sin(W * DT / 2) / W
            let cs = exp(-DAMPING * DT / (2 * M)) * cos(W * DT / 2)
            let slope = (x - s.last) / DT
            let trail = 2 * DAMPING * M * slope
            let half = DRAG * DT / (4 * M)
            let rub = DRY * DT / (4 * M * M)
            {}
            {}
            s.last = x
            let y = s.at",
            part("s.last", "(s.last + x) / 2", 1),
            part("(s.last + x) / 2", "x", 2)
        );
        let sketch = Sketch::of(signals.x.clone(), body).remembering(["at", "last"]);
        let speed = format!("{}/s", signals.x.unit);
        let numbers = [
            ("M", v[0], "s"),
            ("DAMPING", v[1], "1"),
            ("DRAG", v[2], "s"),
            ("DRY", v[3], &*signals.x.unit),
            ("W", libm::sqrt(1.0 - v[1] * v[1]) / v[0].max(1e-9), "1/s"),
            // Without dry friction this is not 0, because it is a divisor.
            ("SLOW", (SLOW * v[3] / v[0].max(1e-9)).max(1e-150), &*speed),
            ("DT", signals.dt_s, "s"),
        ];
        sketch.with_all(&numbers).cells(["speed"], speed, "0")
    }),
    twins: &["lag", "delay", "skew", "flexible_joint", "profile"],
    family: Some((Family::Late, |v| 2.0 * v[1] * v[0])),
    ..Kind::PLAIN
};

/// A link behind a flexible joint. A spring and a damper connect the motor side x and the link side y:
///
/// ```text
/// m^2 y'' = x - y + 2 damping m (x' - y')
/// ```
///
/// The solution is exact for an input that is linear between nodes, because the link then moves along the same line
/// plus a free oscillation. Unlike an [`Oscillator`](crate::Oscillator), whose damper connects the mass to the ground,
/// the link follows a ramp without a lag and passes more of the high frequencies. The memory is the position, the
/// velocity and the last input.
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
    /// For each grid step: its length, and the transition matrix of the deflection and its rate.
    steps: Vec<(f64, [f64; 4])>,
}

impl FlexibleJoint {
    /// A joint with the time m (s; the natural frequency is 1/(2 pi m)) and a damping ratio below 1.
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
        begin_swing(self.m, start, first, cells);
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
    words: "a spring and a damper connect the motor to the link that is measured",
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
        Sketch::of(signals.x.clone(), body)
            .remembering(["at", "last"])
            .cells(["speed"], format!("{}/s", signals.x.unit), "0")
            .with_all(&[("M", v[0], "s"), ("DAMPING", v[1], "1"), ("DT", signals.dt_s, "s")])
    }),
    twins: &["second_order_lag", "lag", "delay", "skew"],
    ..Kind::PLAIN
};

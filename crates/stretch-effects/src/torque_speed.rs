//! A greatest torque that falls with the speed.

use alloc::{boxed::Box, format, vec};

use crate::{
    friction::FORCES,
    kind::{Beside, Kind},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// The limit of a motor: y = x within -l(-v) and l(v), with l(v) = max(0, min(stall, stall - slope v)) and the velocity v where the
/// [`Span`] holds the strain. Driving gets weaker with the speed, braking does not.
///
/// ```
/// use stretch_effects::{Grid, Operator, Span, TorqueSpeed};
/// let motor = TorqueSpeed { stall: 10.0, slope: 2.0 };
/// let (grid, mut torque) = (Grid::samples(0.01)?, [9.0, 9.0, -9.0, 9.0]);
/// motor.run(&Span { strain: &[0.0, 3.0, 3.0, 8.0], ..Span::whole(&grid) }, &mut [], &mut torque);
/// assert_eq!(torque, [9.0, 4.0, -9.0, 0.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TorqueSpeed {
    /// Greatest torque at rest.
    pub stall: f64,
    /// What it loses per speed.
    pub slope: f64,
}

impl TorqueSpeed {
    /// The greatest torque in the direction of a velocity.
    fn limit(&self, v: f64) -> f64 {
        (self.stall - self.slope * v).min(self.stall).max(0.0)
    }
}

impl Operator for TorqueSpeed {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, v) in signal.iter_mut().zip(span.strain) {
            *x = x.min(self.limit(*v)).max(-self.limit(-*v));
        }
    }
}

/// A limit of the torque that falls with the speed.
pub static TORQUE_SPEED_LIMIT: Kind = Kind {
    name: "torque_speed_limit",
    title: "a limit of the torque that falls with the speed",
    words: "it pushes less the faster it goes",
    equation: "y = x within -l(-v) and l(v), l(v) = max(0, min(stall, stall - slope v))",
    usual: FORCES,
    beside: Beside::Velocity,
    parameters: |e, unit| {
        let (size, fastest) = (e.low.abs().max(e.high.abs()), e.beside_size().max(1e-300));
        // At rest it reaches what was asked for: a limit below that is a saturation.
        let most = LARGEST * size;
        vec![
            EffectParameter::sized("slope", &format!("{unit}/velocity"), 0.0..=most / fastest),
            EffectParameter::shaped("stall", unit, size..=most),
        ]
    },
    starts: Some(|e| {
        let (size, fastest) = (e.low.abs().max(e.high.abs()), e.beside_size().max(1e-300));
        let all = [(1.1, 0.3), (1.1, 0.8), (1.6, 1.0), (2.5, 2.0)];
        all.map(|(stall, loses)| vec![loses * size / fastest, stall * size]).into()
    }),
    operator: |v, _, _| Box::new(TorqueSpeed { slope: v[0], stall: v[1] }),
    sketch: Some(|v, _, signals| {
        let body = "let ahead = max(0, min(STALL, STALL - SLOPE * v))
            let back = max(0, min(STALL, STALL + SLOPE * v))
            let y = max(-back, min(ahead, x))";
        let speed = signals.beside.clone().named("v");
        let slope = format!("{}/({})", signals.x.unit, speed.unit);
        Sketch::of(signals.x.clone(), body)
            .beside(speed)
            .with_all(&[("SLOPE", v[0], &*slope), ("STALL", v[1], &*signals.x.unit)])
    }),
    twins: &["saturation", "viscous_friction"],
    ..Kind::PLAIN
};

/// Greatest torque at rest, in what was seen of it.
const LARGEST: f64 = 4.0;

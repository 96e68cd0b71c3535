//! Forces that depend on the velocity: friction by direction, speed and load, and a torque limit that falls with speed.

use alloc::{boxed::Box, format, vec};

use crate::{
    kind::{Beside, Kind, Side, Signals},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A friction force: y = x + F(v). The [`Span`] passes the velocity v in the field of the strain.
///
/// ```text
/// F(v) = tanh(v/width) (coulomb + more exp(-(v/slow)^2)) (1 + lopsided sign(v)) + viscous v
/// ```
///
/// Source of the formula: Armstrong-Helouvry, Dupont and Canudas de Wit 1994, doi:10.1016/0005-1098(94)90209-7.
///
/// ```
/// use stretch_effects::{Friction, Grid, Operator, Span};
/// let rail = Friction { coulomb: 20.0, viscous: 2.0, ..Friction::default() };
/// let (grid, mut force) = (Grid::samples(0.01)?, [0.0, 0.0, 0.0]);
/// rail.run(&Span { strain: &[-1.0, 0.0, 0.5], ..Span::whole(&grid) }, &mut [], &mut force);
/// assert_eq!(force, [-22.0, 0.0, 21.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Friction {
    /// Force against any motion, independent of the speed.
    pub coulomb: f64,
    /// Force per unit of velocity.
    pub viscous: f64,
    /// Additional force at low speed (Stribeck).
    pub more: f64,
    /// Velocity scale at which the additional force decays.
    pub slow: f64,
    /// Velocity scale of the smooth sign change; 0 gives an abrupt sign change.
    pub width: f64,
    /// Asymmetry: the force is multiplied by 1 + lopsided forward and by 1 - lopsided backward.
    pub lopsided: f64,
}

impl Friction {
    /// Returns F(v).
    #[inline]
    pub fn force(&self, v: f64) -> f64 {
        let side = match self.width {
            _ if v == 0.0 => 0.0,
            0.0 => v.signum(),
            width => libm::tanh(v / width),
        };
        let slow = match self.more {
            0.0 => 0.0,
            more => more * libm::exp(-(v / self.slow) * (v / self.slow)),
        };
        side * (self.coulomb + slow) * (1.0 + self.lopsided * v.signum()) + self.viscous * v
    }
}

impl Operator for Friction {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, v) in signal.iter_mut().zip(span.strain) {
            *x += self.force(*v);
        }
    }
}

/// Common fields of kinds that act on forces and torques and read the velocity. They are searched on inputs and
/// outputs, and they oppose the motion.
pub(crate) const FRICTION: Kind = Kind {
    usual: &[Side::Input, Side::Output],
    beside: Beside::Velocity,
    opposes: true,
    ..Kind::PLAIN
};

/// Friction that depends on the direction only.
pub static COULOMB_FRICTION: Kind = Kind {
    name: "coulomb_friction",
    title: "dry friction",
    words: "it rubs with a constant force against the motion",
    equation: "y = x + f tanh(v/width)(1 + lopsided sign(v)) behind the stage, x - the same in front of it",
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("f", unit, 0.0..=0.5 * e.span()),
            width(e.beside_size()),
            EffectParameter::formed("lopsided", "1", -0.5..=0.5, 0.0),
        ]
    },
    operator: |v, _, _| Box::new(coulomb(v)),
    sketch: Some(|v, _, signals| coulomb(v).sketch(signals)),
    twins: &["stribeck_friction", "viscous_friction", "dahl_friction", "load_friction"],
    ..FRICTION
};

/// Friction in proportion to the speed.
pub static VISCOUS_FRICTION: Kind = Kind {
    name: "viscous_friction",
    title: "viscous friction",
    words: "it rubs in proportion to the speed",
    equation: "y = x + b v behind the stage, x - b v in front of it",
    parameters: |e, unit| {
        let most = 0.5 * e.span() / e.beside_size().max(1e-300);
        vec![EffectParameter::sized("b", &format!("{unit}/velocity"), -0.2 * most..=most)]
    },
    operator: |v, _, _| Box::new(Friction { viscous: v[0], ..Friction::default() }),
    sketch: Some(|v, _, signals| Friction { viscous: v[0], ..Friction::default() }.sketch(signals)),
    twins: &["coulomb_friction"],
    ..FRICTION
};

/// Friction that is larger at low speed.
pub static STRIBECK_FRICTION: Kind = Kind {
    name: "stribeck_friction",
    title: "stick-slip friction",
    words: "it rubs more while it is slow",
    equation: "y = x + tanh(v/width) more exp(-(v/slow)^2) behind the stage, x - the same in front of it",
    parameters: |e, unit| {
        let v = e.beside_size();
        vec![
            EffectParameter::sized("more", unit, 0.0..=0.5 * e.span()),
            EffectParameter::shaped("slow", "velocity", 0.01 * v..=0.5 * v),
            width(v),
        ]
    },
    operator: |v, _, _| Box::new(stribeck(v)),
    sketch: Some(|v, _, signals| stribeck(v).sketch(signals)),
    twins: &["coulomb_friction"],
    ..FRICTION
};

/// Returns the parameter of the velocity scale of the sign change; `v` is the largest speed.
pub(crate) fn width(v: f64) -> EffectParameter {
    EffectParameter::formed("width", "velocity", 1e-4 * v..=0.1 * v, 0.01 * v).log()
}

fn coulomb(v: &[f64]) -> Friction {
    Friction { coulomb: v[0], width: v[1], lopsided: v[2], ..Friction::default() }
}

fn stribeck(v: &[f64]) -> Friction {
    Friction { more: v[0], slow: v[1], width: v[2], ..Friction::default() }
}

impl Friction {
    /// Writes the code, with the velocity as the second signal.
    fn sketch(&self, signals: &Signals) -> Sketch {
        let [x, v] = [&signals.x, &signals.beside].map(|q| &*q.unit);
        let viscous = ("B", self.viscous, "force/velocity");
        let beside = signals.beside.clone().named("v");
        if self.coulomb == 0.0 && self.more == 0.0 {
            let body = "var y = x + B * v";
            return Sketch::of(signals.x.clone(), body).beside(beside).with_all(&[viscous]);
        }
        let body = "var way = 0
            if v > 0
            way = 1
            end
            if v < 0
            way = -1
            end
            let slow = MORE * exp(-(v / SLOW) * (v / SLOW))
            var y = x + tanh(v / WIDTH) * (F + slow) * (1 + LOPSIDED * way)";
        let slow = if self.more == 0.0 { 1.0 } else { self.slow };
        Sketch::of(signals.x.clone(), body)
            .beside(beside)
            .with_all(&[("F", self.coulomb, x), ("MORE", self.more, x), ("SLOW", slow, v)])
            .with_all(&[("WIDTH", self.width, v), ("LOPSIDED", self.lopsided, "1")])
    }
}

/// A force against the motion in proportion to a load: y = x + mu |load| tanh(v/width). The [`Span`] passes the
/// velocity v in the field of the strain, and the load in its own field.
///
/// ```
/// use stretch_effects::{Grid, LoadFriction, Operator, Span};
/// let bearing = LoadFriction { mu: 0.1, width: 1e-6 };
/// let (grid, mut torque) = (Grid::samples(0.01)?, [0.0, 0.0, 0.0]);
/// let span = Span { strain: &[-1.0, 1.0, 1.0], load: &[5.0, -5.0, 20.0], ..Span::whole(&grid) };
/// bearing.run(&span, &mut [], &mut torque);
/// assert_eq!(torque, [-0.5, 0.5, 2.0]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadFriction {
    /// Force per unit of load.
    pub mu: f64,
    /// Velocity scale of the smooth sign change, above 0.
    pub width: f64,
}

impl Operator for LoadFriction {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for ((x, v), load) in signal.iter_mut().zip(span.strain).zip(span.load) {
            *x += self.mu * load.abs() * libm::tanh(v / self.width);
        }
    }
}

/// Friction that grows with the load.
pub static LOAD_FRICTION: Kind = Kind {
    name: "load_friction",
    title: "friction that grows with the load",
    words: "it rubs against the motion, in proportion to a load",
    equation: "y = x + mu |load| tanh(v/width) behind the stage, x - the same in front of it",
    beside: Beside::VelocityAndLoad,
    parameters: |e, unit| {
        let most = 0.5 * e.span() / e.load_size();
        vec![
            EffectParameter::sized("mu", &format!("{unit}/load"), 0.0..=most),
            width(e.beside_size()),
        ]
    },
    operator: |v, _, _| Box::new(LoadFriction { mu: v[0], width: v[1] }),
    sketch: Some(|v, _, signals| {
        let (load, speed) = (signals.load.clone(), signals.beside.clone().named("v"));
        let units =
            [format!("{}/({})", signals.x.unit, load.unit), speed.unit.clone().into_owned()];
        Sketch::of(signals.x.clone(), "var y = x + MU * abs(load) * tanh(v / WIDTH)")
            .beside(speed)
            .beside(load)
            .with_all(&[("MU", v[0], &*units[0]), ("WIDTH", v[1], &*units[1])])
    }),
    twins: &["coulomb_friction", "load_dahl_friction"],
    ..FRICTION
};

/// The torque limit of a motor: y = x, limited to -l(-v) and l(v), with l(v) = max(0, min(stall, stall - slope v)). The
/// [`Span`] passes the velocity v in the field of the strain. The limit falls with speed if the torque drives the
/// motion, not if it brakes.
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
    /// Loss of torque per unit of speed.
    pub slope: f64,
}

impl TorqueSpeed {
    /// Returns the greatest torque in the positive direction at the velocity `v`.
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

/// A torque limit that falls with speed.
pub static TORQUE_SPEED_LIMIT: Kind = Kind {
    name: "torque_speed_limit",
    title: "a limit of the torque that falls with the speed",
    words: "it pushes less the faster it goes",
    equation: "y = x within -l(-v) and l(v), l(v) = max(0, min(stall, stall - slope v))",
    opposes: false,
    parameters: |e, unit| {
        let (size, fastest) = (e.low.abs().max(e.high.abs()), e.beside_size().max(1e-300));
        // The stall torque is at least the largest value seen, because a lower limit would be a saturation.
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
    ..FRICTION
};

/// Greatest stall torque that is searched, as a multiple of the largest value seen.
const LARGEST: f64 = 4.0;

//! Friction that grows with a load.

use alloc::{boxed::Box, format, vec};

use crate::{
    friction::{FORCES, width},
    kind::{Beside, Kind},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A force against the motion in proportion to a load: y = x + mu |load| tanh(v/width), with the velocity v where the [`Span`] holds the
/// strain, and the load where it holds one.
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
    /// Force per load.
    pub mu: f64,
    /// Velocity at which the direction is told, above 0.
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
    words: "it rubs by direction, in proportion to a load",
    equation: "y = x + mu |load| tanh(v/width) behind the stage, x - the same in front of it",
    usual: FORCES,
    beside: Beside::VelocityAndLoad,
    opposes: true,
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
    ..Kind::PLAIN
};

//! Small values that do nothing.

use alloc::{boxed::Box, vec};

use crate::{
    kind::{Kind, Side},
    operator::{Operator, Span},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A dead zone on both sides of zero: y = x - clamp(x, -w, w); with a softness s the edge is left gradually,
/// y = sign(x) softplus(|x| - w) of width s w, less its value at zero.
///
/// ```
/// use stretch_effects::{DeadZone, Grid, Operator, Span};
/// let mut torque = [-1.0, -0.25, 0.0, 0.25, 2.0];
/// DeadZone { w: 0.5, softness: 0.0 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut torque);
/// assert_eq!(torque, [-0.5, 0.0, 0.0, 0.0, 1.5]);
/// let mut soft = [0.0, 0.5];
/// DeadZone { w: 0.5, softness: 0.2 }.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut soft);
/// assert!(soft[0] == 0.0 && soft[1] > 0.0 && soft[1] < 0.1);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadZone {
    /// Half-width, in the unit of the signal, at least 0.
    pub w: f64,
    /// How gradually it is left, in units of the half-width; 0 for at once.
    pub softness: f64,
}

impl Operator for DeadZone {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        let knee = self.softness * self.w;
        if knee <= 0.0 {
            signal.iter_mut().for_each(|x| *x -= x.clamp(-self.w, self.w));
            return;
        }
        let plus = |z: f64| if z > 37.0 { z } else { libm::log1p(libm::exp(z)) };
        let at_zero = plus(-self.w / knee);
        for x in signal {
            let size = knee * (plus((x.abs() - self.w) / knee) - at_zero);
            *x = size.copysign(*x);
        }
    }
}

/// Small values that do nothing.
pub static DEAD_ZONE: Kind = Kind {
    name: "dead_zone",
    title: "a dead zone",
    words: "small values do nothing",
    equation: "y = x - clamp(x, -w, w)",
    usual: &[Side::Input],
    parameters: |e, unit| {
        let size = e.low.abs().max(e.high.abs());
        let softness = EffectParameter::formed("softness", "1", 0.0..=1.0, 0.0);
        vec![EffectParameter::sized("w", unit, 0.0..=0.5 * size), softness]
    },
    starts: Some(|e| {
        let size = e.low.abs().max(e.high.abs());
        [0.02, 0.1, 0.25].map(|k| vec![k * size, 0.0]).into()
    }),
    operator: |v, _, _| Box::new(DeadZone { w: v[0], softness: v[1] }),
    sketch: Some(|v, _, signals| {
        let x = signals.x.clone();
        let sketch = match v[1] {
            0.0 => Sketch::of(x, "let y = x - max(-W, min(W, x))"),
            softness => {
                let body = "let knee = SOFTNESS * W
                    let z = (abs(x) - W) / knee
                    let at_zero = log1p(exp(-1 / SOFTNESS))
                    var y = knee * (max(z, 0) + log1p(exp(-abs(z))) - at_zero)
                    if x < 0
                    y = -y
                    end";
                Sketch::of(x, body).with("SOFTNESS", softness, "1")
            }
        };
        sketch.with("W", v[0], &signals.x.unit)
    }),
    twins: &["backlash", "firmware_dead_band"],
    ..Kind::PLAIN
};

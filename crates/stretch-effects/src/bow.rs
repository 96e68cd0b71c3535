//! Scales and gains that deviate from a straight line by a parabola.

use alloc::{boxed::Box, vec};

use crate::{
    effect::{Acts, Effect, Live, each},
    kind::{Beside, Kind, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::{Place, RigStage},
    sketch::Sketch,
};

/// Returns c 4 x (1 - x)(1 + skew (2 x - 1)). The curve is zero at 0 and 1 and equals c in the middle. A skew moves its
/// extremum off the middle.
///
/// ```
/// use stretch_effects::bow;
/// assert_eq!(bow(0.1, 0.5, 0.3), 0.1);
/// assert_eq!((bow(0.1, 0.0, 0.3), bow(0.1, 1.0, 0.3)), (0.0, 0.0));
/// assert!(bow(0.1, 0.75, 0.3) > bow(0.1, 0.25, 0.3));
/// ```
#[inline]
pub fn bow(c: f64, x: f64, skew: f64) -> f64 {
    c * 4.0 * x * (1.0 - x) * (1.0 + skew * (2.0 * x - 1.0))
}

/// A non-linear scale: y = x + [`bow`]`(c, (x - zero)/span, skew)`.
///
/// [`Operator::undo`] is exact without a skew. With a skew it solves the equation by eight rounds of substitution. Each
/// round multiplies the error by the slope of the bow, which is about 4 c/span.
///
/// ```
/// use stretch_effects::{Bow, Grid, Operator, Span};
/// let scale = Bow { c: 0.5, skew: 0.2, zero: 0.0, span: 30.0 };
/// let mut shown = [0.0, 15.0, 30.0];
/// scale.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut shown);
/// assert_eq!(shown, [0.0, 15.5, 30.0]);
/// scale.undo(&mut shown);
/// assert!((shown[1] - 15.0).abs() < 1e-9);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bow {
    /// Height in the middle, in the unit of the signal.
    pub c: f64,
    /// Shift of the extremum away from the middle; 0 for a symmetric curve.
    pub skew: f64,
    /// Value at which the curve begins.
    pub zero: f64,
    /// Signed distance from `zero` to the end of the curve.
    pub span: f64,
}

impl Operator for Bow {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for x in signal {
            *x += bow(self.c, (*x - self.zero) / self.span, self.skew);
        }
    }

    fn undo(&self, signal: &mut [f64]) {
        let b = 4.0 * self.c / self.span;
        for x in signal {
            if self.skew == 0.0 {
                // z = y + b y (1 - y), solved for y in the form that remains exact as b goes to 0.
                let z = (*x - self.zero) / self.span;
                let sum = 1.0 + b;
                let root = libm::sqrt((sum * sum - 4.0 * b * z).max(0.0));
                *x = self.zero + self.span * (2.0 * z / (sum + root));
            } else {
                let shown = *x;
                for _ in 0..8 {
                    *x = shown - bow(self.c, (*x - self.zero) / self.span, self.skew);
                }
            }
        }
    }
}

/// A gain that varies with the strain e: y = x (1 + [`bow`]`(c, e/scale, skew))`.
///
/// ```
/// use stretch_effects::{BowedGain, Grid, Operator, Span};
/// let gauge = BowedGain { c: 0.1, skew: 0.0, scale: 0.2 };
/// let grid = Grid::samples(0.01)?;
/// let mut ohm = [4.0, 4.0];
/// gauge.run(&Span { strain: &[0.0, 0.1], ..Span::whole(&grid) }, &mut [], &mut ohm);
/// assert_eq!(ohm, [4.0, 4.4]);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BowedGain {
    /// Relative increase of the gain in the middle.
    pub c: f64,
    /// Shift of the extremum away from the middle; 0 for a symmetric curve.
    pub skew: f64,
    /// Strain at which the curve ends.
    pub scale: f64,
}

impl Operator for BowedGain {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (x, e) in signal.iter_mut().zip(span.strain) {
            *x *= 1.0 + bow(self.c, e / self.scale, self.skew);
        }
    }
}

/// A non-linear scale.
pub static CURVE: Kind = Kind {
    name: "curve",
    title: "a bent scale",
    words: "its scale is nonlinear",
    equation: "y = x + 4 c z (1 - z)(1 + skew (2 z - 1)), z = (x - low)/span",
    usual: &[Side::Input, Side::Output],
    parameters: |e, unit| {
        let most = 0.2 * e.span();
        let skew = EffectParameter::formed("skew", "1", -1.0..=1.0, 0.0);
        vec![EffectParameter::sized("c", unit, -most..=most), skew]
    },
    operator: |v, e, _| Box::new(Bow { c: v[0], skew: v[1], zero: e.low, span: e.span() }),
    sketch: Some(|v, e, signals| {
        let unit = signals.x.unit.clone();
        let body = "let u = (x - ZERO) / SPAN
            let y = x + C * 4 * u * (1 - u) * (1 + SKEW * (2 * u - 1))";
        let place = [("ZERO", e.low, &*unit), ("SPAN", e.span(), &unit)];
        let sketch = Sketch::of(signals.x.clone(), body);
        sketch.with_all(&[("C", v[0], &*unit), ("SKEW", v[1], "1")]).with_all(&place)
    }),
    ..Kind::PLAIN
};

/// A gain that varies with a second signal.
pub static GAIN_CURVE: Kind = Kind {
    name: "gain_curve",
    title: "a bent gain",
    words: "its gain bends",
    equation: "y = x (1 + 4 c z (1 - z)(1 + skew (2 z - 1))), z = x over its largest size",
    beside: Beside::Itself,
    parameters: |_, _| {
        let skew = EffectParameter::formed("skew", "1", -1.0..=1.0, 0.0);
        vec![EffectParameter::sized("c", "1", -0.3..=0.3), skew]
    },
    operator: |v, e, _| Box::new(BowedGain { c: v[0], skew: v[1], scale: e.beside_size() }),
    sketch: Some(|v, e, signals| {
        let body = "let u = e / SCALE
            let y = x * (1 + C * 4 * u * (1 - u) * (1 + SKEW * (2 * u - 1)))";
        let sketch = Sketch::of(signals.x.clone(), body).beside(signals.beside.clone());
        let scale = ("SCALE", e.beside_size(), &*signals.beside.unit);
        sketch.with_all(&[("C", v[0], "1"), ("SKEW", v[1], "1"), scale])
    }),
    twins: &["curve"],
    ..Kind::PLAIN
};

/// Non-linearity of the gauge.
pub(crate) static GAUGE_NONLINEARITY: Effect = Effect {
    name: "gauge_nonlinearity",
    title: "the gauge's non-linearity",
    words: "the gauge's resistance bends away from the ideal curve",
    equation: "R -> R (1 + c 4 x (1 - x)(1 + skew (2 x - 1))), x = e/e0",
    parameters: &[
        EffectParameter::strength("c", "1", -0.1, 0.1, 0.02),
        EffectParameter::form("skew", "1", -0.6, 0.6, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::at(&GAIN_CURVE, Place::Resistance),
    twins: &["pot_nonlinearity", "pressure_crosstalk"],
    // At this limit the resistance in the middle of the range is 1.5 times that of the linear gauge.
    alone: |_, search| search.reach_from(0.5),
    starts: Some(|_| each([0.005])),
    live: Some(Live::BY_CURVE),
    ..Effect::PLAIN
};

/// Non-linearity of the potentiometer.
pub(crate) static POT_NONLINEARITY: Effect = Effect {
    name: "pot_nonlinearity",
    title: "the reference sensor's non-linearity",
    words: "the scale of the reference sensor bends",
    stage: RigStage::Reference,
    equation: "L_meas = L + c 4 y (1 - y)(1 + skew (2 y - 1)), y = k/k_max",
    parameters: &[
        EffectParameter::strength("c", "mm", -3.0, 3.0, 0.5),
        EffectParameter::form("skew", "1", -0.6, 0.6, Form { neutral: 0.0, usual: 0.0 }),
    ],
    acts: Acts::at(&CURVE, Place::Length),
    twins: &["gauge_nonlinearity"],
    starts: Some(|_| each([0.2])),
    live: Some(Live::BY_CURVE),
    ..Effect::PLAIN
};

//! Curves that are not quite lines.

use alloc::{boxed::Box, vec};

use crate::{
    effect::{Acts, Effect, Live, each},
    kind::{Beside, Kind, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::{Place, RigStage},
    sketch::Sketch,
};

/// c 4 x (1 - x)(1 + skew (2 x - 1)): zero at 0 and 1, c in the middle, its top off the middle where skewed.
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

/// A scale that bends: y = x + [`bow`]`(c, (x - zero)/span, skew)`.
///
/// [`Operator::undo`] is exact without a skew; with one it is solved by substitution, whose error shrinks in each of eight
/// rounds by the slope of the bow, 4 c/span.
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
    /// How far the top lies off the middle.
    pub skew: f64,
    /// Where the curve begins.
    pub zero: f64,
    /// From there to where it ends, with its sign.
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
                // z = y + b y (1 - y), solved for y; the form that stays exact as b goes to 0.
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

/// A gain that bends with the strain e: y = x (1 + [`bow`]`(c, e/scale, skew))`.
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
    /// Share by which the gain is larger in the middle.
    pub c: f64,
    /// How far the top lies off the middle.
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

/// A scale that bends.
pub static CURVE: Kind = Kind {
    name: "curve",
    title: "a bent scale",
    words: "its scale is bent",
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

/// A gain that bends with a second signal.
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

/// The gauge is not quite linear.
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
    // At half of the range, where e + 1 is 1.5, it bends by half as much again; further, it would not rise any more.
    alone: |_, search| search.reach_from(0.5),
    starts: Some(|_| each([0.005])),
    live: Some(Live::BY_CURVE),
    ..Effect::PLAIN
};

/// The potentiometer is not quite linear.
pub(crate) static POT_NONLINEARITY: Effect = Effect {
    name: "pot_nonlinearity",
    title: "the potentiometer's non-linearity",
    words: "the potentiometer's scale bends",
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

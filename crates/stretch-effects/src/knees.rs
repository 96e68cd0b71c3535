//! Bounds with a knee of any sharpness.

use alloc::{boxed::Box, vec};

use stretch_core::Knee;

use crate::{
    effect::{Acts, Effect, Live, Need},
    extent::Extent,
    kind::{Kind, Side},
    operator::{Operator, Span},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// Returns a soft lower bound: low + w ln(1 + exp((x - low)/w)). At 37 w or more from `low` it equals x or `low` to
/// rounding.
///
/// ```
/// use stretch_effects::soft_floor;
/// assert_eq!(soft_floor(5.0, 1.0, 0.01), 5.0);
/// assert!((soft_floor(1.0, 1.0, 0.01) - (1.0 + 0.01 * 2f64.ln())).abs() < 1e-15);
/// ```
#[inline]
pub fn soft_floor(x: f64, low: f64, w: f64) -> f64 {
    let z = (x - low) / w;
    if z > 37.0 {
        x
    } else if z > 0.0 {
        x + w * libm::log1p(libm::exp(-z))
    } else {
        low + w * libm::log1p(libm::exp(z))
    }
}

/// A soft upper bound, the mirror image of [`soft_floor`].
///
/// ```
/// use stretch_effects::soft_ceiling;
/// assert_eq!(soft_ceiling(1.0, 5.0, 0.01), 1.0);
/// assert!(soft_ceiling(9.0, 5.0, 0.01) <= 5.0);
/// ```
#[inline]
pub fn soft_ceiling(x: f64, high: f64, w: f64) -> f64 {
    -soft_floor(-x, -high, w)
}

/// Bounds that a signal cannot exceed: [`soft_floor`] at `low`, then [`soft_ceiling`] at `high`. Each bound is
/// optional.
///
/// ```
/// use stretch_effects::{Grid, Knees, Operator, Span};
/// let rails = Knees { low: Some(0.5), high: Some(2.0), width: 0.01 };
/// let mut volts = [0.0, 1.2, 3.0];
/// rails.run(&Span::whole(&Grid::samples(0.01)?), &mut [], &mut volts);
/// assert!(volts[0] >= 0.5 && volts[1] == 1.2 && volts[2] <= 2.0);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Knees {
    /// Lower bound.
    pub low: Option<f64>,
    /// Upper bound.
    pub high: Option<f64>,
    /// Width of the knees, in the unit of the signal.
    pub width: f64,
}

impl Operator for Knees {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        if let Some(low) = self.low {
            signal.iter_mut().for_each(|x| *x = soft_floor(*x, low, self.width));
        }
        if let Some(high) = self.high {
            signal.iter_mut().for_each(|x| *x = soft_ceiling(*x, high, self.width));
        }
    }
}

/// A bound at either side, or at both.
pub static SATURATION: Kind = Kind {
    name: "saturation",
    title: "saturation",
    words: "it runs into an end",
    equation: "y cannot leave [low, high], soft knees of the width given",
    usual: &[Side::Input, Side::Output],
    parameters: |e, unit| {
        let ([low, high], s) = (ends(e), e.span());
        vec![
            EffectParameter::sized("low", unit, low..=e.high - 0.1 * s).off_at(low),
            EffectParameter::sized("high", unit, e.low + 0.1 * s..=high).off_at(high),
            EffectParameter::formed("knee", unit, 1e-4 * s..=0.03 * s, 0.005 * s).log(),
        ]
    },
    starts: Some(|e| {
        let ([low, high], s) = (ends(e), e.span());
        let within = [0.003, 0.02, 0.08, 0.2, 0.35];
        let tops = within.map(|d| vec![low, e.high - d * s, 0.005 * s]);
        let bottoms = within.map(|d| vec![e.low + d * s, high, 0.005 * s]);
        // Actuators most often reach both ends.
        let both = within.map(|d| vec![e.low + d * s, e.high - d * s, 0.005 * s]);
        [tops, bottoms, both].concat()
    }),
    operator: |v, e, _| {
        let [low, high] = reached(v, e);
        Box::new(Knees { low, high, width: v[2] })
    },
    sketch: Some(|v, e, signals| {
        let [low, high] = reached(v, e);
        let unit = signals.x.unit.clone();
        let mut sketch = Sketch::of(signals.x.clone(), "var y = x\n").with("KNEE", v[2], &unit);
        if let Some(low) = low {
            sketch = sketch.with("LOW", low, &unit);
            sketch.body += "let below = (y - LOW) / KNEE
                y = LOW + KNEE * (max(below, 0) + log1p(exp(-abs(below))))\n";
        }
        if let Some(high) = high {
            sketch = sketch.with("HIGH", high, &unit);
            sketch.body += "let above = (HIGH - y) / KNEE
                y = HIGH - KNEE * (max(above, 0) + log1p(exp(-abs(above))))\n";
        }
        sketch
    }),
    ..Kind::PLAIN
};

/// Returns bounds that count as absent: one span beyond each end of the range. Commands and measurements stay within
/// the range, and a simulation rarely exceeds it by half of its span.
fn ends(e: &Extent) -> [f64; 2] {
    [e.low - e.span(), e.high + e.span()]
}

/// Returns the bounds that act. A bound at infinity, or at the value of `ends`, counts as absent.
fn reached(values: &[f64], e: &Extent) -> [Option<f64>; 2] {
    let off = ends(e);
    [0, 1].map(|i| Some(values[i]).filter(|v| v.is_finite() && *v != off[i]))
}

/// Slack of the sleeve: the gauge cannot be compressed.
pub(crate) static SLEEVE_SLACK: Effect = Effect {
    name: "sleeve_slack",
    title: "the sensor's slack",
    words: "the sensor goes slack at the short end",
    equation: "e -> e_s + knee ln(1 + exp((e - e_s)/knee)): cannot fall below e_s",
    parameters: &[
        // If the pre-stretch is unknown, so is the slack strain. It may then be negative in the nominal rig's strain.
        EffectParameter::strength("e_s", "strain", -0.05, 0.2, 0.08).off_at(-0.05),
        EffectParameter::form(
            "knee",
            "strain",
            0.0001,
            0.015,
            Form { neutral: 0.003, usual: 0.003 },
        )
        .log(),
    ],
    acts: Acts::with(&SATURATION, Place::Strain, |v, _| vec![v[0], f64::INFINITY, v[1]]),
    twins: &["amplifier_saturation"],
    // Starts slightly above the least strain, with the usual knee and with a very sharp one. A fit that starts from a
    // soft knee does not find a sharp one.
    starts: Some(|strain| {
        let above = [0.001, 0.004, 0.01, 0.03, 0.07];
        let above = above.map(|above| (strain.low + above).max(-0.049));
        let with = |knee: f64| above.map(|e_s| vec![e_s, knee]);
        [with(0.003), with(0.15 * 0.003)].concat()
    }),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("e_s", "1", -0.3, 0.95, 0.1),
            EffectParameter::form("knee", "1", 5e-4, 0.1, Form { neutral: 0.015, usual: 0.015 })
                .log(),
        ],
        set: |v, target, map| {
            let knee = Some(Knee { at: target.at(v[0]), width: v[1] });
            *(if target.falls { &mut map.slack_high } else { &mut map.slack_low }) = knee;
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// Amplifier limits that no signal reaches, V. They represent an absent limit.
const RAILS_V: [f64; 2] = [0.5, 3.3];

/// Saturation of the amplifier.
pub(crate) static AMPLIFIER_SATURATION: Effect = Effect {
    name: "amplifier_saturation",
    title: "the amplifier's saturation",
    words: "the amplifier runs into its limit",
    equation: "v cannot leave [v_lo, v_hi], soft knees of the width given",
    parameters: &[
        EffectParameter::strength("v_lo", "V", RAILS_V[0], 2.2, 1.4).off_at(RAILS_V[0]),
        EffectParameter::strength("v_hi", "V", 1.2, RAILS_V[1], 2.1).off_at(RAILS_V[1]),
        EffectParameter::form("knee", "V", 0.0005, 0.06, Form { neutral: 0.01, usual: 0.01 }).log(),
    ],
    acts: Acts::with(&SATURATION, Place::Volts, |v, _| {
        let low = if v[0] == RAILS_V[0] { f64::NEG_INFINITY } else { v[0] };
        let high = if v[1] == RAILS_V[1] { f64::INFINITY } else { v[1] };
        vec![low, high, v[2]]
    }),
    twins: &["sleeve_slack"],
    needs: Some(Need::Amplifier),
    // Starts slightly inside each end, with the usual knee and with a very sharp one.
    starts: Some(|volts| {
        let within = [0.004, 0.015, 0.05, 0.15, 0.4];
        let with = |knee: f64| {
            let tops = within.map(|d| vec![RAILS_V[0], (volts.high - d).max(1.25), knee]);
            let bottoms = within.map(|d| vec![(volts.low + d).max(0.51), RAILS_V[1], knee]);
            [tops, bottoms].concat()
        };
        [with(0.01), with(0.15 * 0.01)].concat()
    }),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("v_lo", "1", -0.3, 0.9, -0.3),
            EffectParameter::strength("v_hi", "1", 0.1, 1.3, 1.3),
            EffectParameter::form("knee", "1", 5e-4, 0.1, Form { neutral: 0.01, usual: 0.01 })
                .log(),
        ],
        set: |v, target, map| {
            let [low, high] = [v[0], v[1]].map(|at| Knee { at: target.at(at), width: v[2] });
            let [floor, ceiling] = if target.falls { [high, low] } else { [low, high] };
            (map.floor, map.ceiling) = (Some(floor), Some(ceiling));
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

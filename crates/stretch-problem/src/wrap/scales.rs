//! Wrappers that show another value: curves, bounds, steps, offsets, and what changes them.

use stretch_effects::{Bow, Knees, Offset, Quantiser, Softening};

use super::kind::{
    Beside,
    Side::{Input, Output},
    Wrapper, form, log_form, shape, strength, threshold,
};
use crate::wrap::extent::Extent;

pub(super) static CURVE: Wrapper = Wrapper {
    name: "curve",
    words: "its scale is bent",
    equation: "y = x + 4 c z (1 - z)(1 + skew (2 z - 1)), z = (x - low)/span",
    usual: &[Input, Output],
    parameters: |e, unit| {
        let most = 0.2 * e.span();
        vec![strength("c", unit, -most, most), form("skew", "1", [-1.0, 1.0], 0.0)]
    },
    operator: |v, e, _| Box::new(Bow { c: v[0], skew: v[1], zero: e.low, span: e.span() }),
    ..Wrapper::PLAIN
};

pub(super) static SATURATION: Wrapper = Wrapper {
    name: "saturation",
    words: "it runs into an end",
    equation: "y cannot leave [low, high], soft knees of the width given",
    usual: &[Input, Output],
    parameters: |e, unit| {
        let [low, high] = rails(e);
        let s = e.span();
        vec![
            threshold("low", unit, [low, e.high - 0.1 * s], low),
            threshold("high", unit, [e.low + 0.1 * s, high], high),
            log_form("knee", unit, [1e-4 * s, 0.03 * s], 0.005 * s),
        ]
    },
    starts: Some(|e| {
        let ([low, high], s) = (rails(e), e.span());
        let within = [0.003, 0.02, 0.08, 0.2, 0.35];
        let tops = within.map(|d| vec![low, e.high - d * s, 0.005 * s]);
        let bottoms = within.map(|d| vec![e.low + d * s, high, 0.005 * s]);
        // An actuator's ends are most often both reached.
        let both = within.map(|d| vec![e.low + d * s, e.high - d * s, 0.005 * s]);
        [tops, bottoms, both].concat()
    }),
    operator: |v, e, _| {
        let [low, high] = rails(e);
        let bound = |v: f64, off: f64| (v != off).then_some(v);
        Box::new(Knees { low: bound(v[0], low), high: bound(v[1], high), width: v[2] })
    },
    ..Wrapper::PLAIN
};

/// Ends that nothing reaches: what was commanded or measured goes no further, and a simulation rarely half as far again.
fn rails(e: &Extent) -> [f64; 2] {
    [e.low - e.span(), e.high + e.span()]
}

pub(super) static QUANTISATION: Wrapper = Wrapper {
    name: "quantisation",
    words: "it comes in steps",
    equation: "y = step round(x/step)",
    usual: &[],
    parameters: |e, unit| vec![strength("step", unit, 0.0, 0.1 * e.span())],
    starts: Some(|e| vec![vec![e.lattice], vec![0.01 * e.span()]]),
    operator: |v, _, _| Box::new(Quantiser { step: v[0].max(1e-300) }),
    ..Wrapper::PLAIN
};

pub(super) static OFFSET: Wrapper = Wrapper {
    name: "offset",
    words: "its zero is off",
    equation: "y = x + offset",
    usual: &[Input],
    parameters: |e, unit| vec![strength("offset", unit, -0.3 * e.span(), 0.3 * e.span())],
    operator: |v, _, _| Box::new(Offset { at_start: v[0], per_s: 0.0 }),
    twins: &["drift"],
    ..Wrapper::PLAIN
};

pub(super) static DRIFT: Wrapper = Wrapper {
    name: "drift",
    words: "its zero wanders with session time",
    equation: "y = x + offset + per_session t/session, t since the session began",
    usual: &[Output],
    parameters: |e, unit| {
        let most = 0.3 * e.span();
        vec![strength("per_session", unit, -most, most), form("offset", unit, [-most, most], 0.0)]
    },
    starts: Some(|e| [-0.05, 0.05].map(|k| vec![k * e.span(), 0.0]).into()),
    operator: |v, e, _| Box::new(Offset { at_start: v[1], per_s: v[0] / e.session_s }),
    twins: &["offset"],
    ..Wrapper::PLAIN
};

/// The value that does not soften: 0 where the channel passes it, else its end nearest to 0.
fn zero(e: &Extent) -> f64 {
    0.0_f64.clamp(e.low, e.high)
}

pub(super) static SOFTENING: Wrapper = Wrapper {
    name: "softening",
    words: "its response weakens with the distance travelled",
    equation: "y = zero + (x - zero)(1 - m (1 - (1 + tail travel/n)^(-1/tail))), travel since the session began",
    usual: &[Output],
    beside: Beside::Itself,
    parameters: |e, unit| {
        let s = e.span();
        vec![
            strength("m", "1", 0.0, 0.5),
            shape("n", unit, 1.5 * s, 200.0 * s),
            log_form("tail", "1", [0.05, 2.5], 1.0 / 3.0),
            form("zero", unit, [e.low - s, e.high + s], zero(e)),
        ]
    },
    operator: |v, e, _| {
        let reversal = 2e-3 * e.span();
        Box::new(Softening { m: v[0], n: v[1], tail: v[2], zero: v[3], reversal })
    },
    counts_session: true,
    ..Wrapper::PLAIN
};

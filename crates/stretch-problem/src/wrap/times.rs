//! Wrappers that are late.

use stretch_effects::{
    FadingMemory, Lowpass, Oscillator, Poles, Skew, SkewSpec, SlewLimit, Swing, Times,
};

use super::kind::{
    Family,
    Side::{Input, Output},
    Wrapper, form, log_form, shape, strength, threshold,
};

pub(super) static DELAY: Wrapper = Wrapper {
    name: "delay",
    words: "it acts a dead time later",
    equation: "y(t) = x(t - delay_s)",
    usual: &[Input],
    parameters: |e, _| vec![strength("delay_s", "s", 0.0, e.late_s())],
    starts: Some(|e| [0.05, 0.2, 0.6].map(|k| vec![k * e.late_s()]).into()),
    operator: |v, _, grid| Box::new(Skew::new(grid, SkewSpec { skew_s: v[0], rate: 0.0 })),
    twins: &["skew", "lag", "second_order_lag"],
    family: Some((Family::Late, |v| v[0])),
    ..Wrapper::PLAIN
};

pub(super) static SKEW: Wrapper = Wrapper {
    name: "skew",
    words: "it is sampled earlier or later than the rest, by a clock of its own",
    equation: "y(t) = x(t - skew_s - rate t), t since the trial began",
    usual: &[Output],
    parameters: |e, _| {
        let late = e.late_s();
        vec![strength("skew_s", "s", -late, late), form("rate", "s/s", [-1e-3, 1e-3], 0.0)]
    },
    starts: Some(|e| [-0.2, -0.03, 0.03, 0.1, 0.5].map(|k| vec![k * e.late_s(), 0.0]).into()),
    operator: |v, _, grid| Box::new(Skew::new(grid, SkewSpec { skew_s: v[0], rate: v[1] })),
    twins: &["delay", "lag", "second_order_lag"],
    family: Some((Family::Late, |v| v[0])),
    ..Wrapper::PLAIN
};

pub(super) static LAG: Wrapper = Wrapper {
    name: "lag",
    words: "it follows slowly, without overshoot",
    equation: "y = mean_rev(mean_rev(x, tau_s (1 - second)), tau_s second)",
    usual: &[Input, Output],
    parameters: |e, _| {
        vec![strength("tau_s", "s", 0.0, 2.0 * e.late_s()), form("second", "1", [0.0, 0.5], 0.1)]
    },
    starts: Some(|e| [0.03, 0.12, 0.4].map(|k| vec![2.0 * k * e.late_s(), 0.1]).into()),
    operator: |v, _, grid| {
        Box::new(Lowpass::new(Poles { tau_s: v[0].max(1e-9), second: v[1] }, grid))
    },
    twins: &["delay", "skew", "second_order_lag", "relaxation"],
    family: Some((Family::Late, |v| v[0])),
    ..Wrapper::PLAIN
};

pub(super) static SECOND_ORDER_LAG: Wrapper = Wrapper {
    name: "second_order_lag",
    words: "it follows like a mass on a spring",
    equation: "m_s^2 y'' = x - y - 2 damping m_s y'",
    usual: &[Output],
    parameters: |e, _| {
        vec![strength("m_s", "s", 0.0, e.late_s()), log_form("damping", "1", [0.02, 0.95], 0.3)]
    },
    starts: Some(|e| [0.03, 0.12, 0.4].map(|k| vec![k * e.late_s(), 0.3]).into()),
    operator: |v, _, grid| {
        Box::new(Oscillator::new(Swing { m: v[0].max(1e-9), damping: v[1] }, grid))
    },
    twins: &["lag", "delay", "skew"],
    family: Some((Family::Late, |v| 2.0 * v[1] * v[0])),
    ..Wrapper::PLAIN
};

pub(super) static RELAXATION: Wrapper = Wrapper {
    name: "relaxation",
    words: "it overshoots a quick change and relaxes, or creeps after it",
    equation: "y = x + c (x - mean of mean_rev(x, tau_s {1/spread, 1, spread}))",
    usual: &[Output],
    parameters: |e, _| {
        let longest = (0.5 * e.trial_s).max(20.0 * e.dt_s);
        vec![
            strength("c", "1", -0.5, 0.6),
            shape("tau_s", "s", 4.0 * e.dt_s, longest),
            log_form("spread", "1", [1.0, 8.0], 1.6),
        ]
    },
    operator: |v, e, grid| {
        Box::new(FadingMemory::new(v[0], Times { tau_s: v[1], spread: v[2] }, e.span(), grid))
    },
    twins: &["lag"],
    ..Wrapper::PLAIN
};

pub(super) static SLEW_LIMIT: Wrapper = Wrapper {
    name: "slew_limit",
    words: "it cannot change faster than a rate",
    equation: "|y'| <= rate, y follows x",
    usual: &[Input, Output],
    // At twice the quickest change that was seen nothing is limited.
    parameters: |e, unit| {
        let off = 2.0 * e.quickest.max(1e-9 * e.span() / e.dt_s);
        vec![threshold("rate", &format!("{unit}/s"), [0.01 * off, off], off)]
    },
    starts: Some(|e| [0.45, 0.3, 0.15, 0.06].map(|k| vec![2.0 * k * e.quickest]).into()),
    operator: |v, _, _| Box::new(SlewLimit { rate: v[0] }),
    twins: &["lag"],
    ..Wrapper::PLAIN
};

//! Effects in forms of their own, put into a signal that was measured.

use stretch_operators::play;

/// What is done to a signal.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// It shows what was so many milliseconds before.
    Late,
    /// It sinks by so many per cent of its span a minute.
    Drift,
    /// It follows with a time constant of so many milliseconds.
    Lag,
    /// It follows once a play of so many per cent of its span to either side is used up.
    Play,
    /// It cannot rise beyond so many per cent of its span.
    Clip,
}

/// An effect that is put into a signal.
#[derive(Debug)]
pub(crate) struct Injection {
    kind: Kind,
    pub(crate) words: &'static str,
    /// Unit of the strengths.
    unit: &'static str,
    pub(crate) strengths: [f64; 3],
    /// What the catalogue calls it.
    pub(crate) name: &'static str,
    /// Other names that a record of two minutes of alike strokes may well not tell from it.
    pub(crate) kin: &'static [&'static str],
    /// Its strength among the parameters of the effect, and how much of ours makes one of that.
    pub(crate) size: Option<(&'static str, f64)>,
}

/// The effects, each at three strengths.
pub(crate) const ALL: [Injection; 5] = [
    Injection {
        kind: Kind::Late,
        words: "late",
        unit: "ms",
        strengths: [30.0, 70.0, 150.0],
        name: "channel_skew",
        kin: &["amplifier_lowpass", "gauge_relaxation"],
        size: Some(("skew_s", 1e3)),
    },
    Injection {
        kind: Kind::Drift,
        words: "drift",
        unit: "%/min",
        strengths: [0.5, 1.0, 3.0],
        name: "thermal_drift",
        kin: &["self_heating", "gauge_softening"],
        size: None,
    },
    Injection {
        kind: Kind::Lag,
        words: "lag",
        unit: "ms",
        strengths: [20.0, 50.0, 150.0],
        name: "amplifier_lowpass",
        kin: &["channel_skew", "gauge_relaxation"],
        size: Some(("tau", 1e3)),
    },
    Injection {
        kind: Kind::Play,
        words: "play",
        unit: "%",
        strengths: [2.0, 5.0, 10.0],
        name: "sleeve_slip",
        kin: &["gauge_hysteresis", "pot_backlash"],
        // The catalogue's strain has a stroke of 0.2; here the stroke is 1.
        size: Some(("w", 100.0)),
    },
    // Not looked for in a gauge alone, whose amplifier is unknown.
    Injection {
        kind: Kind::Clip,
        words: "clipped at",
        unit: "%",
        strengths: [95.0, 90.0, 80.0],
        name: "amplifier_saturation",
        kin: &["gauge_nonlinearity", "sleeve_slack"],
        size: None,
    },
];

impl Injection {
    /// Such as `late 30 ms`.
    pub(crate) fn in_words(&self, strength: f64) -> String {
        format!("{} {strength} {}", self.words, self.unit)
    }

    /// Puts it into a signal, noise and all.
    pub(crate) fn apply(&self, strength: f64, time_s: &[f64], signal: &mut [f64]) {
        let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
        let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let span = high - low;
        let share = 0.01 * strength * span;
        match self.kind {
            Kind::Late => late(1e-3 * strength, time_s, signal),
            Kind::Drift => {
                signal.iter_mut().zip(time_s).for_each(|(y, t)| *y -= share * t / 60.0);
            }
            Kind::Lag => lag(1e-3 * strength, time_s, signal),
            Kind::Play => {
                let mut z = signal.first().copied().unwrap_or(0.0);
                for y in signal {
                    z = play(z, *y, share);
                    *y = z;
                }
            }
            Kind::Clip => signal.iter_mut().for_each(|y| *y = y.min(low + share)),
        }
    }
}

/// y(t) -> y(t - delay), linear between samples, the first value held.
fn late(delay_s: f64, time_s: &[f64], signal: &mut [f64]) {
    let recorded = signal.to_vec();
    let mut at = 0;
    for (y, t) in signal.iter_mut().zip(time_s) {
        let t = t - delay_s;
        while at + 1 < time_s.len() && time_s[at + 1] <= t {
            at += 1;
        }
        let next = (at + 1).min(time_s.len() - 1);
        let step = time_s[next] - time_s[at];
        let part = if step > 0.0 { ((t - time_s[at]) / step).max(0.0) } else { 0.0 };
        *y = recorded[at] + part * (recorded[next] - recorded[at]);
    }
}

/// tau z' = x - z from rest, the input between two samples their mean.
fn lag(tau_s: f64, time_s: &[f64], signal: &mut [f64]) {
    let Some(&first) = signal.first() else { return };
    let (mut z, mut before) = (first, first);
    for i in 1..signal.len() {
        let kept = (-(time_s[i] - time_s[i - 1]) / tau_s).exp();
        z = kept * z + (1.0 - kept) * 0.5 * (before + signal[i]);
        (before, signal[i]) = (signal[i], z);
    }
}

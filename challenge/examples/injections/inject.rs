//! Effects that are added to a measured signal, in forms that do not come from the catalogue.

use stretch_effects::play;

/// The kinds of effects.
#[derive(Debug, Clone, Copy)]
enum Kind {
    /// A delay, ms.
    Late,
    /// A falling drift, percent of the span per minute.
    Drift,
    /// A first-order lag with a time constant, ms.
    Lag,
    /// A play with a half-width, percent of the span.
    Play,
    /// An upper limit, percent of the span.
    Clip,
}

/// An effect that is added to a signal.
#[derive(Debug)]
pub(crate) struct Injection {
    kind: Kind,
    /// Whether the effect acts before the noise of the sensor is added.
    is_ahead: bool,
    pub(crate) words: &'static str,
    /// Unit of the strengths.
    unit: &'static str,
    pub(crate) strengths: [f64; 3],
    /// Name in the catalogue.
    pub(crate) name: &'static str,
    /// Other effects that may be indistinguishable from it in two minutes of similar strokes.
    pub(crate) kin: &'static [&'static str],
    /// The parameter of the catalogue's effect that is its strength, and the factor from its unit
    /// to ours.
    pub(crate) size: Option<(&'static str, f64)>,
}

const LAG: Injection = Injection {
    kind: Kind::Lag,
    is_ahead: false,
    words: "lag",
    unit: "ms",
    strengths: [20.0, 50.0, 150.0],
    name: "amplifier_lowpass",
    kin: &["channel_skew", "gauge_relaxation"],
    size: Some(("tau", 1e3)),
};

const PLAY: Injection = Injection {
    kind: Kind::Play,
    is_ahead: false,
    words: "play",
    unit: "%",
    strengths: [2.0, 5.0, 10.0],
    name: "sleeve_slip",
    kin: &["gauge_hysteresis", "pot_backlash"],
    // The catalogue's strain has a stroke of 0.2; here the stroke is 1.
    size: Some(("w", 100.0)),
};

/// The effects, each at three strengths.
pub(crate) const ALL: [Injection; 7] = [
    Injection {
        kind: Kind::Late,
        is_ahead: false,
        words: "late",
        unit: "ms",
        strengths: [30.0, 70.0, 150.0],
        name: "channel_skew",
        kin: &["amplifier_lowpass", "gauge_relaxation"],
        size: Some(("skew_s", 1e3)),
    },
    Injection {
        kind: Kind::Drift,
        is_ahead: false,
        words: "drift",
        unit: "%/min",
        strengths: [0.5, 1.0, 3.0],
        name: "thermal_drift",
        kin: &["self_heating", "gauge_softening"],
        size: None,
    },
    LAG,
    Injection { is_ahead: true, words: "lag, noise after it,", ..LAG },
    PLAY,
    Injection { is_ahead: true, words: "play, noise after it,", ..PLAY },
    // This effect is not searched in a gauge alone, because the limits of its amplifier are unknown.
    Injection {
        kind: Kind::Clip,
        is_ahead: false,
        words: "clipped at",
        unit: "%",
        strengths: [95.0, 90.0, 80.0],
        name: "amplifier_saturation",
        kin: &["gauge_nonlinearity", "sleeve_slack"],
        size: None,
    },
];

impl Injection {
    /// Returns a description such as `late 30 ms`.
    pub(crate) fn in_words(&self, strength: f64) -> String {
        format!("{} {strength} {}", self.words, self.unit)
    }

    /// Adds the effect to a signal.
    pub(crate) fn apply(&self, strength: f64, time_s: &[f64], signal: &mut [f64]) {
        let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
        let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let share = 0.01 * strength * (high - low);
        let act = |signal: &mut [f64]| match self.kind {
            Kind::Late => late(1e-3 * strength, time_s, signal),
            Kind::Drift => {
                signal.iter_mut().zip(time_s).for_each(|(y, t)| *y -= share * t / 60.0);
            }
            Kind::Lag => lag(1e-3 * strength, time_s, signal),
            Kind::Play => slip(share, signal),
            Kind::Clip => signal.iter_mut().for_each(|y| *y = y.min(low + share)),
        };
        match self.is_ahead {
            true => ahead_of_noise(signal, act),
            false => act(signal),
        }
    }
}

/// Replaces y(t) by y(t - delay), with linear interpolation. Before the start, the first value is
/// used.
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

/// Replaces x by z with tau z' = x - z, from rest. Between two samples the input is their mean.
fn lag(tau_s: f64, time_s: &[f64], signal: &mut [f64]) {
    let Some(&first) = signal.first() else { return };
    let (mut z, mut before) = (first, first);
    for i in 1..signal.len() {
        let kept = (-(time_s[i] - time_s[i - 1]) / tau_s).exp();
        z = kept * z + (1.0 - kept) * 0.5 * (before + signal[i]);
        (before, signal[i]) = (signal[i], z);
    }
}

/// Applies a play of half-width `w` that begins in its middle.
fn slip(w: f64, signal: &mut [f64]) {
    let mut z = signal.first().copied().unwrap_or(0.0);
    for y in signal {
        z = play(z, *y, w);
        *y = z;
    }
}

/// Number of samples on each side. The mean over these samples (0.11 s at 100 Hz) is used as the
/// signal without noise.
const BESIDE: usize = 5;

/// Applies an effect to the signal without its noise, and adds the noise again, because an effect
/// before the sensor does not change the noise of the sensor.
fn ahead_of_noise(signal: &mut [f64], act: impl Fn(&mut [f64])) {
    let mean = |i: usize| {
        // The number of samples is equal on both sides, so that a slope causes no bias at the ends.
        let beside = BESIDE.min(i).min(signal.len() - 1 - i);
        let window = &signal[i - beside..=i + beside];
        window.iter().sum::<f64>() / window.len() as f64
    };
    let smooth: Vec<f64> = (0..signal.len()).map(mean).collect();
    let mut acted = smooth.clone();
    act(&mut acted);
    signal.iter_mut().zip(acted.iter().zip(&smooth)).for_each(|(y, (a, s))| *y += a - s);
}

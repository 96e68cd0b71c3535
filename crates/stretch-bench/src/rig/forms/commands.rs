//! What the simulator's stages leave to whoever drives them: openings before they reach a valve, samples after they left
//! the bridge. Both act outside of the stage.

use stretch_sim::{Action, EffectParameter, Stage};

use super::{Form, linear};

pub(in crate::rig) static VALVE_DEADBAND: Form = Form {
    name: "valve_deadband",
    stage: Stage::Pneumatics,
    equation: "u -> max(0, u - u_db (1 - exp(-u/(u_db softness)))), conductance times 1 - exp(-u/(u_db gate)); u_db times `outlet` at the outlet, times 2 - `outlet` at the inlet",
    parameters: &[
        EffectParameter::strength("u_db", "1", 0.0, 0.11, 0.03),
        EffectParameter::shape("softness", "1", 0.02, 1.5, 0.1),
        EffectParameter::shape("gate", "1", 0.001, 2.0, 0.01),
        linear("outlet", 0.0, 2.0, 1.0),
    ],
    needs: None,
    action: |_, _| Action::Delay(0.0),
};

pub(in crate::rig) static CHANNEL_SKEW: Form = Form {
    name: "channel_skew",
    stage: Stage::Sensing,
    equation: "bridge samples show the length of skew_s + rate t earlier, t since the trial began; beyond that it wanders by wobble |skew_s| (1 sd)",
    parameters: &[
        EffectParameter::strength("skew_s", "s", -0.1, 0.2, 0.02),
        linear("rate", -5e-4, 5e-4, 0.0),
        linear("wobble", 0.0, 0.25, 0.0),
    ],
    needs: None,
    action: |_, _| Action::Delay(0.0),
};

/// Openings as a valve with a dead band takes them. Less than the least conductance passes as pulses of it: a share of
/// the samples, evenly spread.
pub(crate) fn deadband(values: &[f64], side: usize, least: f64, openings: &[f64]) -> Vec<f64> {
    let share = if side == 0 { 2.0 - values[3] } else { values[3] };
    let (u_db, soft, gate) = ((values[0] * share).max(1e-9), values[1], values[2]);
    let mut owed = 0.0;
    openings
        .iter()
        .map(|&u| {
            let shifted = u - u_db * (1.0 - (-u / (u_db * soft)).exp());
            if u <= 0.0 || shifted <= 0.0 {
                return 0.0;
            }
            let share = (least + (1.0 - least) * shifted) * (1.0 - (-u / (u_db * gate)).exp());
            if share >= least {
                return ((share - least) / (1.0 - least)).min(1.0);
            }
            owed += share / least;
            if owed >= 1.0 {
                owed -= 1.0;
                // Barely open.
                return 1e-12;
            }
            0.0
        })
        .collect()
}

/// Value a share of the way from sample `i` to the next, on a cubic through four samples (Catmull and Rom 1974); the
/// first and last value are held.
pub(in crate::rig) fn cubic(samples: &[f64], i: usize, share: f64) -> f64 {
    let at = |i: usize| samples[i.min(samples.len() - 1)];
    let (a, b, c, d) = (at(i.saturating_sub(1)), at(i), at(i + 1), at(i + 2));
    let t = share;
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

/// Samples read `skew_s + rate t` earlier, by cubics through four samples; the first and last value are held.
pub(crate) fn skew(values: &[f64], dt_s: f64, samples: &mut [f64]) {
    let source = samples.to_vec();
    let last = source.len() as f64 - 1.0;
    for (i, out) in samples.iter_mut().enumerate() {
        let time = i as f64 - (values[0] + values[1] * i as f64 * dt_s) / dt_s;
        let time = time.clamp(0.0, last);
        *out = cubic(&source, time as usize, time.fract());
    }
}

/// Time over which a wandering skew is taken as steady, s.
const STEADY_S: f64 = 2.0;

/// A skew that wanders with standard deviation `sd_s`: in each stretch the most likely one for a record with noise `noise`,
/// as if the sample itself had not been used to find it.
pub(crate) fn wobble(sd_s: f64, noise: f64, dt_s: f64, measured: &[f64], samples: &mut [f64]) {
    if sd_s <= 0.0 {
        return;
    }
    let source = samples.to_vec();
    let last = source.len().saturating_sub(1);
    let slope = |i: usize| {
        let (a, b) = (i.saturating_sub(1), (i + 1).min(last));
        (source[b] - source[a]) / ((b - a).max(1) as f64 * dt_s)
    };
    let window = ((STEADY_S / dt_s) as usize).max(8);
    let ridge = (noise / sd_s).powi(2);
    for begin in (0..source.len()).step_by(window) {
        let stretch = begin..(begin + window).min(source.len());
        let (mut own, mut mixed) = (ridge, 0.0);
        for i in stretch.clone() {
            own += slope(i) * slope(i);
            mixed -= (measured[i] - source[i]) * slope(i);
        }
        let late_s = mixed / own;
        for i in stretch {
            let leverage = (slope(i) * slope(i) / own).min(0.5);
            let shown = source[i] - late_s * slope(i);
            samples[i] = measured[i] - (measured[i] - shown) / (1.0 - leverage);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dead_band_shuts_shifts_and_gates() {
        let hard = deadband(&[0.03, 0.02, 0.001, 1.0], 0, 0.02, &[0.0, 0.0025, 0.125, 1.0]);
        assert_eq!(hard[..2], [0.0, 0.0]);
        assert!((hard[2] - 0.095).abs() < 1e-9 && (hard[3] - 0.97).abs() < 1e-9);
        // A gate that lets a quarter of the least conductance pass is open a quarter of the time.
        let slow = deadband(&[0.01, 1.5, 0.9, 1.0], 0, 0.02, &[0.0025; 1000]);
        let open = slow.iter().filter(|u| **u > 0.0).count();
        assert!((200..320).contains(&open), "{open}");
    }

    #[test]
    fn a_skew_shifts_a_line() {
        let mut line: Vec<f64> = (0..100).map(f64::from).collect();
        skew(&[0.025, 0.0], 0.01, &mut line);
        assert!((line[50] - 47.5).abs() < 1e-9);
    }
}

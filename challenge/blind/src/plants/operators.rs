//! Operators in front of or behind a stage, on sampled signals, each in a form that need not be in
//! the catalogue.

use super::label::Form;

/// y(t) = x(t - delay), with a part `softness` of it as a lag instead of a dead time.
pub(super) fn delay(x: &[f64], delay_s: f64, form: &Form, dt_s: f64) -> Vec<f64> {
    let dead = delay_s * (1.0 - form.softness) / dt_s;
    let (whole, rest) = (dead.floor() as usize, dead.fract());
    let at = |i: usize| x[i.saturating_sub(whole)];
    let moved: Vec<f64> =
        (0..x.len()).map(|i| at(i) * (1.0 - rest) + at(i.saturating_sub(1)) * rest).collect();
    lag(&moved, delay_s * form.softness, &Form::default(), dt_s)
}

/// y follows x by two lags of the shares 1 - spread/2 and spread/2 of `tau_s`, exact between samples.
pub(super) fn lag(x: &[f64], tau_s: f64, form: &Form, dt_s: f64) -> Vec<f64> {
    let second = 0.5 * form.spread;
    let mut out = x.to_vec();
    for tau in [tau_s * (1.0 - second), tau_s * second] {
        if tau < 1e-9 {
            continue;
        }
        let share = 1.0 - (-dt_s / tau).exp();
        let mut y = out[0];
        for value in &mut out {
            y += share * (*value - y);
            *value = y;
        }
    }
    out
}

/// Values nearer to zero than `width` do nothing; the corner is rounded by a softplus, and its two sides differ by the asymmetry.
pub(super) fn dead_zone(x: &[f64], width: f64, form: &Form) -> Vec<f64> {
    let corner = (form.softness * width).max(1e-9);
    let rise = |z: f64| {
        let z = z / corner;
        corner * if z > 30.0 { z } else { z.exp().ln_1p() }
    };
    let (up, down) = (width * (1.0 + form.asymmetry), width * (1.0 - form.asymmetry));
    x.iter().map(|&x| if width < 1e-12 { x } else { rise(x - up) - rise(-x - down) }).collect()
}

/// Values are limited to `limit` (and its negative): y = x (1 + |x/limit|^q)^(-1/q), q =
/// 2/softness, and clamped at a softness of 0.
pub(super) fn saturation(x: &[f64], limit: f64, form: &Form) -> Vec<f64> {
    x.iter()
        .map(|&x| {
            let end = limit * if x > 0.0 { 1.0 } else { 1.0 - form.asymmetry.abs() };
            if form.softness < 0.02 {
                return x.clamp(-end, end);
            }
            let q = 2.0 / form.softness;
            x * (1.0 + (x / end).abs().powf(q)).powf(-1.0 / q)
        })
        .collect()
}

/// One element with play: it is constant until x is further away than `radius`.
fn play(x: &[f64], radius: f64) -> Vec<f64> {
    let mut y = x[0];
    x.iter()
        .map(|&x| {
            y = y.clamp(x - radius, x + radius);
            y
        })
        .collect()
}

/// Mean of four plays whose radii spread around `width`.
pub(super) fn backlash(x: &[f64], width: f64, form: &Form) -> Vec<f64> {
    let steps = [-1.0, -0.3, 0.3, 1.0];
    let plays = steps.map(|s| play(x, width * (1.0 + s * form.spread).max(0.0)));
    let shift = form.asymmetry * width;
    (0..x.len()).map(|i| plays.iter().map(|p| p[i]).sum::<f64>() / 4.0 + shift).collect()
}

/// x minus a share of what plays of the radii `scale` {1, 1/2, 1/4} hold back, weighted by the
/// spread.
pub(super) fn hysteresis(x: &[f64], share: f64, scale: f64, form: &Form) -> Vec<f64> {
    let plays = [1.0, 0.5, 0.25].map(|r| play(x, scale * r));
    let weights = [1.0, 1.0 + form.spread, 1.0 - 0.5 * form.spread];
    let total: f64 = weights.iter().sum();
    (0..x.len())
        .map(|i| {
            let held = (0..3).map(|k| weights[k] * (x[i] - plays[k][i])).sum::<f64>() / total;
            x[i] - share * held
        })
        .collect()
}

/// x plus a share of its distance from a lagged copy: it overshoots a change, or creeps after it if
/// the share is negative.
pub(super) fn relaxation(x: &[f64], share: f64, tau_s: f64, form: &Form, dt_s: f64) -> Vec<f64> {
    let spread = 1.0 + 3.0 * form.spread;
    let (fast, slow) = (
        lag(x, tau_s / spread, &Form::default(), dt_s),
        lag(x, tau_s * spread, &Form::default(), dt_s),
    );
    (0..x.len()).map(|i| x[i] + share * (x[i] - 0.5 * (fast[i] + slow[i]))).collect()
}

/// The zero drifts by `change` from the start of the session to its end, bent by the softness.
pub(super) fn drift(x: &[f64], change: f64, start: f64, share_step: f64, form: &Form) -> Vec<f64> {
    let bend = 3.0 * form.softness + 1e-9;
    let shape = |t: f64| (1.0 - (-bend * t).exp()) / (1.0 - (-bend).exp());
    x.iter().enumerate().map(|(i, x)| x + change * shape(start + share_step * i as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const X: [f64; 6] = [0.0, 1.0, 3.0, 2.0, -2.0, -3.0];

    #[test]
    fn sharp_forms_are_the_textbook_ones() {
        let sharp = Form::default();
        assert_eq!(delay(&X, 0.5, &sharp, 0.5), [0.0, 0.0, 1.0, 3.0, 2.0, -2.0]);
        assert_eq!(saturation(&X, 2.0, &sharp), [0.0, 1.0, 2.0, 2.0, -2.0, -2.0]);
        assert_eq!(backlash(&X, 1.0, &sharp), [0.0, 0.0, 2.0, 2.0, -1.0, -2.0]);
        let dead = dead_zone(&X, 1.0, &sharp);
        for (found, expected) in dead.iter().zip([0.0, 0.0, 2.0, 1.0, -1.0, -2.0]) {
            assert!((found - expected).abs() < 1e-6, "{dead:?}");
        }
    }

    #[test]
    fn effects_that_are_off_change_nothing() {
        let form = Form { softness: 0.4, asymmetry: 0.2, spread: 0.5 };
        let off = [
            delay(&X, 0.0, &form, 0.5),
            lag(&X, 0.0, &form, 0.5),
            dead_zone(&X, 0.0, &form),
            backlash(&X, 0.0, &form),
            hysteresis(&X, 0.0, 1.0, &form),
            relaxation(&X, 0.0, 2.0, &form, 0.5),
            drift(&X, 0.0, 0.0, 0.1, &form),
        ];
        off.iter().for_each(|y| assert_eq!(y, &X));
    }
}

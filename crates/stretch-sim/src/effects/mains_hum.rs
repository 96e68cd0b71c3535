//! The mains couple into the bridge.

use std::f64::consts::{FRAC_PI_4, TAU};

use stretch_operators::Hum;

use crate::{
    effects::{Action, Effect, EffectParameter, Line, Measured, Role},
    sketch::hum,
    stage::Stage,
};

/// The mains couple into the bridge.
pub(super) static MAINS_HUM: Effect = Effect {
    name: "mains_hum",
    words: "mains hum is picked up",
    stage: Stage::Sensing,
    equation: "v -> v + a sin(2 pi f t + phase), not skewed",
    parameters: &[
        EffectParameter::strength("a", "V", 0.0, 0.1, 0.02),
        EffectParameter::shape("f", "Hz", 50.0, 60.0, 50.0).linear().with_role(Role::Choice),
        // On samples at twice the mains' frequency a hum is as large as the sine of its phase: one that stands for all.
        EffectParameter::shape("phase", "rad", -TAU, TAU, 0.0)
            .linear()
            .with_role(Role::Found { stand_in: FRAC_PI_4 }),
    ],
    action: |values, _| {
        Action::Record(Box::new(Hum { a: values[0], f_hz: values[1], phase: values[2] }))
    },
    find: Some(wandering),
    line: Some(|values| Line { hertz: values[1], amplitude: values[0] }),
    // At fs the hum shows at |f - k fs|. From 1.5 f on that is a third of fs at least and f/2 = 25 Hz at least, where no muscle
    // moves; a slower record shows it anywhere, down to a slow wave that passes for motion or drift.
    shown_from_hz: Some(|values| 1.5 * values[1]),
    starts: Some(|_| {
        [50.0, 60.0].iter().flat_map(|f| [0.002, 0.02].map(|a| vec![a, *f])).collect()
    }),
    sketch: Some(|v, around| hum([v[0], v[1], v[2]], around.record())),
    ..Effect::PLAIN
};

/// Window in which the phase is taken as steady, s.
const WINDOW_S: f64 = 1.0;

/// Adds to samples that may be fitted the hum whose phase in each second is the one that the measured record shows: as much of
/// the residual at the line's frequency as the amplitude allows; noise shrinks what it cannot tell. Each sample is foretold by
/// the others of its second. On samples to test on nothing is found: there the hum is a [`Line`].
fn wandering(values: &[f64], record: &Measured<'_>, simulated: &mut [f64]) {
    let (a, f) = (values[0] * record.unit, values[1]);
    let window = ((WINDOW_S / record.dt_s) as usize).max(8);
    for (block, values) in simulated.chunks_mut(window).enumerate() {
        let first = block * window;
        let measured = &record.samples[first..first + values.len()];
        let wave = |i: usize| {
            let turns = f * record.dt_s * (first + i) as f64;
            let angle = TAU * (turns - turns.floor());
            (libm::cos(angle), libm::sin(angle))
        };
        let (mut cc, mut cs, mut ss, mut rc, mut rs) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (i, (m, v)) in measured.iter().zip(values.iter()).enumerate() {
            let (c, s) = wave(i);
            let r = m - v;
            cc += c * c;
            cs += c * s;
            ss += s * s;
            rc += r * c;
            rs += r * s;
        }
        // Both quadratures are normal with variance a^2/2 before the record is seen.
        let ridge = record.noise * record.noise / (0.5 * a * a + 1e-18);
        let (cc, ss) = (cc + ridge, ss + ridge);
        let determinant = cc * ss - cs * cs;
        let (mut p, mut q) = ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
        let size = (p * p + q * q).sqrt();
        if size > 1.5 * a {
            (p, q) = (p * 1.5 * a / size, q * 1.5 * a / size);
        }
        for (i, (m, v)) in measured.iter().zip(values.iter_mut()).enumerate() {
            let (c, s) = wave(i);
            let hum = p * c + q * s;
            // As if the sample itself had not been used to find the phase: no noise is explained away.
            let leverage = (ss * c * c - 2.0 * cs * c * s + cc * s * s) / determinant;
            *v = m - (m - (*v + hum)) / (1.0 - leverage.min(0.5));
        }
    }
}

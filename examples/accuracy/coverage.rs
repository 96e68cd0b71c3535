//! How often the 95 % bounds of an observer's parameters contain the true values.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_calibrate::Options;
use stretch_data::{Channel, Trial};

use crate::{ResultTable, score::number, simulated::fitted};

const SEEDS: u64 = 60;
const PERIOD_S: f64 = 0.01;
const LEAD_S: f64 = 0.02;
const AMPLITUDE: f64 = 0.4;
const TAU_S: f64 = 0.25;

/// Simulates a gauge of exactly the observer's form, with a motion of random sines, white noise of
/// 1 % and, if `wandering` is above zero, an error that is not in the model: a first-order
/// Gauss-Markov process of 1 s.
fn trial(random: &mut ChaCha8Rng, wandering: f64) -> Trial {
    let waves: Vec<(f64, f64)> = (0..5)
        .map(|k| (0.4 + 1.3 * f64::from(k) + random.random::<f64>(), TAU * random.random::<f64>()))
        .collect();
    let target = |t: f64| 0.5 + waves.iter().map(|(w, p)| 0.09 * (w * t + p).sin()).sum::<f64>();
    let share = -(-PERIOD_S / TAU_S).exp_m1();
    let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
    let (mut slow, mut drift) = (target(0.0), wandering * normal());
    let time_s: Vec<f64> = (0..3000).map(|n| n as f64 * PERIOD_S).collect();
    let mut signal = |&t: &f64| {
        let y = target(t);
        slow += share * (y - slow);
        let keep = (-PERIOD_S).exp();
        drift = keep * drift + wandering * (1.0 - keep * keep).sqrt() * normal();
        let rate = (target(t + 1e-4) - target(t - 1e-4)) / 2e-4;
        let drive = y + LEAD_S * rate + AMPLITUDE * (y - slow);
        1.24 + drive - 0.2 * drive * drive + 0.01 * normal() + drift
    };
    let bridge_v = time_s.iter().map(&mut signal).collect();
    let length_mm = time_s.iter().map(|&t| 180.0 - 30.0 * target(t)).collect();
    let channel = |name: &str, values| Channel { name: name.into(), values };
    Trial {
        name: "known.csv".into(),
        time_s,
        channels: vec![channel("length_mm", length_mm), channel("bridge_v", bridge_v)],
    }
}

pub(crate) fn tables() -> anyhow::Result<Vec<ResultTable>> {
    let header = ["error of the signal", "lead", "amplitude", "time constant", "fits"];
    let title =
        "Share of fits whose 95 % bounds hold the truth (a gauge of the observer's own form)";
    let mut table = ResultTable::new("coverage.csv", title, &header);
    for (name, wandering) in [("white, 1 %", 0.0), ("white, 1 %, and 1 % over 1 s", 0.01)] {
        let (mut held, mut fits) = ([0.0; 3], 0.0);
        for seed in 0..SEEDS {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let trials = [trial(&mut random, wandering), trial(&mut random, wandering)];
            let options = Options { rest_length: Some(180.0), ..Options::default() };
            let found = fitted("observer", &trials, &options)?;
            let coefficients = &found.fits[0].coefficients;
            let find = |start: &str| coefficients.iter().find(|c| c.name.starts_with(start));
            let parts = [("lead", LEAD_S), ("relaxation", AMPLITUDE), ("time constant", TAU_S)];
            fits += 1.0;
            for (held, (start, truth)) in held.iter_mut().zip(parts) {
                let inside = find(start).is_some_and(|c| c.lower <= truth && truth <= c.upper);
                *held += f64::from(u8::from(inside));
            }
        }
        let mut row = vec![name.to_owned()];
        row.extend(held.iter().map(|held| number(held / fits)));
        row.push(format!("{fits}"));
        table.push(row);
    }
    Ok(vec![table])
}

//! Counts how often a gauge without a fault is wrongly excluded as faulty in simulated hours.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use stretch_data::{Channel, Trial};
use stretch_sleeve::{SleeveCalibration, SleeveOptions, apply_array, calibrate_array};

const HZ: f64 = 100.0;
const GAUGES: usize = 5;
/// Duration of the calibration, and of each trial to which it is then applied, s.
const CALIBRATED_S: f64 = 120.0;
const TRIAL_S: f64 = 600.0;
/// Step of the converter, as a share of a gauge's range of about one.
const STEP: f64 = 1.0 / 1024.0;
const SEED: u64 = 20_261_124;

/// A joint that moves from one random angle to the next and rests in between, and gauges with different memories.
struct Body {
    random: ChaCha8Rng,
    /// Start and end angle of the movement, its beginning and its duration, s.
    moving: [f64; 4],
    slow: [f64; GAUGES],
    /// Standard deviation of the noise, as a share of the step.
    noise: f64,
}

pub(crate) fn print(hours: f64) -> anyhow::Result<()> {
    println!(
        "\n### Simulated gauges without a fault\n\n| noise, steps of the converter | samples that repeat | hours | channels lost |"
    );
    println!("| --- | --- | --- | --- |");
    for noise in [4.0, 1.0, 0.25] {
        let random = ChaCha8Rng::seed_from_u64(SEED);
        let mut body = Body { random, moving: [0.0, 0.0, 0.0, 1.0], slow: [0.0; GAUGES], noise };
        let calibrated = body.trial(CALIBRATED_S);
        let options = SleeveOptions {
            signals: (1..=GAUGES).map(|k| format!("s{k}")).collect(),
            reference: "angle_deg".into(),
            ..SleeveOptions::default()
        };
        let SleeveCalibration::Many(calibration) =
            calibrate_array(std::slice::from_ref(&calibrated), &options)?.calibration
        else {
            anyhow::bail!("five gauges make a calibration of several");
        };
        let values = &calibrated.channels[0].values;
        let repeats = values.windows(2).filter(|w| w[0] == w[1]).count() as f64;
        let repeats = repeats / values.len() as f64;
        let trials = (hours * 3600.0 / TRIAL_S).ceil() as usize;
        let mut lost = 0;
        for _ in 0..trials {
            let trial = body.trial(TRIAL_S);
            let applied = apply_array(&calibration, &trial)?;
            for (channel, at_s, loss) in &applied.losses {
                eprintln!("noise {noise}: channel {channel} at {at_s:.2} s: {loss}");
            }
            lost += applied.losses.len();
        }
        let hours = trials as f64 * TRIAL_S / 3600.0;
        println!("| {noise} | {repeats:.2} | {hours:.1} | {lost} |");
    }
    Ok(())
}

impl Body {
    fn angle(&mut self, time_s: f64) -> f64 {
        let [_, to, since_s, lasts_s] = self.moving;
        if time_s >= since_s + lasts_s {
            // Half of the movements are rests.
            let next = if self.random.random() { 90.0 * self.random.random::<f64>() } else { to };
            self.moving = [to, next, since_s + lasts_s, 0.4 + 1.2 * self.random.random::<f64>()];
        }
        let [from, to, since_s, lasts_s] = self.moving;
        let share = ((time_s - since_s) / lasts_s).clamp(0.0, 1.0);
        // Minimum-jerk movement (Flash and Hogan 1985).
        from + (to - from) * share.powi(3) * (10.0 - 15.0 * share + 6.0 * share * share)
    }

    /// Draws an approximately normal value.
    fn deviate(&mut self) -> f64 {
        (0..12).map(|_| self.random.random::<f64>()).sum::<f64>() - 6.0
    }

    fn trial(&mut self, seconds: f64) -> Trial {
        let count = (seconds * HZ) as usize;
        let mut columns = vec![Vec::new(); 1 + GAUGES];
        self.moving[2] = 0.0;
        self.moving[3] = 1.0;
        for n in 0..count {
            let angle = self.angle(n as f64 / HZ);
            for k in 0..GAUGES {
                let tau_s = 0.1 + 0.1 * k as f64;
                self.slow[k] += (angle - self.slow[k]) / (tau_s * HZ);
                let strain = (angle + 0.2 * (angle - self.slow[k])) / 90.0;
                let curved = strain * (1.0 + 0.1 * k as f64 * strain) / (1.0 + 0.1 * k as f64);
                let noisy = curved + self.noise * STEP * self.deviate();
                columns[k].push((noisy / STEP).round() * STEP);
            }
            columns[GAUGES].push(angle);
        }
        let name = |k: usize| if k < GAUGES { format!("s{}", k + 1) } else { "angle_deg".into() };
        let channels = columns.into_iter().enumerate();
        Trial {
            name: "simulated".into(),
            time_s: (0..count).map(|n| n as f64 / HZ).collect(),
            channels: channels.map(|(k, values)| Channel { name: name(k), values }).collect(),
        }
    }
}

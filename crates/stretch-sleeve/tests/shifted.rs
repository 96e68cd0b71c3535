//! Which of several gauges has shifted: every gauge, in both directions, by several amounts.

use stretch_data::{Channel, Trial};
use stretch_sleeve::{
    ArrayCalibration, MAX_CHANNELS, SleeveCalibration, SleeveOptions, apply_array, calibrate_array,
};
use testkit::random::Random;

const HZ: f64 = 50.0;

/// Gauges of a joint that differ in gain, curvature and noise.
struct Sleeve {
    random: Random,
    /// For each gauge: volts per degree at the middle, curvature, and noise in degrees.
    gauges: Vec<[f64; 3]>,
}

impl Sleeve {
    fn new(seed: u64, gauges: usize) -> Self {
        let mut random = Random::new(seed);
        let one = |random: &mut Random| {
            let sign = if random.unit() < 0.5 { -1.0 } else { 1.0 };
            [
                sign * (0.005 + 0.02 * random.unit()),
                0.8 * (random.unit() - 0.5),
                0.3 * 10_f64.powf(random.unit()),
            ]
        };
        let gauges = (0..gauges).map(|_| one(&mut random)).collect();
        Self { random, gauges }
    }

    /// Records a movement. The gauge `shifted.0` is off by `shifted.1` degrees.
    fn record(&mut self, seconds: f64, shifted: (usize, f64)) -> Trial {
        let phases: [f64; 3] = std::array::from_fn(|_| 6.3 * self.random.unit());
        let angle = |t: f64| {
            45.0 + 25.0 * (1.7 * t + phases[0]).sin()
                + 12.0 * (0.9 * t + phases[1]).sin()
                + 5.0 * (4.3 * t + phases[2]).sin()
        };
        let times: Vec<f64> = (0..(seconds * HZ) as usize).map(|n| n as f64 / HZ).collect();
        let values = times.iter().map(|&t| angle(t)).collect();
        let mut channels = vec![Channel { name: "angle_deg".into(), values }];
        // The errors of a gauge have a correlation time of about two seconds, as in a garment.
        for (k, &[gain, curve, noise]) in self.gauges.iter().enumerate() {
            let mut wander = 0.0;
            let off = if k == shifted.0 { shifted.1 } else { 0.0 };
            let volts = |t: f64, random: &mut Random| {
                wander += -wander / (2.0 * HZ) + noise * random.noise() / HZ.sqrt();
                let share = (angle(t) + off + wander + 0.1 * random.noise()) / 45.0 - 1.0;
                2.0 + 45.0 * gain * (share + curve * share * share)
            };
            let mut volts = volts;
            let values = times.iter().map(|&t| volts(t, &mut self.random)).collect();
            channels.push(Channel { name: format!("s{k}"), values });
        }
        Trial { name: "joint".into(), time_s: times, channels }
    }

    fn calibrated(&mut self) -> ArrayCalibration<MAX_CHANNELS> {
        let trials: Vec<Trial> = (0..3).map(|_| self.record(60.0, (0, 0.0))).collect();
        let options = SleeveOptions {
            signals: (0..self.gauges.len()).map(|k| format!("s{k}")).collect(),
            reference: "angle_deg".into(),
            ..SleeveOptions::default()
        };
        match calibrate_array(&trials, &options).unwrap().calibration {
            SleeveCalibration::Many(many) => *many,
            SleeveCalibration::One(_) => unreachable!("several gauges"),
        }
    }
}

#[test]
fn the_gauge_that_has_shifted_is_named_and_no_other() {
    let (mut reports, mut named, mut wrong) = (0, 0, Vec::new());
    let (mut large, mut large_named) = (0, 0);
    for seed in 0..6 {
        let count = 3 + seed as usize % 2;
        let mut sleeve = Sleeve::new(seed, count);
        let calibration = sleeve.calibrated();
        for shifted in 0..count {
            for off in [-20.0, -10.0, -5.0, 5.0, 10.0, 20.0] {
                let trial = sleeve.record(30.0, (shifted, off));
                for (_, shifts) in apply_array(&calibration, &trial).unwrap().shifts {
                    let is_named = shifts.shifted == 1 << shifted;
                    let is_told = shifts.shifted != 0;
                    reports += usize::from(is_told);
                    named += usize::from(is_named);
                    let is_large = is_told && off.abs() > 15.0;
                    large += usize::from(is_large);
                    large_named += usize::from(is_large && is_named);
                    if is_told && !shifts.may_have_shifted(shifted) {
                        wrong.push((seed, shifted, off, shifts.shifted));
                    }
                }
            }
        }
    }
    println!(
        "{reports} reports, {named} named, of the large ones {large_named} of {large}, wrong {wrong:?}"
    );
    assert!(200 * wrong.len() <= reports, "{} of {reports} are wrong: {wrong:?}", wrong.len());
    assert!(10 * large_named >= 8 * large, "{large_named} of {large}");
}

//! Diagnoses a simulator of a motor with a gear. The measurements are synthetic: they come from a
//! second model, the bench, whose friction and backlash have other forms than those in the
//! catalogue.
use stretch_gap::*;
const SAMPLES: usize = 3000; // of each of two trials; the second is tested on

struct Motor {
    description: Description,
    volts: Vec<f64>,
    angle: Vec<f64>,
    measured: [Vec<f64>; 2],
}

impl Simulator for Motor {
    fn description(&self) -> &Description {
        &self.description
    }
    fn measured(&self, stage: usize) -> &[f64] {
        &self.measured[stage]
    }
    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        let p = &run.model.parameters;
        let [friction, play, ripple] = [0, 1, 2].map(|e| run.model.effect(e).map_or(0.0, |v| v[0]));
        let (mut speed, mut load, h) = (0.0_f64, 0.0, 1e-3 * run.step);
        for (i, out) in out.iter_mut().enumerate() {
            let shaft = p[2] * self.angle[i];
            load = shaft - (shaft - load).clamp(-play, play);
            *out = if run.stage == 0 { speed } else { load };
            let push = p[0] * self.volts[i] + ripple * (6.0 * self.angle[i]).sin();
            for _ in 0..(self.description.spec().dt_s / h).round() as usize {
                let drag = if speed == 0.0 { push } else { f64::INFINITY.copysign(speed) };
                let end = (push - drag.clamp(-friction, friction)) / p[1];
                let next = end + (speed - end) * (-p[1] * h).exp();
                speed = if next * speed < 0.0 { 0.0 } else { next }; // it stops before it turns
            }
        }
        Ok(())
    }
}

fn main() -> Result<(), GapError> {
    let strength = |name, unit, most| vec![EffectParameter::sized(name, unit, 0.0..=most)];
    let gain = ParameterSpec::new("gain", "rad/(V s2)", 100.0).within(10.0);
    let damping = ParameterSpec::new("damping", "1/s", 5.0).within(0.5);
    let ratio = ParameterSpec::new("ratio", "1", 0.1).within(0.001);
    let drive = StageSpec::new("drive", "speed", "rad/s", &[0, 1]);
    let gear = StageSpec::new("gear", "load", "rad", &[2]);
    let friction = EffectSpec::new("friction", (0, "drive"), strength("c", "rad/s2", 100.0));
    let backlash = EffectSpec::new("backlash", (1, "gear"), strength("w", "rad", 0.3));
    let ripple = EffectSpec::new("torque_ripple", (0, "drive"), strength("a", "rad/s2", 100.0));
    let trial = |name, start_s, is_test| TrialSpec::new(name, SAMPLES, start_s, is_test);
    let description = Description::new(DescriptionSpec {
        stages: vec![drive, gear],
        parameters: vec![gain, damping, ratio],
        effects: vec![friction, backlash, ripple],
        trials: vec![trial("monday", 0.0, false), trial("tuesday", 60.0, true)],
        dt_s: 0.01,
    })?;
    // The bench: its friction is a smooth function of the speed and 20 % higher near standstill.
    // Within the backlash, the load still follows the shaft: per sample by 2 % of the difference
    // between the two.
    let mut motor = Motor { description, volts: vec![], angle: vec![], measured: [vec![], vec![]] };
    let (mut speed, mut angle, mut load, mut seed) = (0.0_f64, 0.0_f64, 0.0, 1_u64);
    for i in 0..2 * SAMPLES {
        let t = 0.01 * i as f64;
        seed = seed.wrapping_mul(0x5851_f42d_4c95_7f2d).wrapping_add(1);
        let noise = (seed >> 11) as f64 / 2_f64.powi(52) - 1.0;
        motor.volts.push((3.0 * (1.3 * t).sin() + 2.0 * (4.1 * t).sin()).round());
        motor.angle.push(angle);
        motor.measured[0].push(speed + 0.3 * noise);
        motor.measured[1].push(load + 0.003 * noise);
        for _ in 0..100 {
            let rub = 25.0 * (speed / 0.3).tanh() * (1.0 + 0.2 * (-speed.abs() / 3.0).exp());
            speed += 1e-4 * (106.0 * motor.volts[i] - 5.2 * speed - rub);
            angle += 1e-4 * speed;
        }
        load += 0.1 * angle - load - 0.98 * (0.1 * angle - load).clamp(-0.05, 0.05);
    }
    let (diagnosis, _) = diagnose(&motor, &Options::default(), &|_| (), &|| false)?;
    println!("{}", diagnosis.sentence);
    assert!(["friction", "backlash"].iter().all(|e| diagnosis.named().iter().any(|n| n == e)));
    Ok(())
}

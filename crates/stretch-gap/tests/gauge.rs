//! A gauge as a simulator with one stage: a straight line that lacks one effect.

use stretch_gap::{
    Description, DescriptionSpec, EffectParameter, EffectSpec, GapError, MotionSpec, ParameterSpec,
    RandomGenerator, RecordFacts, Recorded, Run, Simulator, StageSpec, TrialSpec,
};

/// Number of samples of a trial, and sample time, s.
const SAMPLES: usize = 4000;
const DT_S: f64 = 0.01;
/// Noise of the output, V.
const NOISE_V: f64 = 0.002;
/// Standard deviation of the time between a sample and its stamp, s. It causes an error of four times the noise if the
/// rod moves half of its range per second.
pub(crate) const JITTER_S: f64 = 0.016;

/// The effect that the recording contains and the simulator lacks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Lack {
    /// 0.1 V (x - play(x, 0.1)), x from 0 to 1.
    Play,
    /// 0.01 V x |v|, with v in half ranges per second.
    Product,
    /// 0.02 V lag(v^2, 2 s).
    Warming,
    /// 1 V (x - lag(x, 60 s)), slower than a trial is long.
    Settling,
    /// Random switching between two levels.
    Telegraph,
    /// A step at a different time in each trial.
    Jumps,
    /// 0.04 V x (1 - x): the effect that the simulator knows.
    Curve,
    /// No effect.
    Nothing,
    /// White noise of a third of the sensor noise.
    Whisper,
    /// White noise that is larger than the sensor noise.
    White,
    /// Time stamps that jitter by [`JITTER_S`].
    Jitter,
    /// Slow drift: an Ornstein-Uhlenbeck process.
    SlowDrift,
}

/// A gauge of a rod.
#[derive(Debug, Clone)]
pub(crate) struct Gauge {
    description: Description,
    /// Number of units of the rod per millimetre, and of the output per volt.
    units: [f64; 2],
    rod_mm: Vec<f64>,
    volts: Vec<f64>,
}

/// Change of the output over the range of the rod, V.
const GAIN: f64 = 1.0;
/// Rod at rest and its range, mm.
const ZERO_MM: f64 = 40.0;
pub(crate) const RANGE_MM: f64 = 25.0;

impl Gauge {
    pub(crate) fn lacking(lack: Lack, seed: u64) -> Self {
        let mut random = RandomGenerator::new(seed, 9);
        let trials = [("one", false), ("two", false), ("three", false), ("test", true)];
        let specs: Vec<TrialSpec> = trials
            .iter()
            .enumerate()
            .map(|(i, (name, is_test))| TrialSpec::new(name, SAMPLES, 60.0 * i as f64, *is_test))
            .collect();
        let (mut rod_mm, mut volts) = (Vec::new(), Vec::new());
        for _ in 0..trials.len() {
            let tones: Vec<[f64; 2]> = (0..4)
                .map(|k| [0.3 + 0.9 * f64::from(k) + 0.6 * random.unit(), 6.0 * random.unit()])
                .collect();
            let x: Vec<f64> = (0..SAMPLES)
                .map(|i| {
                    let t = DT_S * i as f64;
                    let sum: f64 = tones.iter().map(|[w, p]| (w * t + p).sin()).sum();
                    0.5 + 0.125 * sum
                })
                .collect();
            let extra = extra(lack, &x, &mut random);
            for (x, extra) in x.iter().zip(extra) {
                rod_mm.push(ZERO_MM + RANGE_MM * x);
                volts.push(0.3 + 1.02 * GAIN * x + extra + NOISE_V * random.gauss());
            }
        }
        Self { description: description(specs, 1.0, &rod_mm), units: [1.0; 2], rod_mm, volts }
    }

    /// The same gauge, whose stated noise is `times` the true noise.
    pub(crate) fn with_noise_taken_for(&self, times: f64) -> Self {
        let mut other = self.clone();
        let mut spec = self.description.spec().clone();
        spec.stages[0].noise = Some(stretch_gap::Noise::known(times * NOISE_V));
        let known = self.description.record().clone();
        let description = Description::new(spec).and_then(|d| d.with_record(known));
        other.description = description.expect("a description that holds together");
        other
    }

    /// The same gauge in other units.
    pub(crate) fn scaled(&self, rod: f64, output: f64) -> Self {
        let rod_mm: Vec<f64> = self.rod_mm.iter().map(|x| rod * x).collect();
        Self {
            description: description(self.description.spec().trials.clone(), output, &rod_mm),
            units: [rod, output],
            rod_mm,
            volts: self.volts.iter().map(|x| output * x).collect(),
        }
    }

    /// The same gauge with other values in both columns of the test trial.
    pub(crate) fn with_another_test_trial(&self) -> Self {
        let mut other = self.clone();
        let from = other.rod_mm.len() - SAMPLES;
        for (i, (x, y)) in other.rod_mm[from..].iter_mut().zip(&mut other.volts[from..]).enumerate()
        {
            *x += 3.0 * (0.02 * i as f64).sin();
            *y += 0.05 * (0.03 * i as f64).cos();
        }
        other
    }
}

fn description(trials: Vec<TrialSpec>, volt: f64, rod_mm: &[f64]) -> Description {
    let gain = ParameterSpec::new("gain", "V", GAIN * volt).within(0.05 * volt);
    let offset = ParameterSpec::new("offset", "V", 0.3 * volt).within(0.05 * volt);
    let mut stage = StageSpec::new("gauge", "volts", "V", &[0, 1]);
    stage.noise = Some(stretch_gap::Noise::known(NOISE_V * volt));
    let quadratic = vec![EffectParameter::sized("c", "1", -0.2..=0.2)];
    Description::new(DescriptionSpec {
        stages: vec![stage],
        parameters: vec![gain, offset],
        effects: vec![EffectSpec::new("curve", (0, "gauge"), quadratic)],
        trials,
        dt_s: DT_S,
    })
    .and_then(|description| {
        description.with_record(RecordFacts {
            motion: Some(MotionSpec::new(rod_mm.to_vec(), "mm")),
            signals: vec![Recorded::measured("rod_mm", "mm", rod_mm.to_vec())],
            ..RecordFacts::default()
        })
    })
    .expect("a description that holds together")
}

fn extra(lack: Lack, x: &[f64], random: &mut RandomGenerator) -> Vec<f64> {
    let rate =
        |i: usize| (x[(i + 1).min(x.len() - 1)] - x[i.saturating_sub(1)]) / (2.0 * DT_S) / 0.5;
    let (mut held, mut level) = (x[0], if random.unit() < 0.5 { 0.0 } else { 1.0 });
    let at = random.below(x.len());
    let mut each = |i: usize| match lack {
        Lack::Play => {
            held = x[i] - (x[i] - held).clamp(-0.1, 0.1);
            0.1 * (x[i] - held)
        }
        Lack::Product => 0.01 * x[i] * rate(i).abs(),
        Lack::Warming => {
            held += if i == 0 { -held } else { DT_S * (rate(i).powi(2) - held) / 2.0 };
            0.02 * held
        }
        Lack::Settling => {
            held += DT_S * (x[i] - held) / 60.0;
            x[i] - held
        }
        Lack::Telegraph => {
            if random.unit() < DT_S / 1.5 {
                level = 1.0 - level;
            }
            0.02 * level
        }
        Lack::Jumps => {
            if i == at {
                level = random.gauss();
            }
            0.02 * level
        }
        Lack::Curve => 0.04 * x[i] * (1.0 - x[i]),
        Lack::Nothing => 0.0,
        Lack::Whisper => NOISE_V / 3.0 * random.gauss(),
        // The rate is in half ranges per second.
        Lack::Jitter => GAIN * 0.5 * rate(i) * JITTER_S * random.gauss(),
        Lack::White => 0.01 * random.gauss(),
        Lack::SlowDrift => {
            held += if i == 0 { -held } else { -DT_S * held / 2.0 + DT_S.sqrt() * random.gauss() };
            0.01 * held
        }
    };
    (0..x.len()).map(&mut each).collect()
}

impl Simulator for Gauge {
    fn description(&self) -> &Description {
        &self.description
    }

    fn measured(&self, _: usize) -> &[f64] {
        &self.volts
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        let p = &run.model.parameters;
        let curve = run.model.effect(0).map_or(0.0, |values| values[0]);
        for (out, rod) in out.iter_mut().zip(&self.rod_mm) {
            let x = (rod / self.units[0] - ZERO_MM) / RANGE_MM;
            *out = p[1] + p[0] * (x + curve * x * (1.0 - x));
        }
        Ok(())
    }
}

//! The equations of the toys: laws of stages, and effects on their inputs and outputs.

use stretch_gap::{EffectParameter, EffectSpec, ParameterSpec};

/// The law by which a stage computes its output y from its input x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Law {
    /// y = gain x + zero: linear in its parameters.
    Line,
    /// tau y' = gain x - y, exactly from sample to sample.
    Lag,
    /// y'' = (2 pi rate)^2 (gain x - y) - 2 damping (2 pi rate) y', by the midpoint rule.
    Oscillator,
    /// y(t) = gain x(t - delay), with linear interpolation between samples.
    Delay,
    /// y'' = (2 pi rate)^2 (gain x - sin y) - 2 damping (2 pi rate) y', by the midpoint rule, from rest at y = 0. It
    /// turns over if gain x stays above 1, and y is the angle including full turns.
    Pendulum,
}

impl Law {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Lag => "lag",
            Self::Oscillator => "oscillator",
            Self::Delay => "delay",
            Self::Pendulum => "pendulum",
        }
    }

    /// Returns the nominal parameters, with tolerances of some per cent. The unit of the input is `v`, that of the
    /// output `u`.
    pub(crate) fn parameters(self) -> Vec<ParameterSpec> {
        let of = |name: &str, unit: &str, nominal: f64, sd: f64| {
            ParameterSpec::new(&format!("{}.{name}", self.name()), unit, nominal).within(sd)
        };
        let positive = |p: ParameterSpec| ParameterSpec { least: 1e-3, ..p };
        let gain = of("gain", "u/v", 1.0, 0.05);
        match self {
            Self::Line => vec![gain, of("zero", "u", 0.2, 0.05)],
            Self::Lag => vec![gain, positive(of("tau", "s", 0.1, 0.01))],
            Self::Oscillator => vec![
                gain,
                positive(of("rate", "Hz", 1.0, 0.03)),
                positive(of("damping", "1", 0.3, 0.03)),
            ],
            Self::Delay => vec![gain, positive(of("delay", "s", 0.05, 0.005))],
            Self::Pendulum => vec![
                of("gain", "1/v", 1.5, 0.15),
                positive(of("rate", "Hz", 1.0, 0.05)),
                positive(of("damping", "1", 0.1, 0.02)),
            ],
        }
    }
}

/// Returns the factor from the unit of a parameter to the units of a toy.
pub(crate) fn unit(unit: &str, [input, output]: [f64; 2]) -> f64 {
    match unit {
        "u" => output,
        "u/v" => output / input,
        _ => 1.0,
    }
}

/// An effect that a simulator may lack. Effects on the input act before the law, in the order of the model; the others
/// act on the output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Effect {
    /// The input passes a play of half-width w.
    Play,
    /// x + c x^2.
    Quadratic,
    /// The quadratic under another name: its twin.
    Square,
    /// x + c x^3.
    Cubic,
    /// The input is delayed by d seconds.
    Late,
    /// The output lags by a time constant, s.
    Slow,
    /// The output falls at a constant rate during the session.
    Drift,
    /// y + c (y - z), where z is y after a first-order lag with time constant tau. Of the two parameters, tau is a
    /// shape.
    Creep,
}

impl Effect {
    /// All effects except the twin.
    pub(crate) const ALL: [Self; 7] = [
        Self::Play,
        Self::Quadratic,
        Self::Cubic,
        Self::Late,
        Self::Slow,
        Self::Drift,
        Self::Creep,
    ];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Play => "play",
            Self::Quadratic => "quadratic",
            Self::Square => "square",
            Self::Cubic => "cubic",
            Self::Late => "late",
            Self::Slow => "slow",
            Self::Drift => "drift",
            Self::Creep => "creep",
        }
    }

    /// Returns the entry of the catalogue. Sizes are in units of the input (which is within -1..1), seconds, or units
    /// of the input per second.
    pub(crate) fn spec(self, stage: usize) -> EffectSpec {
        let strength = |name, unit, range| vec![EffectParameter::sized(name, unit, range)];
        let parameters = match self {
            Self::Play => strength("w", "1", 0.0..=0.3),
            Self::Quadratic | Self::Square | Self::Cubic => strength("c", "1", -0.5..=0.5),
            Self::Late => strength("d", "s", 0.0..=0.2),
            Self::Slow => strength("tau", "s", 0.0..=0.3),
            Self::Drift => strength("rate", "1/s", -0.01..=0.01),
            Self::Creep => vec![
                EffectParameter::sized("c", "1", -0.5..=0.5),
                EffectParameter::shaped("tau", "s", 0.2..=5.0),
            ],
        };
        let spec = EffectSpec::new(&super::Toy::name(stage, self), (stage, "toy"), parameters);
        EffectSpec { drifts: self == Self::Drift, ..spec }
    }

    fn is_of_input(self) -> bool {
        matches!(self, Self::Play | Self::Quadratic | Self::Square | Self::Cubic | Self::Late)
    }

    /// Applies the effect to the samples of a trial; `start_s` is the session time of its start.
    fn act(self, values: &[f64], signal: &mut [f64], dt_s: f64, start_s: f64) {
        let size = values[0];
        match self {
            Self::Play => {
                let mut held = signal.first().copied().unwrap_or(0.0);
                for x in signal {
                    held = *x - (*x - held).clamp(-size, size);
                    *x = held;
                }
            }
            Self::Quadratic | Self::Square => signal.iter_mut().for_each(|x| *x += size * *x * *x),
            Self::Cubic => signal.iter_mut().for_each(|x| *x += size * x.powi(3)),
            Self::Late => late(signal, size / dt_s),
            Self::Slow => lag(signal, size, dt_s),
            Self::Drift => {
                let each = signal.iter_mut().enumerate();
                each.for_each(|(i, y)| *y -= size * (start_s + dt_s * i as f64));
            }
            Self::Creep => {
                let mut follows = signal.to_vec();
                lag(&mut follows, values[1], dt_s);
                signal.iter_mut().zip(follows).for_each(|(y, f)| *y += size * (*y - f));
            }
        }
    }
}

/// Delays a signal by a number of samples, with linear interpolation; before its start, the first value is used.
fn late(signal: &mut [f64], samples: f64) {
    let own = signal.to_vec();
    let (whole, share) = (samples.floor(), samples - samples.floor());
    let at = |i: i64| own[i.clamp(0, own.len() as i64 - 1) as usize];
    for (i, x) in signal.iter_mut().enumerate() {
        let i = i as i64 - whole as i64;
        *x = (1.0 - share) * at(i) + share * at(i - 1);
    }
}

/// Applies a first-order lag that begins settled at the first value. It is exact for a signal that is constant between
/// samples.
fn lag(signal: &mut [f64], tau_s: f64, dt_s: f64) {
    let kept = if tau_s > 0.0 { (-dt_s / tau_s).exp() } else { 0.0 };
    let mut y = signal.first().copied().unwrap_or(0.0);
    for x in signal {
        y = *x + kept * (y - *x);
        *x = y;
    }
}

/// One stage over one trial.
pub(crate) struct Plant<'a> {
    pub(crate) parameters: &'a [f64],
    /// Values that are added to a parameter, one for every sample, with the index of the parameter.
    pub(crate) courses: &'a [(usize, &'a [f64])],
    pub(crate) effects: &'a [(Effect, &'a [f64])],
    pub(crate) dt_s: f64,
    pub(crate) step_s: f64,
    pub(crate) start_s: f64,
}

impl Plant<'_> {
    pub(crate) fn run(&self, law: Law, input: &[f64], out: &mut [f64]) {
        let mut x = input.to_vec();
        for (effect, values) in self.effects.iter().filter(|(e, _)| e.is_of_input()) {
            effect.act(values, &mut x, self.dt_s, self.start_s);
        }
        match law {
            Law::Line => {
                for (i, (out, x)) in out.iter_mut().zip(&x).enumerate() {
                    *out = self.at(0, i) * x + self.at(1, i);
                }
            }
            Law::Lag => {
                let mut y = self.at(0, 0) * x.first().copied().unwrap_or(0.0);
                for (i, (out, x)) in out.iter_mut().zip(&x).enumerate() {
                    let kept = (-self.dt_s / self.at(1, i)).exp();
                    let to = self.at(0, i) * x;
                    y = to + kept * (y - to);
                    *out = y;
                }
            }
            Law::Oscillator => self.swing(&x, out, |y| y),
            Law::Pendulum => self.swing(&x, out, f64::sin),
            Law::Delay => {
                late(&mut x, self.at(1, 0) / self.dt_s);
                for (i, (out, x)) in out.iter_mut().zip(&x).enumerate() {
                    *out = self.at(0, i) * x;
                }
            }
        }
        for (effect, values) in self.effects.iter().filter(|(e, _)| !e.is_of_input()) {
            effect.act(values, out, self.dt_s, self.start_s);
        }
    }

    /// A parameter at a sample.
    fn at(&self, parameter: usize, sample: usize) -> f64 {
        let courses = self.courses.iter().filter(|(p, _)| *p == parameter);
        self.parameters[parameter] + courses.map(|(_, course)| course[sample]).sum::<f64>()
    }

    /// Integrates an oscillator whose restoring force is a function of its angle, from rest.
    fn swing(&self, x: &[f64], out: &mut [f64], restoring: fn(f64) -> f64) {
        let steps = ((self.dt_s / self.step_s).round() as usize).max(1);
        let h = self.dt_s / steps as f64;
        let (mut y, mut v) = (self.at(0, 0) * x.first().copied().unwrap_or(0.0), 0.0);
        for (i, (out, x)) in out.iter_mut().zip(x).enumerate() {
            let w = std::f64::consts::TAU * self.at(1, i);
            let (to, rub) = (self.at(0, i) * x, 2.0 * self.at(2, i) * w);
            let push = |y: f64, v: f64| w * w * (to - restoring(y)) - rub * v;
            for _ in 0..steps {
                let (half_y, half_v) = (y + 0.5 * h * v, v + 0.5 * h * push(y, v));
                (y, v) = (y + h * half_v, v + h * push(half_y, half_v));
            }
            *out = y;
        }
    }
}

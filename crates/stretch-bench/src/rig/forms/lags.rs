//! Memories that fade, with more than one time constant.

use stretch_sim::{Action, EffectParameter, MeanReversion, Operator, Span, Stage, Start};

use super::{Form, linear};

pub(super) static MUSCLE_CREEP: Form = Form {
    name: "muscle_creep",
    stage: Stage::Muscle,
    equation: "k_s -> k_s + c (mean of mean_rev(k_s, tau {1/spread, 1, spread}) - k_s)",
    parameters: &[
        EffectParameter::strength("c", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("tau", "s", 0.5, 40.0, 4.0),
        EffectParameter::shape("spread", "1", 1.05, 8.0, 1.6),
    ],
    needs: None,
    action: |v, around| {
        let lags = lags(v[1], v[2], around.contraction_stroke, around.grid);
        Action::StaticContraction(Box::new(Fading { share: -v[0], lags }))
    },
};

pub(super) static GAUGE_RELAXATION: Form = Form {
    name: "gauge_relaxation",
    stage: Stage::Sensing,
    equation: "e -> e + c (e - mean of mean_rev(e, tau {1/spread, 1, spread}))",
    parameters: &[
        EffectParameter::strength("c", "1", -0.3, 0.6, 0.1),
        EffectParameter::shape("tau", "s", 0.02, 4.0, 0.3),
        EffectParameter::shape("spread", "1", 1.05, 8.0, 1.6),
    ],
    needs: None,
    action: |v, around| {
        let lags = lags(v[1], v[2], around.strain_stroke, around.grid);
        Action::Strain(Box::new(Fading { share: v[0], lags }))
    },
};

fn lags(tau: f64, spread: f64, reach: f64, grid: &stretch_sim::Grid) -> [MeanReversion; 3] {
    [tau / spread, tau, tau * spread].map(|tau| MeanReversion::new(tau, reach, grid))
}

/// x + share (x - mean of three lags).
#[derive(Debug)]
struct Fading {
    share: f64,
    lags: [MeanReversion; 3],
}

impl Operator for Fading {
    fn cells(&self) -> usize {
        3 * MeanReversion::CELLS
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (lag, own) in self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            lag.begin(start, first, own);
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let input = signal.to_vec();
        let mut work = vec![0.0; signal.len()];
        for (lag, own) in self.lags.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            work.copy_from_slice(&input);
            lag.run(span, own, &mut work, |x, z| x - z);
            for (y, d) in signal.iter_mut().zip(&work) {
                *y += self.share / 3.0 * d;
            }
        }
    }
}

pub(super) static AMPLIFIER_LOWPASS: Form = Form {
    name: "amplifier_lowpass",
    stage: Stage::Sensing,
    equation: "v -> mean_rev(mean_rev(v, tau (1 - second)), tau second)",
    parameters: &[
        EffectParameter::strength("tau", "s", 0.0, 0.4, 0.05),
        linear("second", 0.001, 0.5, 0.1),
    ],
    needs: None,
    action: |v, around| {
        let lag = |tau: f64| MeanReversion::new(tau.max(1e-9), around.volts_stroke, around.grid);
        Action::Volts(Box::new(Lowpass([lag(v[0] * (1.0 - v[1])), lag(v[0] * v[1])])))
    },
};

#[derive(Debug)]
struct Lowpass([MeanReversion; 2]);

impl Operator for Lowpass {
    fn cells(&self) -> usize {
        2 * MeanReversion::CELLS
    }

    fn begin(&self, _start: Start, first: f64, cells: &mut [f64]) {
        // Powered and settled before every trial, whatever came before.
        for (lag, own) in self.0.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            lag.begin(Start::Settled, first, own);
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        for (lag, own) in self.0.iter().zip(cells.chunks_mut(MeanReversion::CELLS)) {
            lag.run(span, own, signal, |_, z| z);
        }
    }
}

pub(super) static SELF_HEATING: Form = Form {
    name: "self_heating",
    stage: Stage::Sensing,
    equation: "R -> R (1 + h (1 - mean of exp(-t/(tau {1/spread, 1, spread}))))",
    parameters: &[
        EffectParameter::strength("h", "1", -0.05, 0.05, 0.01),
        EffectParameter::shape("tau", "s", 1.0, 60.0, 8.0),
        EffectParameter::shape("spread", "1", 1.05, 8.0, 1.6),
    ],
    needs: None,
    action: |v, around| {
        let taus = [v[1] / v[2], v[1], v[1] * v[2]];
        let decays = around.grid.steps().iter().map(|h| taus.map(|tau| (-h / tau).exp())).collect();
        Action::Resistance(Box::new(Heating { h: v[0], decays }))
    },
};

/// Remembers what is still to warm up, in three parts.
#[derive(Debug)]
struct Heating {
    h: f64,
    decays: Vec<[f64; 3]>,
}

impl Operator for Heating {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells.fill(1.0);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut left = [cells[0], cells[1], cells[2]];
        span.each(signal.len(), |step, i| {
            if let Some(step) = step {
                left.iter_mut().zip(self.decays[step]).for_each(|(x, d)| *x *= d);
            }
            signal[i] *= 1.0 + self.h * (1.0 - (left[0] + left[1] + left[2]) / 3.0);
        });
        cells.copy_from_slice(&left);
    }
}

pub(super) static CROSSBEAM_INERTIA: Form = Form {
    name: "crossbeam_inertia",
    stage: Stage::Muscle,
    equation: "second order behind the lag: natural frequency 1/(2 pi m), damping free",
    parameters: &[
        EffectParameter::strength("m", "s", 0.0, 0.08, 0.02),
        linear("damping", 0.1, 0.6, 0.25),
    ],
    needs: None,
    action: |v, around| {
        Action::MovingContraction(Box::new(Oscillator::new(v[0], v[1], around.grid)))
    },
};

/// A damped oscillator, exact for an input that is linear between nodes. Remembers position, velocity, last input.
#[derive(Debug)]
struct Oscillator {
    m: f64,
    zeta: f64,
    steps: Vec<(f64, [f64; 4])>,
}

impl Oscillator {
    fn new(m: f64, zeta: f64, grid: &stretch_sim::Grid) -> Self {
        let omega = (1.0 - zeta * zeta).sqrt() / m;
        let one = |h: f64| {
            let decay = (-zeta * h / m).exp();
            let (sin, cos) = ((omega * h).sin() / omega, (omega * h).cos());
            let turn = [cos + zeta / m * sin, sin, -sin / (m * m), cos - zeta / m * sin];
            (h, turn.map(|x| decay * x))
        };
        Self { m, zeta, steps: grid.steps().iter().map(|&h| one(h)).collect() }
    }
}

impl Operator for Oscillator {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        if !matches!(start, Start::Carried { rest_s } if rest_s < 20.0 * self.m) {
            cells[0] = first;
            cells[1] = 0.0;
        }
        cells[2] = first;
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut k, mut velocity, mut last] = [cells[0], cells[1], cells[2]];
        span.each(signal.len(), |step, i| {
            let x = signal[i];
            if let Some(step) = step {
                let (h, [a, b, c, d]) = self.steps[step];
                let slope = (x - last) / h;
                // The steady response to a ramp trails it by 2 zeta m slope.
                let trail = 2.0 * self.zeta * self.m * slope;
                let position = k - (last - trail);
                let relative = velocity - slope;
                k = x - trail + (a * position + b * relative);
                velocity = slope + (c * position + d * relative);
            }
            last = x;
            signal[i] = k;
        });
        cells.copy_from_slice(&[k, velocity, last]);
    }
}

//! The crossbeam has a mass, on the spring of the muscle.

use stretch_operators::{Grid, Operator, Span, Start};

use crate::{
    effects::{Action, Effect, EffectParameter, Surroundings},
    stage::Stage,
};

/// The crossbeam has a mass, on the spring of the muscle.
#[derive(Debug)]
pub(super) struct CrossbeamInertia;

static PARAMETERS: &[EffectParameter] = &[EffectParameter::strength("m", "s", 0.0, 0.08, 0.02)];

impl Effect for CrossbeamInertia {
    fn name(&self) -> &'static str {
        "crossbeam_inertia"
    }

    fn stage(&self) -> Stage {
        Stage::Muscle
    }

    fn equation(&self) -> &'static str {
        "k'' = (k_lag - k)/m^2 - 0.5 k'/m behind the lag: natural frequency 1/(2 pi m), damping 0.25"
    }

    fn parameters(&self) -> &'static [EffectParameter] {
        PARAMETERS
    }

    fn action(&self, values: &[f64], around: &Surroundings<'_>) -> Action {
        Action::MovingContraction(Box::new(Oscillator::new(values[0], around.grid)))
    }
}

/// Damping ratio.
const ZETA: f64 = 0.25;

/// A damped oscillator, exact for an input that is linear between nodes. Remembers position, velocity and the last input.
#[derive(Debug)]
struct Oscillator {
    m: f64,
    /// For each piece of time: its length, and how position and velocity about the steady response go on.
    steps: Vec<(f64, [f64; 4])>,
}

impl Oscillator {
    fn new(m: f64, grid: &Grid) -> Self {
        let omega = libm::sqrt(1.0 - ZETA * ZETA) / m;
        let steps = grid
            .steps()
            .iter()
            .map(|&h| {
                let decay = libm::exp(-ZETA * h / m);
                let (sin, cos) = (libm::sin(omega * h) / omega, libm::cos(omega * h));
                let of = |x: f64| decay * x;
                (
                    h,
                    [
                        of(cos + ZETA / m * sin),
                        of(sin),
                        of(-sin / (m * m)),
                        of(cos - ZETA / m * sin),
                    ],
                )
            })
            .collect();
        Self { m, steps }
    }
}

impl Operator for Oscillator {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        // A rest of 20 m leaves less than 1 % of a swing; trials are further apart than that.
        let at_rest = !matches!(start, Start::Carried { rest_s } if rest_s < 20.0 * self.m);
        if at_rest {
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
                let trail = 2.0 * ZETA * self.m * slope;
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

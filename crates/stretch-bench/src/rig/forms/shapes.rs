//! Curves that are not quite parabolas, and changes that settle.

use stretch_sim::{Action, EffectParameter, Operator, Span, Stage, Start};

use super::{Form, linear};

/// 4 x (1 - x) (1 + skew (2 x - 1)): a bow whose top may lie off the middle.
#[inline]
fn bow(x: f64, skew: f64) -> f64 {
    4.0 * x * (1.0 - x) * (1.0 + skew * (2.0 * x - 1.0))
}

pub(super) static GAUGE_NONLINEARITY: Form = Form {
    name: "gauge_nonlinearity",
    stage: Stage::Sensing,
    equation: "R -> R (1 + c 4 x (1 - x)(1 + skew (2 x - 1))), x = e/e0",
    parameters: &[
        EffectParameter::strength("c", "1", -0.1, 0.1, 0.02),
        linear("skew", -0.6, 0.6, 0.0),
    ],
    needs: None,
    action: |v, around| {
        Action::Resistance(Box::new(Bowed { c: v[0], skew: v[1], scale: around.strain_scale }))
    },
};

#[derive(Debug)]
struct Bowed {
    c: f64,
    skew: f64,
    scale: f64,
}

impl Operator for Bowed {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (r, e) in signal.iter_mut().zip(span.strain) {
            *r *= 1.0 + self.c * bow(e / self.scale, self.skew);
        }
    }
}

pub(super) static POT_NONLINEARITY: Form = Form {
    name: "pot_nonlinearity",
    stage: Stage::Reference,
    equation: "L_meas = L + c 4 y (1 - y)(1 + skew (2 y - 1)), y = k/k_max",
    parameters: &[
        EffectParameter::strength("c", "mm", -3.0, 3.0, 0.5),
        linear("skew", -0.6, 0.6, 0.0),
    ],
    needs: None,
    action: |v, around| {
        Action::Length(Box::new(Pot {
            c: v[0],
            skew: v[1],
            zero: around.length_zero,
            span: around.length_span,
        }))
    },
};

#[derive(Debug)]
struct Pot {
    c: f64,
    skew: f64,
    zero: f64,
    span: f64,
}

impl Operator for Pot {
    fn run(&self, _span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for length in signal {
            *length += self.c * bow((*length - self.zero) / self.span, self.skew);
        }
    }

    fn undo(&self, signal: &mut [f64]) {
        // The slope of the bow is a fraction: each round of substitution shrinks the error by it.
        for length in signal {
            let shown = *length;
            for _ in 0..8 {
                *length = shown - self.c * bow((*length - self.zero) / self.span, self.skew);
            }
        }
    }
}

pub(super) static PRESSURE_CROSSTALK: Form = Form {
    name: "pressure_crosstalk",
    stage: Stage::Sensing,
    equation: "e -> e + c x (1 + bend (1 - x)), x = (p - P_atm)/P_ref",
    parameters: &[
        EffectParameter::strength("c", "strain", -0.05, 0.05, 0.01),
        linear("bend", -0.6, 0.6, 0.0),
    ],
    needs: Some("a pressure"),
    action: |v, around| {
        Action::Strain(Box::new(Crosstalk {
            c: v[0],
            bend: v[1],
            scale_kpa: around.pressure_scale_kpa,
        }))
    },
};

#[derive(Debug)]
struct Crosstalk {
    c: f64,
    bend: f64,
    scale_kpa: f64,
}

impl Operator for Crosstalk {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (e, p) in signal.iter_mut().zip(span.pressure_kpa) {
            let x = p / self.scale_kpa;
            *e += self.c * x * (1.0 + self.bend * (1.0 - x));
        }
    }
}

pub(super) static THERMAL_DRIFT: Form = Form {
    name: "thermal_drift",
    stage: Stage::Sensing,
    equation: "R -> R (1 + d settle_s (1 - exp(-t/settle_s))), t since the session began",
    parameters: &[
        EffectParameter::strength("d", "1/s", -4e-4, 4e-4, 5e-5),
        EffectParameter::shape("settle_s", "s", 150.0, 2e4, 3e3),
    ],
    needs: None,
    action: |v, _| Action::Resistance(Box::new(Drift { d: v[0], settle_s: v[1] })),
};

#[derive(Debug)]
struct Drift {
    d: f64,
    settle_s: f64,
}

impl Operator for Drift {
    fn run(&self, span: &Span<'_>, _cells: &mut [f64], signal: &mut [f64]) {
        for (i, r) in signal.iter_mut().enumerate() {
            let t = span.start_s + span.grid.time_s(span.first_node + i);
            *r *= 1.0 - self.d * self.settle_s * (-t / self.settle_s).exp_m1();
        }
    }
}

pub(super) static GAUGE_SOFTENING: Form = Form {
    name: "gauge_softening",
    stage: Stage::Sensing,
    equation: "R - R0 -> (R - R0)(1 - m (1 - (1 + travel/(n power))^(-power)))",
    parameters: &[
        EffectParameter::strength("m", "1", 0.0, 0.3, 0.1),
        EffectParameter::shape("n", "strain", 0.3, 20.0, 2.5),
        EffectParameter::shape("power", "1", 0.4, 20.0, 3.0),
    ],
    needs: None,
    action: |v, around| {
        Action::Resistance(Box::new(Softening {
            m: v[0],
            n: v[1],
            power: v[2],
            r0: around.resistance_zero,
            reversal: 5e-4 * around.strain_unit,
        }))
    },
};

/// Remembers the travel, the strain reached and the direction.
#[derive(Debug)]
struct Softening {
    m: f64,
    n: f64,
    power: f64,
    r0: f64,
    reversal: f64,
}

impl Softening {
    /// Counts a move to the strain `e`; reversals smaller than noise do not travel.
    #[inline]
    fn go(&self, cells: &mut [f64; 3], e: f64) -> bool {
        let moved = e - cells[1];
        let onward = moved * cells[2] > 0.0;
        if onward || moved.abs() > self.reversal {
            cells[0] += moved.abs();
            cells[1] = e;
            if !onward {
                cells[2] = moved.signum();
            }
            return true;
        }
        false
    }

    fn factor(&self, travel: f64) -> f64 {
        let left = (-self.power * (travel / (self.n * self.power)).ln_1p()).exp();
        1.0 - self.m * (1.0 - left)
    }
}

impl Operator for Softening {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        match start {
            Start::Settled => state = [0.0, first, 0.0],
            Start::Carried { .. } | Start::Wound(_) => {
                self.go(&mut state, first);
            }
        }
        cells.copy_from_slice(&state);
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let mut state = [cells[0], cells[1], cells[2]];
        let mut factor = self.factor(state[0]);
        for (r, e) in signal.iter_mut().zip(span.strain) {
            if self.go(&mut state, *e) {
                factor = self.factor(state[0]);
            }
            *r = self.r0 + (*r - self.r0) * factor;
        }
        cells.copy_from_slice(&state);
    }
}

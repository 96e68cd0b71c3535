//! Loops that turn sooner or later: sums of plays whose half-widths are spread.

use stretch_sim::{Action, Backlash, EffectParameter, Operator, Span, Stage, Start, play};

use super::{Form, linear};

/// Half-widths of a play that turns softly: w {1 - spread, 1, 1 + spread}.
fn around(w: f64, spread: f64) -> [f64; 3] {
    [w * (1.0 - spread), w, w * (1.0 + spread)]
}

/// Half-widths of a hysteresis: s {spread^2, spread, 1}.
fn below(s: f64, spread: f64) -> [f64; 3] {
    [s * spread * spread, s * spread, s]
}

pub(super) static SLEEVE_SLIP: Form = Form {
    name: "sleeve_slip",
    stage: Stage::Sensing,
    equation: "e -> mean of play(e, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "strain", 0.0, 0.03, 0.008),
        linear("spread", 0.0, 0.95, 0.3),
    ],
    needs: None,
    action: |v, _| Action::Strain(Box::new(Loop { share: 1.0, radii: around(v[0], v[1]) })),
};

pub(super) static POT_BACKLASH: Form = Form {
    name: "pot_backlash",
    stage: Stage::Reference,
    equation: "L_meas = mean of play(L, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "mm", 0.0, 2.0, 0.3),
        linear("spread", 0.0, 0.95, 0.3),
    ],
    needs: None,
    action: |v, _| Action::Length(Box::new(Loop { share: 1.0, radii: around(v[0], v[1]) })),
};

pub(super) static MUSCLE_HYSTERESIS: Form = Form {
    name: "muscle_hysteresis",
    stage: Stage::Muscle,
    equation: "k_s -> k_s - h mean of (k_s - play(k_s, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        linear("spread", 0.15, 0.95, 0.5),
    ],
    needs: None,
    action: |v, _| {
        Action::StaticContraction(Box::new(Loop { share: v[0], radii: below(v[1], v[2]) }))
    },
};

pub(super) static GAUGE_HYSTERESIS: Form = Form {
    name: "gauge_hysteresis",
    stage: Stage::Sensing,
    equation: "e -> e - h mean of (e - play(e, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        linear("spread", 0.15, 0.95, 0.5),
    ],
    needs: None,
    action: |v, _| Action::Strain(Box::new(Loop { share: v[0], radii: below(v[1], v[2]) })),
};

/// x - share mean of (x - play(x, r)).
#[derive(Debug)]
struct Loop {
    share: f64,
    radii: [f64; 3],
}

impl Operator for Loop {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (z, r) in cells.iter_mut().zip(self.radii) {
            *z = match start {
                Start::Settled => first,
                Start::Carried { .. } => play(*z, first, r),
                Start::Wound(share) => first - share.clamp(-1.0, 1.0) * r,
            };
        }
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut a, mut b, mut c] = [cells[0], cells[1], cells[2]];
        let [ra, rb, rc] = self.radii;
        let share = self.share / 3.0;
        for x in signal {
            a = play(a, *x, ra);
            b = play(b, *x, rb);
            c = play(c, *x, rc);
            *x -= share * ((*x - a) + (*x - b) + (*x - c));
        }
        cells.copy_from_slice(&[a, b, c]);
    }

    fn undo(&self, signal: &mut [f64]) {
        // A whole play hides its input at its turns only; of a share of one nothing is hidden.
        if self.share == 1.0 {
            Backlash::hard(self.radii[1]).undo(signal);
        }
    }
}

//! Play: a part that follows once its backlash is used up.

use alloc::{boxed::Box, vec};

use stretch_core::{Plays, play};

use crate::{
    effect::{Acts, Effect, each},
    kind::{Family, Kind, Side},
    live::Live,
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::Place,
    play_start::play_start,
    prandtl_ishlinskii::PrandtlIshlinskii,
    rig_stage::RigStage,
    sketch::Sketch,
    unplay::unplay,
};

/// Backlash as an operator: y = play(x, w), or the mean of play(x, w {1 - spread, 1, 1 + spread}), which turns softly.
///
/// [`Operator::undo`] hands back an input that would have made a recorded output: exact while the output moves, led over
/// linearly while it dwells (of a soft one, as if it were hard).
///
/// ```
/// use stretch_effects::{Backlash, Grid, Operator, Span, Start};
/// let slip = Backlash::hard(1.0);
/// let (mut cells, mut signal) = ([0.0], [0.0, 0.5, 3.0, 2.5]);
/// slip.begin(Start::Settled, signal[0], &mut cells);
/// slip.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// assert_eq!(signal, [0.0, 0.0, 2.0, 2.0]);
/// assert_eq!(Backlash::soft(1.0, 0.3).cells(), 3);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Backlash {
    w: f64,
    /// A mean of plays is a Prandtl-Ishlinskii operator of share 1.
    soft: Option<PrandtlIshlinskii>,
}

impl Backlash {
    /// One play of half-width `w`, in the unit of the signal.
    pub fn hard(w: f64) -> Self {
        Self { w, soft: None }
    }

    /// Three plays around the half-width `w`, from `1 - spread` to `1 + spread` of it; hard at a spread of 0.
    pub fn soft(w: f64, spread: f64) -> Self {
        let radii = [w * (1.0 - spread), w, w * (1.0 + spread)];
        Self { w, soft: (spread != 0.0).then(|| PrandtlIshlinskii::of_radii(1.0, radii)) }
    }
}

impl Operator for Backlash {
    fn cells(&self) -> usize {
        self.soft.map_or(1, |soft| soft.cells())
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        match &self.soft {
            Some(soft) => soft.begin(start, first, cells),
            None => cells[0] = play_start(start, cells[0], first, self.w),
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if let Some(soft) = &self.soft {
            return soft.run(span, cells, signal);
        }
        let mut z = cells[0];
        for x in signal {
            z = play(z, *x, self.w);
            *x = z;
        }
        cells[0] = z;
    }

    fn undo(&self, signal: &mut [f64]) {
        unplay(self.w, signal);
    }
}

/// Play of a half-width, or three around it.
pub static BACKLASH: Kind = Kind {
    name: "backlash",
    title: "backlash",
    words: "it has play: it follows once a gap is taken up",
    equation: "y = mean of play(x, w {1 - softness, 1, 1 + softness})",
    usual: &[Side::Input, Side::Output],
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("w", unit, 0.0..=0.5 * e.span()),
            EffectParameter::formed("softness", "1", 0.0..=0.6, 0.2),
        ]
    },
    starts: Some(|e| [0.005, 0.03, 0.1, 0.3].map(|k| vec![k * e.span(), 0.2]).into()),
    operator: |v, _, _| Box::new(Backlash::soft(v[0], v[1])),
    sketch: Some(|v, _, signals| {
        let unit = signals.x.unit.clone();
        let body = "let ra = W * (1 - SPREAD)
            let rc = W * (1 + SPREAD)
            s.a = max(x - ra, min(x + ra, s.a))
            s.b = max(x - W, min(x + W, s.b))
            s.c = max(x - rc, min(x + rc, s.c))
            let y = (s.a + s.b + s.c) / 3";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[("W", v[0], &unit), ("SPREAD", v[1], "1")])
            .remembering(["a", "b", "c"])
    }),
    twins: &["hysteresis", "bouc_wen", "dead_zone", "firmware_dead_band"],
    family: Some((Family::Loop, |v| v[0])),
    hides_input: true,
    ..Kind::PLAIN
};

/// The sleeve slips on the muscle.
pub(crate) static SLEEVE_SLIP: Effect = Effect {
    name: "sleeve_slip",
    title: "the sleeve's slip",
    words: "the sleeve slips on the muscle before it follows",
    equation: "e -> mean of play(e, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "strain", 0.0, 0.03, 0.008),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    acts: Acts::at(&BACKLASH, Place::Strain),
    twins: &["gauge_hysteresis", "pot_backlash"],
    starts: Some(|_| each([0.0005, 0.002, 0.01])),
    live: Some(Live {
        parameters: &[
            EffectParameter::shape("w", "1", 1e-4, 0.3, 0.02),
            EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.3, usual: 0.3 }),
        ],
        set: |v, _, map| {
            let radii = [v[0] * (1.0 - v[1]), v[0], v[0] * (1.0 + v[1])];
            map.slip = Some(Plays { share: 1.0, radii });
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// The potentiometer has backlash. A diagnosed calibration undoes it in the reference that it is fitted to.
pub(crate) static POT_BACKLASH: Effect = Effect {
    name: "pot_backlash",
    title: "the potentiometer's backlash",
    words: "the potentiometer has backlash",
    stage: RigStage::Reference,
    equation: "L_meas = mean of play(L, w {1 - spread, 1, 1 + spread})",
    parameters: &[
        EffectParameter::strength("w", "mm", 0.0, 2.0, 0.3),
        EffectParameter::form("spread", "1", 0.0, 0.95, Form { neutral: 0.0, usual: 0.3 }),
    ],
    acts: Acts::at(&BACKLASH, Place::Length),
    twins: &["sleeve_slip"],
    starts: Some(|_| each([0.05, 0.2, 0.8])),
    live: Some(Live {
        parameters: &[EffectParameter::shape("w", "1", 1e-4, 0.2, 0.01)],
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

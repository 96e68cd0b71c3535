//! Hysteresis: the loops of Prandtl and Ishlinskii, and the smooth loop of Bouc and Wen.

use alloc::{boxed::Box, vec};

use stretch_core::{Plays, arithmetic::play};

use crate::{
    effect::{Acts, Effect, Live, pairs},
    kind::{Family, Kind, Side},
    operator::{Operator, Span, Start},
    parameter::{EffectParameter, Form},
    place::Place,
    sketch::Sketch,
};

/// The numbers of a [`PrandtlIshlinskii`] operator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loops {
    /// Share of a small move that is held back.
    pub h: f64,
    /// Largest half-width, in the unit of the signal.
    pub s: f64,
    /// Ratio of each half-width to the next larger one.
    pub spread: f64,
}

/// Rate-independent hysteresis: y = x - h mean of (x - play(x, r)), r = s {spread^2, spread, 1}. Here play(x, r) is x
/// behind a play (backlash) of half-width r, and the mean is taken over the three half-widths.
///
/// Source: Kuhnen 2003, doi:10.3166/ejc.9.407-418.
///
/// ```
/// use stretch_effects::{Grid, Loops, Operator, PrandtlIshlinskii, Span, Start};
/// let gauge = PrandtlIshlinskii::new(Loops { h: 0.3, s: 0.4, spread: 0.5 });
/// let (mut cells, mut signal) = ([0.0; 3], [0.0, 1.0, 0.0]);
/// gauge.begin(Start::Settled, signal[0], &mut cells);
/// gauge.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// // Rising it is h mean(r) behind, falling as much ahead: mean(r) = (0.1 + 0.2 + 0.4)/3.
/// assert!((signal[1] - (1.0 - 0.07)).abs() < 1e-15 && (signal[2] - 0.07).abs() < 1e-15);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrandtlIshlinskii {
    h: f64,
    radii: [f64; 3],
}

impl PrandtlIshlinskii {
    /// An operator with a share, a largest half-width and a spread.
    pub fn new(loops: Loops) -> Self {
        let Loops { h, s, spread } = loops;
        Self::of_radii(h, [s * spread * spread, s * spread, s])
    }

    pub(crate) fn of_radii(h: f64, radii: [f64; 3]) -> Self {
        Self { h, radii }
    }
}

impl Operator for PrandtlIshlinskii {
    fn cells(&self) -> usize {
        3
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        for (z, r) in cells.iter_mut().zip(self.radii) {
            *z = start.of_play(*z, first, r);
        }
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut a, mut b, mut c] = [cells[0], cells[1], cells[2]];
        let share = self.h / 3.0;
        for x in signal {
            a = play(a, *x, self.radii[0]);
            b = play(b, *x, self.radii[1]);
            c = play(c, *x, self.radii[2]);
            *x -= share * ((*x - a) + (*x - b) + (*x - c));
        }
        cells.copy_from_slice(&[a, b, c]);
    }
}

/// Hysteresis of three plays.
pub static HYSTERESIS: Kind = Kind {
    name: "hysteresis",
    title: "hysteresis",
    words: "it takes another path on the way back (Prandtl-Ishlinskii)",
    equation: "y = x - h mean of (x - play(x, s {spread^2, spread, 1}))",
    usual: &[Side::Output],
    parameters: |e, unit| {
        vec![
            EffectParameter::sized("h", "1", 0.0..=0.6),
            EffectParameter::shaped("s", unit, 0.01 * e.span()..=0.5 * e.span()),
            EffectParameter::formed("spread", "1", 0.15..=0.95, 0.5),
        ]
    },
    operator: |v, _, _| Box::new(PrandtlIshlinskii::new(Loops { h: v[0], s: v[1], spread: v[2] })),
    sketch: Some(|v, _, signals| {
        let unit = signals.x.unit.clone();
        let body = "let rb = S * SPREAD
            let ra = rb * SPREAD
            s.a = max(x - ra, min(x + ra, s.a))
            s.b = max(x - rb, min(x + rb, s.b))
            s.c = max(x - S, min(x + S, s.c))
            let y = x - H * (x - (s.a + s.b + s.c) / 3)";
        Sketch::of(signals.x.clone(), body)
            .with_all(&[("H", v[0], "1"), ("S", v[1], &unit), ("SPREAD", v[2], "1")])
            .remembering(["a", "b", "c"])
    }),
    twins: &["backlash", "bouc_wen"],
    family: Some((Family::Loop, |v| v[0] * v[1] * (1.0 + v[2] + v[2] * v[2]) / 3.0)),
    ..Kind::PLAIN
};

/// Hysteresis of the gauge.
pub(crate) static GAUGE_HYSTERESIS: Effect = Effect {
    name: "gauge_hysteresis",
    title: "the gauge's hysteresis",
    words: "the gauge follows another path on the way back",
    equation: "e -> e - h mean of (e - play(e, s {spread^2, spread, 1}))",
    parameters: &[
        EffectParameter::strength("h", "1", 0.0, 0.6, 0.2),
        EffectParameter::shape("s", "strain", 0.005, 0.06, 0.02),
        EffectParameter::form("spread", "1", 0.15, 0.95, Form { neutral: 0.5, usual: 0.5 }),
    ],
    acts: Acts::at(&HYSTERESIS, Place::Strain),
    twins: &["sleeve_slip"],
    starts: Some(|_| pairs(0.1, [0.006, 0.016, 0.045])),
    live: Some(Live {
        parameters: &[
            EffectParameter::strength("h", "1", 0.0, 0.9, 0.1),
            EffectParameter::shape("s", "1", 0.003, 0.9, 0.1),
            EffectParameter::form("spread", "1", 0.1, 0.98, Form { neutral: 0.5, usual: 0.5 }),
        ],
        set: |v, _, map| {
            let (share, radii) = (v[0], [v[1] * v[2] * v[2], v[1] * v[2], v[1]]);
            map.hysteresis = Some(Plays { share, radii });
        },
        ..Live::BY_CURVE
    }),
    ..Effect::PLAIN
};

/// A smooth rate-independent loop: y = x - c u. The state u lies between -1 and 1 and follows the moves of the signal:
///
/// ```text
/// du = dx/s (1 - |u|) where u and dx have one sign, else dx/s
/// ```
///
/// This is the model of Bouc and Wen with an exponent of 1 and beta = gamma. Each move is solved exactly. The memory is
/// u and x.
///
/// Source: Wen 1976, Journal of the Engineering Mechanics Division 102(2), 249-263.
///
/// ```
/// use stretch_effects::{BoucWen, Grid, Operator, Span, Start};
/// let gear = BoucWen { c: 0.1, s: 0.5 };
/// let (mut cells, mut signal) = ([0.0; 2], [0.0, 20.0, 19.5, 0.0]);
/// gear.begin(Start::Settled, signal[0], &mut cells);
/// gear.run(&Span::whole(&Grid::samples(0.01)?), &mut cells, &mut signal);
/// // On a long way up it is c behind, halfway back by s it is where it should be, then c ahead.
/// assert!((signal[1] - 19.9).abs() < 1e-12 && (signal[2] - 19.5).abs() < 1e-12);
/// assert!((signal[3] - 0.1).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoucWen {
    /// Lag of the output after a long move, in the unit of the signal.
    pub c: f64,
    /// Distance over which 1 - 1/e of that lag builds up, in the unit of the signal, above 0.
    pub s: f64,
}

impl Operator for BoucWen {
    fn cells(&self) -> usize {
        2
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        match start {
            Start::Settled => cells[0] = 0.0,
            Start::Hysteresis(share) => cells[0] = share.clamp(-1.0, 1.0),
            Start::Carried { .. } => cells[0] = self.moved(cells[0], first - cells[1]),
        }
        cells[1] = first;
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut u, mut last] = [cells[0], cells[1]];
        for x in signal {
            u = self.moved(u, *x - last);
            last = *x;
            *x -= self.c * u;
        }
        cells.copy_from_slice(&[u, last]);
    }
}

impl BoucWen {
    /// Returns the state after a move: linear back to zero, and from there exponential towards 1.
    fn moved(&self, u: f64, dx: f64) -> f64 {
        let way = dx.abs() / self.s;
        let along = if dx < 0.0 { -u } else { u };
        let along = match along < 0.0 {
            true if way <= -along => along + way,
            true => -libm::expm1(-(way + along)),
            false => 1.0 - (1.0 - along) * libm::exp(-way),
        };
        if dx < 0.0 { -along } else { along }
    }
}

/// Hysteresis with smooth reversals.
pub static BOUC_WEN: Kind = Kind {
    name: "bouc_wen",
    title: "smooth hysteresis",
    words: "it turns back on a smooth loop (Bouc-Wen)",
    equation: "y = x - c u, du = dx/s (1 - u sign(dx)) where u dx > 0, else dx/s",
    usual: &[Side::Output],
    parameters: |e, unit| {
        let most = 0.15 * e.span();
        vec![
            EffectParameter::sized("c", unit, -most..=most),
            EffectParameter::shaped("s", unit, 0.01 * e.span()..=0.5 * e.span()),
        ]
    },
    operator: |v, _, _| Box::new(BoucWen { c: v[0], s: v[1] }),
    sketch: Some(|v, _, signals| {
        let body = "let dx = x - s.last
            let way = abs(dx) / S
            var along = s.u
            if dx < 0
            along = -s.u
            end
            if along >= 0
            along = 1 - (1 - along) * exp(-way)
            else
            if way <= -along
            along = along + way
            else
            along = -expm1(-(way + along))
            end
            end
            s.u = along
            if dx < 0
            s.u = -along
            end
            s.last = x
            let y = x - C * s.u";
        let unit = &*signals.x.unit;
        Sketch::of(signals.x.clone(), body)
            .with_all(&[("C", v[0], unit), ("S", v[1], unit)])
            .remembering(["last"])
            .cells(["u"], "1", "0")
    }),
    twins: &["backlash", "hysteresis"],
    family: Some((Family::Loop, |v| v[0])),
    ..Kind::PLAIN
};

//! Bouc-Wen hysteresis.

use alloc::{boxed::Box, vec};

use crate::{
    kind::{Family, Kind, Side},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// A smooth loop without a rate: y = x - c u, with a state u between -1 and 1 that follows the moves of the signal,
///
/// ```text
/// du = dx/s (1 - |u|) where u and dx have one sign, else dx/s
/// ```
///
/// which is the model of Bouc and Wen with an exponent of 1 and beta = gamma, solved exactly for each move. Remembers u and x.
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
    /// How far it stays behind, in the unit of the signal.
    pub c: f64,
    /// Way after which most of that is reached, in the unit of the signal, above 0.
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
    /// The state after a move: back to zero on a straight line, from there on towards 1 as an exponential.
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

/// Hysteresis that turns smoothly.
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

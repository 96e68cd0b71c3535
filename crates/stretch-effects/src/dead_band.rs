//! A dead band of commands.

use crate::operator::{Operator, Span, Start};

/// Share of an opening at which a valve is barely open.
const BARELY: f64 = 1e-12;

/// A valve that stays shut up to a least command.
///
/// u -> max(0, (u - d(u))/(1 - d(1))), d(u) = u_db (1 - exp(-u/(u_db softness))), which is u_db at a softness of 0. The
/// conductance that comes of it, least + (1 - least) u, is multiplied by 1 - exp(-u/(u_db gate)), by 1 at a gate of 0; less
/// than the least conductance passes as pulses of it, a share of the samples, evenly spread. Remembers the pulses owed.
///
/// ```
/// use stretch_effects::{DeadBand, Grid, Operator, Span, Start};
/// let grid = Grid::samples(0.01)?;
/// let taken = |valve: DeadBand, commands: &[f64]| {
///     let (mut cells, mut openings) = ([0.0], commands.to_vec());
///     valve.begin(Start::Settled, commands[0], &mut cells);
///     valve.run(&Span::whole(&grid), &mut cells, &mut openings);
///     openings
/// };
/// let hard = DeadBand { u_db: 0.25, softness: 0.0, gate: 0.0, least: 0.02 };
/// assert_eq!(taken(hard, &[0.0, 0.1, 0.625, 1.0]), [0.0, 0.0, 0.5, 1.0]);
/// // A gate that lets a quarter of the least conductance pass is open a quarter of the time.
/// let gated = DeadBand { u_db: 0.01, softness: 1.5, gate: 0.9, least: 0.02 };
/// let open = taken(gated, &[0.0025; 1000]).iter().filter(|u| **u > 0.0).count();
/// assert!((200..320).contains(&open));
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadBand {
    /// Command that opens nothing yet.
    pub u_db: f64,
    /// How gradually the band is left, in units of it; 0 for at once.
    pub softness: f64,
    /// How gradually the conductance rises above the band, in units of it; 0 for at once.
    pub gate: f64,
    /// Share of the conductance of a barely open valve.
    pub least: f64,
}

impl DeadBand {
    /// The command less the band.
    fn shifted(&self, u: f64) -> f64 {
        if self.softness == 0.0 {
            return ((u - self.u_db) / (1.0 - self.u_db)).max(0.0);
        }
        let band = |u: f64| -self.u_db * libm::expm1(-u / (self.u_db * self.softness));
        ((u - band(u)) / (1.0 - band(1.0))).max(0.0)
    }
}

impl Operator for DeadBand {
    fn cells(&self) -> usize {
        1
    }

    fn begin(&self, _start: Start, _first: f64, cells: &mut [f64]) {
        cells[0] = 0.0;
    }

    fn run(&self, _span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        if self.u_db <= 0.0 {
            return;
        }
        let (owed, least) = (&mut cells[0], self.least);
        for opening in signal {
            let u = *opening;
            *opening = if u > 0.0 { self.shifted(u) } else { 0.0 };
            if self.gate == 0.0 || *opening <= 0.0 {
                continue;
            }
            let passed = -libm::expm1(-u / (self.u_db * self.gate));
            let share = (least + (1.0 - least) * *opening) * passed;
            if share >= least {
                *opening = ((share - least) / (1.0 - least)).min(1.0);
                continue;
            }
            *owed += share / least;
            let pulse = *owed >= 1.0;
            *owed -= f64::from(u8::from(pulse));
            *opening = if pulse { BARELY } else { 0.0 };
        }
    }
}

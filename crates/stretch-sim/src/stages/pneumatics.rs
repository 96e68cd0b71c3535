//! Stage `pneumatics`: openings of the valves to chamber pressure.

use stretch_effects::{Action, Droop, Grid, Law, RigStage, Row, Span, Start};

use super::{Memory, Openings, check_length};
use crate::{
    SimError,
    effects::EffectSet,
    params::{Key, RigParams},
};

/// A step longer than this many time constants of the pressure is too long for the Runge-Kutta
/// rule.
const STIFF: f64 = 2.0;
/// Largest number of effects that may draw on the supply at once.
const MOST_DROOPS: usize = 2;

/// Valves and chamber, prepared to run: ISO 6358 flow into and out of an isothermal chamber.
///
/// The classical Runge-Kutta rule advances the mass in the chamber. A step that would overshoot the equilibrium ends on
/// the equilibrium. The real state never overshoots, because the flow through a valve vanishes like the square root of
/// the pressure difference. With `chamber_volume` on, the pressure depends on the contraction: run
/// [`Actuation`](crate::Actuation), or pass the measured length to [`run_with_length`](Self::run_with_length).
#[derive(Debug)]
pub struct Pneumatics {
    grid: Grid,
    supply_pa: f64,
    atmosphere_pa: f64,
    /// R T / V0, Pa/kg.
    chamber: f64,
    /// C rho0 of inlet and outlet, kg/(s Pa).
    conductance: [f64; 2],
    critical: f64,
    per_subsonic: f64,
    least: f64,
    /// Effects of inlet and outlet on their commands.
    commands: [Row; 2],
    leaks: Vec<Box<dyn Law>>,
    volumes: Vec<Box<dyn Law>>,
    /// The first effect that makes the volume follow the muscle.
    coupled_by: Option<&'static str>,
    droops: Vec<Box<dyn Droop>>,
    length_zero_mm: f64,
    length_span_mm: f64,
}

/// State of the chamber and the supply: p V / V0 (Pa), and the droops (losses of supply pressure).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Chamber {
    pub(crate) held: f64,
    pub(crate) droops: [f64; MOST_DROOPS],
}

/// Flow conductances while openings are constant, kg/(s Pa).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Valves {
    inlet: f64,
    outlet: f64,
}

impl Pneumatics {
    const CELLS: usize = 1 + MOST_DROOPS;

    /// Prepares the stage for trials on `grid`, which must come from [`EffectSet::grid`] with the same effects.
    ///
    /// # Errors
    /// More than two effects that draw on the supply, a grid made for another valve delay.
    pub fn new(params: &RigParams, effects: &EffectSet, grid: &Grid) -> Result<Self, SimError> {
        let around = params.surroundings(grid);
        let [mut leaks, mut volumes] = [const { Vec::new() }; 2];
        let [mut inlet, mut outlet] = [const { Vec::new() }; 2];
        let mut droops: Vec<Box<dyn Droop>> = Vec::new();
        let (mut delay_s, mut coupled_by) = (0.0, None);
        for active in effects.acting_in(RigStage::Pneumatics) {
            match active.action(&around) {
                Action::Delay(seconds) => delay_s += seconds,
                Action::Commands([of_inlet, of_outlet]) => {
                    inlet.push(of_inlet);
                    outlet.push(of_outlet);
                }
                Action::Leak(law) => leaks.push(law),
                Action::Volume(law) => {
                    coupled_by = coupled_by.or(Some(active.name()));
                    volumes.push(law);
                }
                Action::Droop(_) if droops.len() == MOST_DROOPS => {
                    return Err(SimError::not_here(
                        active.name(),
                        "a supply on which more than two effects act",
                    ));
                }
                Action::Droop(droop) => droops.push(droop),
                _ => {}
            }
        }
        if delay_s != grid.delay_s() {
            return Err(SimError::Refused(format!(
                "the time grid was made for a valve delay of {} s, but the effects have a delay of {delay_s} s",
                grid.delay_s()
            )));
        }
        let inlet = Row::new(inlet, Self::CELLS);
        let outlet = Row::new(outlet, inlet.end());
        let b = params[Key::B];
        Ok(Self {
            grid: grid.clone(),
            supply_pa: params[Key::PS] + params[Key::PAtm],
            atmosphere_pa: params[Key::PAtm],
            chamber: params[Key::RAir] * params[Key::T] / params[Key::V0],
            conductance: [Key::CIn, Key::COut].map(|c| params[c] * params[Key::Rho0]),
            critical: b,
            per_subsonic: 1.0 / (1.0 - b),
            least: params[Key::UMin],
            commands: [inlet, outlet],
            leaks,
            volumes,
            coupled_by,
            droops,
            length_zero_mm: params[Key::L0],
            length_span_mm: -params[Key::L0] * params[Key::KMax],
        })
    }

    /// Creates a memory for this stage.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.end())
    }

    /// Index of the first cell (state) after those of this stage.
    pub(crate) fn end(&self) -> usize {
        self.commands[1].end()
    }

    /// The time steps.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether the pressure depends on the contraction.
    pub fn is_coupled(&self) -> bool {
        self.coupled_by.is_some()
    }

    /// Computes the gauge pressure in kPa at every sample, from `initial_kpa` at the first.
    ///
    /// # Errors
    /// Openings outside 0..1, slices of different lengths, an initial pressure below vacuum or not finite, or a
    /// chamber whose volume depends on the contraction (see [`run_with_length`](Self::run_with_length)).
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        pressure_kpa: &mut [f64],
    ) -> Result<(), SimError> {
        self.check_uncoupled()?;
        self.run_sampled(memory, start, openings, None, initial_kpa, pressure_kpa)
    }

    /// Refuses a chamber whose volume depends on the contraction.
    pub(crate) fn check_uncoupled(&self) -> Result<(), SimError> {
        match self.coupled_by {
            None => Ok(()),
            Some(name) => Err(SimError::not_here(name, "the length of the muscle")),
        }
    }

    /// Like [`run`](Self::run), but the chamber's volume follows a measured length (mm, linear between samples).
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn run_with_length(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        length_mm: &[f64],
        initial_kpa: f64,
        pressure_kpa: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("length_mm", openings.inlet.len(), length_mm.len())?;
        self.run_sampled(memory, start, openings, Some(length_mm), initial_kpa, pressure_kpa)
    }

    fn run_sampled(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        length_mm: Option<&[f64]>,
        initial_kpa: f64,
        pressure_kpa: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("pressure_kpa", openings.check()?, pressure_kpa.len())?;
        let Some(last) = pressure_kpa.len().checked_sub(1) else { return Ok(()) };
        let length_mm = length_mm.filter(|_| self.is_coupled());
        let at = |sample: usize, share: f64| {
            length_mm.map_or(1.0, |l| {
                let a = l[sample];
                let b = l[(sample + 1).min(last)];
                self.volume((a + share * (b - a) - self.length_zero_mm) / self.length_span_mm)
            })
        };
        let mut volume = at(0, 0.0);
        self.taking(memory, start, openings, |cells, start, openings| {
            let mut chamber = self.begin(start, initial_kpa, volume, cells)?;
            pressure_kpa[0] = initial_kpa;
            let mut drive = Drive::new(self, openings);
            for sample in 0..last {
                let mut through = 0.0;
                for (piece, h) in self.grid.steps().iter().enumerate() {
                    through += h;
                    let valves = drive.valves(sample, piece);
                    let next = at(sample, through / self.grid.dt_s());
                    self.advance(valves, &mut chamber, [volume, next], *h);
                    volume = next;
                }
                pressure_kpa[sample + 1] = self.pressure_kpa(chamber.held, volume);
            }
            self.remember(&chamber, cells);
            Ok(())
        })
    }

    /// V/V0 at y = k/k_max.
    #[inline]
    pub(crate) fn volume(&self, y: f64) -> f64 {
        // Avoids a division by zero if the chamber has collapsed.
        self.volumes.iter().fold(1.0, |v, law| v * law.at(y)).max(0.05)
    }

    /// Gauge pressure, kPa.
    #[inline]
    pub(crate) fn pressure_kpa(&self, held: f64, volume: f64) -> f64 {
        1e-3 * (held / volume - self.atmosphere_pa)
    }

    /// Begins a trial; its state is in the first cells of a memory.
    pub(crate) fn begin(
        &self,
        start: Start,
        initial_kpa: f64,
        volume: f64,
        cells: &mut [f64],
    ) -> Result<Chamber, SimError> {
        let absolute = 1e3 * initial_kpa + self.atmosphere_pa;
        if !(absolute.is_finite() && absolute > 0.0) {
            return Err(SimError::not_positive("initial pressure, Pa absolute", absolute));
        }
        let mut droops = [0.0; MOST_DROOPS];
        if let Start::Carried { rest_s } = start {
            for ((y, law), cell) in droops.iter_mut().zip(&self.droops).zip(&cells[1..]) {
                *y = law.relaxed(*cell, rest_s);
            }
        }
        Ok(Chamber { held: absolute * volume, droops })
    }

    /// Stores the state at the end of a trial.
    pub(crate) fn remember(&self, chamber: &Chamber, cells: &mut [f64]) {
        cells[0] = chamber.held;
        cells[1..=MOST_DROOPS].copy_from_slice(&chamber.droops);
    }

    /// Runs a trial with the openings after the effects on the valve commands.
    pub(crate) fn taking<T>(
        &self,
        memory: &mut Memory,
        start: Start,
        commanded: Openings<'_>,
        run: impl FnOnce(&mut [f64], Start, Openings<'_>) -> T,
    ) -> T {
        let start = memory.start(start);
        let taken = self.taken(memory, start, commanded);
        let openings = match &taken {
            Some([inlet, outlet]) => Openings { inlet, outlet },
            None => commanded,
        };
        let done = run(&mut memory.cells, start, openings);
        memory.commands = taken.unwrap_or_default();
        done
    }

    /// Returns the openings after the effects on the valve commands, in buffers of the memory; `None` if no effect acts
    /// on the commands.
    fn taken(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
    ) -> Option<[Vec<f64>; 2]> {
        let first = [openings.inlet.first()?, openings.outlet.first()?];
        if self.commands.iter().all(Row::is_empty) {
            return None;
        }
        let mut taken = std::mem::take(&mut memory.commands);
        let span = Span::whole(&self.grid);
        for (side, given) in [openings.inlet, openings.outlet].into_iter().enumerate() {
            let (row, own) = (&self.commands[side], &mut taken[side]);
            own.clear();
            own.extend_from_slice(given);
            row.begin_at(start, *first[side], &mut memory.cells);
            row.run(&span, &mut memory.cells, own);
        }
        Some(taken)
    }

    fn conductance(&self, side: usize, opening: f64) -> f64 {
        let u = opening.clamp(0.0, 1.0);
        if u > 0.0 { self.conductance[side] * (self.least + (1.0 - self.least) * u) } else { 0.0 }
    }

    /// psi of ISO 6358.
    #[inline]
    fn subsonic(&self, ratio: f64) -> f64 {
        if ratio <= self.critical {
            1.0
        } else if ratio < 1.0 {
            let z = (ratio - self.critical) * self.per_subsonic;
            (1.0 - z * z).sqrt()
        } else {
            0.0
        }
    }

    /// Returns the inflow and the net flow, kg/s, at absolute pressures.
    #[inline]
    fn flows(&self, valves: Valves, p: f64, supply: f64) -> (f64, f64) {
        let mut inflow = 0.0;
        if valves.inlet > 0.0 && p < supply {
            inflow = valves.inlet * supply * self.subsonic(p / supply);
        }
        let mut net = inflow;
        if valves.outlet > 0.0 && p > self.atmosphere_pa {
            net -= valves.outlet * p * self.subsonic(self.atmosphere_pa / p);
        }
        for leak in &self.leaks {
            net -= leak.at(p - self.atmosphere_pa);
        }
        (inflow, net)
    }

    /// Advances by one step of length `h` with constant openings. The volume is linear between the two given values.
    #[inline]
    pub(crate) fn advance(&self, valves: Valves, chamber: &mut Chamber, volume: [f64; 2], h: f64) {
        let still = valves.inlet == 0.0 && valves.outlet == 0.0;
        if still && self.leaks.is_empty() {
            for (y, law) in chamber.droops.iter_mut().zip(&self.droops) {
                *y = law.relaxed(*y, h);
            }
        } else if self.droops.is_empty() {
            self.step::<0>(valves, chamber, volume, h);
        } else {
            self.step::<MOST_DROOPS>(valves, chamber, volume, h);
        }
    }

    /// Advances the chamber's state and the first `D` droops by the classical Runge-Kutta rule.
    #[inline]
    fn step<const D: usize>(
        &self,
        valves: Valves,
        chamber: &mut Chamber,
        volume: [f64; 2],
        h: f64,
    ) {
        let supply = |droops: &[f64; D]| (self.supply_pa - droops.iter().sum::<f64>()).max(0.0);
        let rate = |held: f64, droops: &[f64; D], volume: f64| {
            let (inflow, net) = self.flows(valves, held / volume, supply(droops));
            let mut fall = [0.0; D];
            for ((f, y), law) in fall.iter_mut().zip(droops).zip(&self.droops) {
                *f = law.rate(*y, inflow);
            }
            (self.chamber * net, fall)
        };
        let from = |droops: &[f64; D], fall: &[f64; D], t: f64| -> [f64; D] {
            std::array::from_fn(|i| droops[i] + t * fall[i])
        };
        let held = chamber.held;
        let mut y = [0.0; D];
        for (y, droop) in y.iter_mut().zip(chamber.droops) {
            *y = droop;
        }
        let middle = 0.5 * (volume[0] + volume[1]);
        let (k1, f1) = rate(held, &y, volume[0]);
        if D == 0 && volume[0] == volume[1] && k1.abs() * h <= 1e-13 * held {
            return;
        }
        let (k2, f2) = rate(held + 0.5 * h * k1, &from(&y, &f1, 0.5 * h), middle);
        let (k3, f3) = rate(held + 0.5 * h * k2, &from(&y, &f2, 0.5 * h), middle);
        let (k4, f4) = rate(held + h * k3, &from(&y, &f3, h), volume[1]);
        let mut next = held + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        for i in 0..D {
            y[i] += h / 6.0 * (f1[i] + 2.0 * (f2[i] + f3[i]) + f4[i]);
        }
        // The chamber's pressure cannot pass the pressure that drives the flow.
        let (high, low) = (supply(&y) * volume[1], self.atmosphere_pa * volume[1]);
        let full = next > held && next > high;
        let empty = next < held && next < low;
        if full {
            next = held.max(high);
        } else if empty {
            next = held.min(low);
        }
        // The state cannot pass its equilibrium either. A step ends on the equilibrium if it was too long for a
        // stiff state, or if it was shortened while another flow continues.
        if k1 * k4 < 0.0 || full || empty {
            let (end, _) = rate(next, &y, volume[1]);
            let stiff = k1 * end < 0.0 && h * (end - k1).abs() > STIFF * (next - held).abs();
            let cut = (full && end < 0.0) || (empty && end > 0.0);
            if stiff || cut {
                let from = match k1 * end < 0.0 {
                    true => held,
                    false if full => low,
                    false => high,
                };
                next = balance(from, next, -end, |m| rate(m, &y, volume[1]).0);
            }
            if D > 0 && (stiff || full) {
                next = self.settle::<D>(valves, chamber, [held, next], volume[1], h);
                return chamber.held = next;
            }
        }
        chamber.droops[..D].copy_from_slice(&y);
        chamber.held = next;
    }

    /// Ends a step in which the chamber follows a recovering supply. The chamber ends in equilibrium with the supply,
    /// and the mean flow follows from the mass gained. An iteration finds the common pressure.
    #[cold]
    fn settle<const D: usize>(
        &self,
        valves: Valves,
        chamber: &mut Chamber,
        [held, guess]: [f64; 2],
        volume: f64,
        h: f64,
    ) -> f64 {
        let before = chamber.droops;
        let mut next = guess;
        // Each round multiplies the error by about r/(R T/V0)/tau, which is a quarter for the strongest effect of the
        // catalogue.
        for _ in 0..24 {
            let droop: f64 = chamber.droops[..D].iter().sum();
            let supply = (self.supply_pa - droop).max(0.0);
            let (inflow, net) = self.flows(valves, next / volume, supply);
            let mean = (next - held) / (h * self.chamber) + (inflow - net);
            for ((y, last), law) in chamber.droops.iter_mut().zip(before).zip(&self.droops) {
                *y = last + h * law.rate(0.5 * (last + *y), mean.max(0.0));
            }
            let supply = (self.supply_pa - chamber.droops[..D].iter().sum::<f64>()).max(0.0);
            let (low, high) = (self.atmosphere_pa.min(supply) * volume, supply * volume);
            let rate = |m: f64| self.flows(valves, m / volume, supply).1;
            // There is no flow back into a supply that has fallen below the chamber.
            let goal =
                if rate(high) < 0.0 { balance(low, high, 1.0, rate) } else { high.max(held) };
            let change = goal - next;
            next = goal;
            if change.abs() <= 1e-10 * next {
                break;
            }
        }
        next
    }
}

/// Finds the zero of `rate` between `a` and `b` by bisection, to a relative width of 1e-12.
fn balance(mut a: f64, mut b: f64, rate_a: f64, rate: impl Fn(f64) -> f64) -> f64 {
    for _ in 0..48 {
        let middle = 0.5 * (a + b);
        if (b - a).abs() <= 1e-12 * middle.abs() {
            break;
        }
        if rate(middle) * rate_a > 0.0 {
            a = middle;
        } else {
            b = middle;
        }
    }
    0.5 * (a + b)
}

/// Openings turned into conductances, computed only when they change.
#[derive(Debug)]
pub(crate) struct Drive<'a> {
    stage: &'a Pneumatics,
    openings: Openings<'a>,
    last: [f64; 2],
    valves: Valves,
}

impl<'a> Drive<'a> {
    pub(crate) fn new(stage: &'a Pneumatics, openings: Openings<'a>) -> Self {
        Self { stage, openings, last: [0.0; 2], valves: Valves { inlet: 0.0, outlet: 0.0 } }
    }

    /// Conductances in a piece after a sample; both valves are shut before the first command arrives.
    #[inline]
    pub(crate) fn valves(&mut self, sample: usize, piece: usize) -> Valves {
        let now = match self.stage.grid.command(sample, piece) {
            Some(i) => [self.openings.inlet[i], self.openings.outlet[i]],
            None => [0.0; 2],
        };
        if now != self.last {
            self.last = now;
            let of = |side: usize| self.stage.conductance(side, now[side]);
            self.valves = Valves { inlet: of(0), outlet: of(1) };
        }
        self.valves
    }
}

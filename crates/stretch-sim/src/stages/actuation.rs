//! Stage `actuation`: the stages `pneumatics` and `muscle` as one, from valve openings to pressure and length.

use stretch_effects::{Grid, Start};

use super::{Memory, Muscle, Openings, Pneumatics, check_length, pick, pneumatics::Drive};
use crate::{SimError, effects::EffectSet, params::RigParams};

/// Valves, chamber and muscle, prepared to run: in sequence, or coupled if the chamber's volume depends on the muscle's
/// contraction.
#[derive(Debug)]
pub struct Actuation {
    pneumatics: Pneumatics,
    muscle: Muscle,
}

impl Actuation {
    /// Prepares the stage for trials on `grid`, which must come from [`EffectSet::grid`] with the same effects.
    ///
    /// # Errors
    /// Those of the two stages.
    pub fn new(params: &RigParams, effects: &EffectSet, grid: &Grid) -> Result<Self, SimError> {
        let pneumatics = Pneumatics::new(params, effects, grid)?;
        let muscle = Muscle::at_cells(params, effects, grid, pneumatics.end())?;
        Ok(Self { pneumatics, muscle })
    }

    /// Creates a memory for this stage.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.muscle.end())
    }

    /// The time steps.
    pub fn grid(&self) -> &Grid {
        self.pneumatics.grid()
    }

    /// Whether pressure and contraction depend on each other.
    pub fn is_coupled(&self) -> bool {
        self.pneumatics.is_coupled()
    }

    /// Computes gauge pressure in kPa and length in mm at every sample, from `initial_kpa` at the first.
    ///
    /// # Errors
    /// Openings outside 0..1, slices of different lengths, an initial pressure below vacuum or not
    /// finite.
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        pressure_kpa: &mut [f64],
        length_mm: &mut [f64],
    ) -> Result<(), SimError> {
        let samples = openings.check()?;
        check_length("pressure_kpa", samples, pressure_kpa.len())?;
        check_length("length_mm", samples, length_mm.len())?;
        let nodes = self.grid().nodes(samples);
        let mut pressure = std::mem::take(&mut memory.nodes);
        let mut length = std::mem::take(&mut memory.more_nodes);
        pressure.resize(nodes, 0.0);
        length.resize(nodes, 0.0);
        let done = self.run_nodes(memory, start, openings, initial_kpa, &mut pressure, &mut length);
        pick(self.grid(), None, &pressure, pressure_kpa);
        pick(self.grid(), None, &length, length_mm);
        (memory.nodes, memory.more_nodes) = (pressure, length);
        done
    }

    /// Computes the gauge pressure in kPa at every node of the grid, from `initial_kpa` at the first, if it does not
    /// depend on the contraction. This is the first half of [`run`](Self::run), for callers that run the second half
    /// often.
    ///
    /// # Errors
    /// As [`run`](Self::run), and a chamber whose volume depends on the contraction.
    pub fn run_pressure(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        nodes_kpa: &mut Vec<f64>,
    ) -> Result<(), SimError> {
        self.pneumatics.check_uncoupled()?;
        nodes_kpa.resize(self.grid().nodes(openings.check()?), 0.0);
        if nodes_kpa.is_empty() {
            return Ok(());
        }
        self.pneumatics.taking(memory, start, openings, |cells, start, openings| {
            self.fill(cells, start, openings, initial_kpa, nodes_kpa)
        })
    }

    /// Computes the length in mm at every sample, from the gauge pressure in kPa at every node. This is the second half
    /// of [`run`](Self::run) and has a separate memory.
    ///
    /// # Errors
    /// Slices whose lengths do not match.
    ///
    /// ```
    /// use stretch_sim::{Actuation, DEFAULT_STEP_S, EffectSet, Openings, RigParams, Start};
    /// let mut effects = EffectSet::new();
    /// effects.insert("muscle_creep", &[("c", 0.05), ("tau", 2.0)])?;
    /// effects.insert("valve_delay", &[("delay_s", 0.013)])?;
    /// let params = RigParams::default();
    /// let stage = Actuation::new(&params, &effects, &effects.grid(&params, 0.01, DEFAULT_STEP_S)?)?;
    /// let openings = Openings { inlet: &[1.0; 300], outlet: &[0.0; 300] };
    /// let [mut pressure_kpa, mut length_mm, mut again_mm] = [[0.0; 300]; 3];
    /// let memory = || stage.memory();
    /// stage.run(&mut memory(), Start::Settled, openings, 0.0, &mut pressure_kpa, &mut length_mm)?;
    /// // The halves are the whole, to the bit.
    /// let mut nodes_kpa = Vec::new();
    /// stage.run_pressure(&mut memory(), Start::Settled, openings, 0.0, &mut nodes_kpa)?;
    /// stage.run_length(&mut memory(), Start::Settled, &nodes_kpa, &mut again_mm)?;
    /// assert!(length_mm[299] < 160.0 && length_mm == again_mm);
    /// assert!(stage.run_length(&mut memory(), Start::Settled, &nodes_kpa[1..], &mut again_mm).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn run_length(
        &self,
        memory: &mut Memory,
        start: Start,
        nodes_kpa: &[f64],
        length_mm: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("nodes_kpa", self.grid().nodes(length_mm.len()), nodes_kpa.len())?;
        let mut nodes = std::mem::take(&mut memory.nodes);
        nodes.clear();
        nodes.extend_from_slice(nodes_kpa);
        let start = memory.start(start);
        self.muscle.run_nodes(&mut memory.cells, start, &mut nodes);
        pick(self.grid(), None, &nodes, length_mm);
        memory.nodes = nodes;
        Ok(())
    }

    /// As [`run`](Self::run), at every node of the grid; openings must have been checked.
    pub(crate) fn run_nodes(
        &self,
        memory: &mut Memory,
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        pressure: &mut [f64],
        length: &mut [f64],
    ) -> Result<(), SimError> {
        if pressure.is_empty() {
            return Ok(());
        }
        self.pneumatics.taking(memory, start, openings, |cells, start, openings| {
            if self.is_coupled() {
                return self.run_coupled(cells, start, openings, initial_kpa, pressure, length);
            }
            self.fill(cells, start, openings, initial_kpa, pressure)?;
            length.copy_from_slice(pressure);
            self.muscle.run_nodes(cells, start, length);
            Ok(())
        })
    }

    /// Computes the pressure at every node; there must be at least one.
    fn fill(
        &self,
        cells: &mut [f64],
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        pressure: &mut [f64],
    ) -> Result<(), SimError> {
        let pneumatics = &self.pneumatics;
        let mut chamber = pneumatics.begin(start, initial_kpa, 1.0, cells)?;
        let mut drive = Drive::new(pneumatics, openings);
        pressure[0] = initial_kpa;
        let steps = self.grid().steps();
        for (sample, out) in pressure[1..].chunks_exact_mut(steps.len()).enumerate() {
            for (piece, (h, p)) in steps.iter().zip(out).enumerate() {
                let valves = drive.valves(sample, piece);
                pneumatics.advance(valves, &mut chamber, [1.0; 2], *h);
                *p = pneumatics.pressure_kpa(chamber.held, 1.0);
            }
        }
        pneumatics.remember(&chamber, cells);
        Ok(())
    }

    /// Computes each step twice: first with a predicted change of the volume, then with the volume that follows from
    /// the muscle's response to that prediction.
    fn run_coupled(
        &self,
        cells: &mut [f64],
        start: Start,
        openings: Openings<'_>,
        initial_kpa: f64,
        pressure: &mut [f64],
        length: &mut [f64],
    ) -> Result<(), SimError> {
        let (pneumatics, muscle) = (&self.pneumatics, &self.muscle);
        let volume_at = |k: f64| pneumatics.volume(muscle.share(k));
        let mut k = muscle.begin(cells, start, initial_kpa);
        let mut volume = volume_at(k);
        let mut chamber = pneumatics.begin(start, initial_kpa, volume, cells)?;
        let mut drive = Drive::new(pneumatics, openings);
        pressure[0] = initial_kpa;
        length[0] = muscle.length_mm(k);
        let steps = self.grid().steps();
        let mut trial = cells.to_vec();
        // Rate of the contraction over the last step.
        let mut speed = 0.0;
        for node in 1..pressure.len() {
            let (sample, piece) = ((node - 1) / steps.len(), (node - 1) % steps.len());
            let h = steps[piece];
            let valves = drive.valves(sample, piece);
            let mut next_k = k + h * speed;
            let mut next = chamber;
            for _ in 0..2 {
                next = chamber;
                let next_volume = volume_at(next_k);
                pneumatics.advance(valves, &mut next, [volume, next_volume], h);
                trial.copy_from_slice(cells);
                next_k =
                    muscle.step(&mut trial, node, pneumatics.pressure_kpa(next.held, next_volume));
            }
            cells.copy_from_slice(&trial);
            chamber = next;
            speed = (next_k - k) / h;
            k = next_k;
            volume = volume_at(k);
            pressure[node] = pneumatics.pressure_kpa(chamber.held, volume);
            length[node] = muscle.length_mm(k);
        }
        pneumatics.remember(&chamber, cells);
        Ok(())
    }
}

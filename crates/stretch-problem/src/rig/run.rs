//! The simulation of one stage of the rig over the session.

use std::{borrow::Cow, sync::Arc};

use stretch_gap::Run;
use stretch_sim::{
    Actuation, DEFAULT_STEP_S, EffectSet, Grid, Key, Memory, Muscle, Need, Openings, Pneumatics,
    Reference, RigParams, RigStage, Sensing, Start, static_kpa,
};

use super::{RigSimulator, nominal::TunedRig, session::Begin, timing};
use crate::{
    bench::{Acting, smooth::cubic},
    error::ProblemError,
};

/// Step of integration while fitting, s.
const STEP_S: f64 = 2.0 * DEFAULT_STEP_S;
/// Number of steps for each sample if an effect needs fine steps. Such an effect needs them because the length is not
/// linear between samples.
const PIECES: f64 = 4.0;
/// Pressure of a vented chamber, kPa (mean, 1 sd): as a rule a little above the atmosphere.
const EMPTY_KPA: (f64, f64) = (0.08, 0.06);
/// Pressure of a filled chamber below the supply, a share of the supply (mean, 1 sd).
const FULL_SHARE: (f64, f64) = (0.0008, 0.0006);

/// Error of the pressure at a trial's start that is derived from a length at rest, kPa (1 sd).
const LENGTH_KPA: f64 = 3.0;
/// Error of the pressure at a trial's start that is derived from a length during a motion, kPa (1 sd).
const MOVING_KPA: f64 = 10.0;

/// Everything that a run needs in addition to the rig.
pub(super) struct Setting<'a> {
    pub(super) rig: &'a RigSimulator,
    pub(super) tuned: TunedRig,
    pub(super) effects: EffectSet,
    /// Step of integration of stages that commands drive, s.
    pub(super) step_s: f64,
    pub(super) grid: Grid,
    /// Share of the steady state in the initial state of the stage at the first and at later trials, 0 to 1.
    pub(super) initial_shares: [f64; 2],
    pub(super) input_noise: Option<u64>,
    /// Input of the stage that replaces the measured one, all trials concatenated.
    pub(super) given: Option<&'a [f64]>,
    pub(super) kind: RigStage,
}

/// Simulates one stage, on the measured input unless another one is given.
pub(super) fn simulate(
    rig: &RigSimulator,
    run: Run<'_>,
    given: Option<&[f64]>,
    out: &mut [f64],
) -> Result<(), ProblemError> {
    let kind = rig.stage_kinds[run.stage];
    let tuned = TunedRig::of(&rig.base, &rig.tuned, run.model);
    let is_sensor = kind == RigStage::Sensing;
    let initial_shares = if is_sensor { tuned.initial_gauge } else { tuned.initial_muscle };
    let acting = rig.bench.acting(run.model)?;
    let dt_s = rig.bench.about.spec().dt_s;
    let step_s = run.step * STEP_S;
    let grid = match kind {
        // These stages are driven by a measured input.
        RigStage::Muscle | RigStage::Sensing => {
            let is_fine = acting.inside.acting_in(kind).any(|e| e.effect().needs_fine_steps());
            let pieces = if is_fine { PIECES } else { 1.0 };
            Grid::new(dt_s, run.step.min(1.0) * dt_s / pieces, 0.0)?
        }
        _ => acting.inside.grid(&tuned.params, dt_s, step_s)?,
    };
    let setting = Setting {
        rig,
        tuned,
        effects: acting.inside.clone(),
        step_s,
        grid,
        initial_shares,
        input_noise: run.input_noise,
        given,
        kind,
    };
    match kind {
        RigStage::Pneumatics => setting.pneumatics(run.trials, out),
        RigStage::Muscle => setting.muscle(run.trials, out),
        RigStage::Sensing => setting.sensing(run.trials, &acting, out),
        _ => setting.actuation(run.trials, out),
    }
}

/// A part of the session that a stage runs over.
#[derive(Debug, Clone, Copy)]
enum At {
    /// Two samples before the session, at the other end of the stroke.
    Before,
    /// The first sample of a trial.
    First(usize),
    /// A trial.
    Trial(usize),
}

impl Setting<'_> {
    /// The start of a trial in the state that the trial before left, after the pause between the two.
    pub(super) fn start(&self, trial: usize) -> Start {
        if self.initial_share(trial) > 0.0 {
            // The memory already holds the pause before the trial.
            return Start::Carried { rest_s: 0.0 };
        }
        self.after_pause(trial)
    }

    pub(super) fn after_pause(&self, trial: usize) -> Start {
        Start::Carried { rest_s: self.rest_s(trial) }
    }

    /// Time at rest before a trial, s; 0 if the trial continues the one before after a gap.
    fn rest_s(&self, trial: usize) -> f64 {
        let trials = &self.rig.bench.about.spec().trials;
        let pause_s = match trial.checked_sub(1) {
            Some(before) => {
                let end = trials[before].start_s
                    + trials[before].samples as f64 * self.rig.bench.about.spec().dt_s;
                trials[trial].start_s - end
            }
            None => 15.0,
        };
        // The motion to the new start took about a second of the pause.
        (pause_s - 1.0).max(0.0)
    }

    /// Sets the memory that a stage has of the motion before a trial.
    ///
    /// As a rule a muscle that is vented at the session's start was filled before, so play and creep
    /// begin from the filled side, and later trials begin in the state that the trial before left. A
    /// rig that was in a steady state before every trial (which waited for long, or was simulated)
    /// remembers no such motion. The initial state lies between the two. The share is a parameter of the recording:
    ///
    /// ```text
    /// cells = moved + share (steady - moved)
    /// ```
    ///
    /// The function moves a memory of the motion before the trial towards the memory of a stage in
    /// its steady state where the trial begins. `fresh` returns an empty memory. `begin` runs a stage with a memory at the trial's first sample, so that the
    /// trial follows without a pause.
    fn set_initial_state(
        &self,
        trial: usize,
        memory: &mut Memory,
        fresh: impl FnOnce() -> Memory,
        mut begin: impl FnMut(&mut Memory, Start) -> Result<(), ProblemError>,
    ) -> Result<(), ProblemError> {
        let share = self.initial_share(trial);
        if share > 0.0 {
            let mut steady = fresh();
            begin(memory, self.after_pause(trial))?;
            begin(&mut steady, Start::Settled)?;
            memory.move_towards(&steady, share);
        }
        Ok(())
    }

    /// Share of the steady state in the initial state of a trial. A trial that continues the one
    /// before has the state that it left.
    fn initial_share(&self, trial: usize) -> f64 {
        let [first, later] = self.initial_shares;
        match trial {
            0 => first,
            _ if self.rest_s(trial) > 0.0 => later,
            _ => 0.0,
        }
    }

    /// The reference, which follows the muscle, after lengths from `before` the session.
    pub(super) fn reference(
        &self,
        effects: &EffectSet,
        before: &[f64],
    ) -> Result<ReferenceSensor, ProblemError> {
        let mut shown = self.shown(effects)?;
        let ReferenceSensor { stage, memory, .. } = &mut shown;
        stage.run(memory, Start::Settled, before, &mut vec![0.0; before.len()])?;
        Ok(shown)
    }

    fn is_vented(&self) -> bool {
        let inputs = &self.rig.inputs;
        let first = inputs.length.first(0).unwrap_or(0.0);
        first > 0.5 * (inputs.stroke.0 + inputs.stroke.1)
    }

    /// Pressure before the session, kPa: a muscle that begins vented was filled before, and a
    /// muscle that begins filled was vented.
    pub(super) fn before_kpa(&self) -> f64 {
        if self.is_vented() { 1e-3 * self.tuned.params[Key::PS] } else { 0.0 }
    }

    /// Length before the session, mm.
    pub(super) fn before_mm(&self) -> f64 {
        let (filled, vented) = self.rig.inputs.stroke;
        if self.is_vented() { filled } else { vented }
    }

    pub(super) fn initial_kpa(&self, trial: usize) -> f64 {
        let supply = 1e-3 * self.tuned.params[Key::PS];
        match self.rig.inputs.begin[trial] {
            Begin::Empty => EMPTY_KPA.0 + self.tuned.offset * EMPTY_KPA.1,
            Begin::Full => supply * (1.0 - FULL_SHARE.0 + self.tuned.offset * FULL_SHARE.1),
            Begin::Pressure(kpa, sd) => kpa + self.tuned.offset * sd,
            Begin::Length(mm) => {
                static_kpa(&self.tuned.params, mm) + LENGTH_KPA * self.tuned.offset
            }
            // The muscle lags behind its pressure: tau L' = L_static - L.
            Begin::Moving(mm, mm_per_s) => {
                let ahead = mm + self.tuned.params[Key::TauM] * mm_per_s;
                static_kpa(&self.tuned.params, ahead) + MOVING_KPA * self.tuned.offset
            }
        }
    }

    /// Inlet and outlet, with commands that act ahead of their rows.
    pub(super) fn openings(&self, trial: usize) -> [Cow<'_, [f64]>; 2] {
        let range = &self.rig.bench.columns.ranges[trial];
        let [inlet, outlet] = self.rig.inputs.openings.each_ref().map(|all| &all[range.clone()]);
        timing::ahead(inlet, outlet, self.tuned.leads)
    }

    /// The measured length, smoothed, with a random draw of its noise if the run requests one; the given input if the
    /// length drives the stage.
    fn length(&self, trial: usize) -> Vec<f64> {
        self.given(trial, self.kind != RigStage::Muscle)
            .unwrap_or_else(|| self.rig.inputs.length.trial(trial, self.input_noise))
    }

    /// The pressure, as [`Setting::length`]; `None` if it was not recorded.
    fn pressure(&self, trial: usize) -> Option<Vec<f64>> {
        let measured = || Some(self.rig.inputs.pressure.as_ref()?.trial(trial, self.input_noise));
        self.given(trial, self.kind == RigStage::Muscle).or_else(measured)
    }

    /// The part of the given input that belongs to a trial.
    fn given(&self, trial: usize, drives: bool) -> Option<Vec<f64>> {
        let given = self.given.filter(|_| drives)?;
        Some(given[self.rig.bench.columns.ranges[trial].clone()].to_vec())
    }

    /// Calls a function for every trial with its part of the output.
    pub(super) fn each(
        &self,
        count: usize,
        out: &mut [f64],
        mut visit: impl FnMut(usize, &mut [f64]) -> Result<(), ProblemError>,
    ) -> Result<(), ProblemError> {
        let mut ranges = self.rig.bench.columns.ranges[..count].iter().enumerate();
        ranges.try_for_each(|(trial, range)| visit(trial, &mut out[range.clone()]))
    }

    pub(super) fn pneumatics(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Pneumatics::new(&self.tuned.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        self.each(count, out, |trial, own| {
            let (start, [inlet, outlet]) = (self.after_pause(trial), self.openings(trial));
            let openings = Openings { inlet: &inlet, outlet: &outlet };
            let initial = self.initial_kpa(trial);
            if stage.is_coupled() {
                let length = self.length(trial);
                stage.run_with_length(&mut memory, start, openings, &length, initial, own)?;
            } else {
                stage.run(&mut memory, start, openings, initial, own)?;
            }
            Ok(())
        })
    }

    pub(super) fn muscle(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Muscle::new(&self.tuned.params, &self.effects, &self.grid)?;
        let before = self.before_kpa();
        let pressure = |trial: usize| self.pressure(trial).unwrap_or_default();
        self.lengths(
            count,
            out,
            || stage.memory(),
            |memory, start, at, own| {
                let pressure = match at {
                    At::Before => vec![before; own.len()],
                    At::First(trial) => vec![pressure(trial).first().copied().unwrap_or(before)],
                    At::Trial(trial) => pressure(trial),
                };
                Ok(stage.run(memory, start, &pressure, own)?)
            },
        )
    }

    pub(super) fn actuation(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Actuation::new(&self.tuned.params, &self.effects, &self.grid)?;
        let before = self.before_kpa();
        if !stage.is_coupled() {
            let pressure = self.chamber_kpa(&stage, count)?;
            return self.lengths(
                count,
                out,
                || stage.memory(),
                |memory, start, at, own| {
                    let held = match at {
                        At::Before => vec![before; stage.grid().nodes(own.len())],
                        At::First(trial) => pressure[trial][..1].to_vec(),
                        At::Trial(trial) => {
                            return Ok(stage.run_length(memory, start, &pressure[trial], own)?);
                        }
                    };
                    Ok(stage.run_length(memory, start, &held, own)?)
                },
            );
        }
        self.lengths(
            count,
            out,
            || stage.memory(),
            |memory, start, at, own| {
                let shut = || Cow::Owned(vec![0.0; own.len()]);
                let ([inlet, outlet], initial) = match at {
                    At::Before => ([shut(), shut()], before),
                    At::First(trial) => ([shut(), shut()], self.initial_kpa(trial)),
                    At::Trial(trial) => (self.openings(trial), self.initial_kpa(trial)),
                };
                let openings = Openings { inlet: &inlet, outlet: &outlet };
                let mut pressure = vec![0.0; own.len()];
                Ok(stage.run(memory, start, openings, initial, &mut pressure, own)?)
            },
        )
    }

    /// Lengths of a stage as the reference shows them. `run` runs the stage over a part of the session.
    fn lengths(
        &self,
        count: usize,
        out: &mut [f64],
        fresh: impl Fn() -> Memory,
        run: impl Fn(&mut Memory, Start, At, &mut [f64]) -> Result<(), ProblemError>,
    ) -> Result<(), ProblemError> {
        let (mut memory, mut filled, mut begun) = (fresh(), [0.0; 2], [0.0]);
        run(&mut memory, Start::Settled, At::Before, &mut filled)?;
        let mut shown = self.reference(&self.effects, &filled)?;
        self.each(count, out, |trial, own| {
            self.set_initial_state(trial, &mut memory, &fresh, |memory, start| {
                run(memory, start, At::First(trial), &mut begun)
            })?;
            run(&mut memory, self.start(trial), At::Trial(trial), own)?;
            shown.run(self, trial, own)
        })
    }

    fn sensing(
        &self,
        count: usize,
        acting: &Acting<'_>,
        out: &mut [f64],
    ) -> Result<(), ProblemError> {
        let stage = Sensing::new(&self.tuned.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        let shown = self.shown(&self.effects.only(|e| !e.hides_input()))?;
        let needs_pressure = self
            .effects
            .acting_in(RigStage::Sensing)
            .any(|e| e.effect().needs == Some(Need::Pressure));
        let has_pressure = self.rig.inputs.pressure.is_some();
        let pressures = match needs_pressure && !has_pressure {
            true => self.simulated_pressure(count)?,
            false => Arc::default(),
        };
        // An effect that counts from the start of the session allows no motion before that start.
        let counts = self.effects.iter().any(|e| e.effect().counts_session());
        if !counts {
            let (before, kpa) = (self.before_mm(), self.before_kpa());
            let nodes = self.grid.nodes(2);
            let mut volts = [0.0; 2];
            stage.run(
                &mut memory,
                Start::Settled,
                self.rig.bench.about.spec().trials[0].start_s,
                &vec![before; nodes],
                &vec![kpa; nodes],
                &mut volts,
            )?;
        }
        let dimmed = self.dimmed(count)?;
        let hidden = self.hidden(count)?;
        self.each(count, out, |trial, own| {
            let mut length = self.length(trial);
            if let Some(hidden) = &hidden {
                length.iter_mut().zip(&hidden[trial]).for_each(|(x, h)| *x += h);
            }
            shown.undo(&mut length);
            let pressure = match needs_pressure {
                true => self.pressure(trial).unwrap_or_else(|| pressures[trial].clone()),
                false => Vec::new(),
            };
            let start_s = self.rig.bench.about.spec().trials[trial].start_s;
            let (length, pressure) = (self.refined(length), self.refined(pressure));
            let stage = dimmed.get(trial).and_then(Option::as_ref).unwrap_or(&stage);
            let start = if counts {
                self.after_pause(trial)
            } else {
                let first = [&length[..1], pressure.get(..1).unwrap_or(&[])];
                let fresh = || stage.memory();
                self.set_initial_state(trial, &mut memory, fresh, |memory, start| {
                    Ok(stage.run(memory, start, start_s, first[0], first[1], &mut [0.0])?)
                })?;
                self.start(trial)
            };
            stage.run(&mut memory, start, start_s, &length, &pressure, own)?;
            acting.follow(self.rig.bench.record(trial), own);
            Ok(())
        })
    }

    /// For each trial, the sensing stage if the excitation of the bridge is not the usual one,
    /// otherwise `None`. All trials share the memory of the gauge.
    fn dimmed(&self, count: usize) -> Result<Vec<Option<Sensing>>, ProblemError> {
        let one = |excitation: &f64| {
            let mut params = self.tuned.params;
            params[Key::VExc] *= excitation;
            let stage = || Ok(Sensing::new(&params, &self.effects, &self.grid)?);
            (*excitation != 1.0).then(stage).transpose()
        };
        self.rig.excitation[..count].iter().map(one).collect()
    }

    /// Samples at every node of the grid, interpolated by cubics through four samples.
    fn refined(&self, samples: Vec<f64>) -> Vec<f64> {
        let pieces = self.grid.pieces();
        if pieces == 1 || samples.is_empty() {
            return samples;
        }
        let nodes = self.grid.nodes(samples.len());
        (0..nodes)
            .map(|n| cubic(&samples, n / pieces, (n % pieces) as f64 / pieces as f64))
            .collect()
    }

    fn shown(&self, effects: &EffectSet) -> Result<ReferenceSensor, ProblemError> {
        ReferenceSensor::new(&self.tuned.params, effects, self.rig.bench.about.spec().dt_s)
    }
}

/// The reference sensor behind a stage, skipped if no effect acts in the reference.
pub(super) struct ReferenceSensor {
    stage: Reference,
    memory: Memory,
    acts: bool,
    work: Vec<f64>,
}

impl ReferenceSensor {
    fn new(params: &RigParams, effects: &EffectSet, dt_s: f64) -> Result<Self, ProblemError> {
        let stage = Reference::new(params, effects, &Grid::samples(dt_s)?)?;
        let acts = effects.acting_in(RigStage::Reference).next().is_some();
        let memory = stage.memory();
        Ok(Self { stage, memory, acts, work: Vec::new() })
    }

    /// Replaces the lengths of a trial by those that the sensor shows.
    pub(super) fn run(
        &mut self,
        setting: &Setting<'_>,
        trial: usize,
        length: &mut [f64],
    ) -> Result<(), ProblemError> {
        if !self.acts {
            return Ok(());
        }
        let Self { stage, memory, work, .. } = self;
        work.clear();
        work.extend_from_slice(length);
        setting.set_initial_state(
            trial,
            memory,
            || stage.memory(),
            |memory, start| Ok(stage.run(memory, start, &work[..1], &mut [0.0])?),
        )?;
        Ok(stage.run(memory, setting.start(trial), work, length)?)
    }

    fn undo(&self, length: &mut [f64]) {
        if self.acts {
            self.stage.undo(length);
        }
    }
}

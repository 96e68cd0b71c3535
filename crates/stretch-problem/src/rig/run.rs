//! The simulation of one stage of the rig over the session.

use std::{borrow::Cow, sync::Arc};

use stretch_gap::Run;
use stretch_sim::{
    Actuation, DEFAULT_STEP_S, EffectSet, Grid, Key, Memory, Muscle, Need, Openings, Pneumatics,
    RigParams, RigStage, Sensing, Start,
};

use super::{
    RigSimulator, RigTrial, nominal::TunedRig, reference_sensor::ReferenceSensor, session::Begin,
    smooth::cubic, timing, timing::Leads,
};
use crate::{bench::acting::Acting, error::ProblemError};

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
    pub(super) params: RigParams,
    pub(super) effects: EffectSet,
    /// Step of integration of stages that commands drive, s.
    pub(super) step_s: f64,
    pub(super) grid: Grid,
    pub(super) offset: f64,
    pub(super) leads: Leads,
    /// Share of the settled state in the initial state of the stage, 0 to 1.
    pub(super) initial_share: f64,
    /// Share of the settled state in the initial state of the muscle, 0 to 1.
    pub(super) initial_muscle: f64,
    pub(super) input_noise: Option<u64>,
    /// Input of the stage that replaces the measured one, all trials end to end.
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
    let TunedRig { params, offset, leads, initial_muscle, initial_gauge } = tuned;
    let initial_share = if kind == RigStage::Sensing { initial_gauge } else { initial_muscle };
    let acting = Acting::of(&rig.effects, &rig.rows, run.model)?;
    let step_s = run.step * STEP_S;
    let grid = match kind {
        // These stages are driven by a measured input.
        RigStage::Muscle | RigStage::Sensing => {
            let is_fine = acting.inside.acting_in(kind).any(|e| e.effect().needs_fine_steps());
            let pieces = if is_fine { PIECES } else { 1.0 };
            Grid::new(rig.about.dt_s, run.step.min(1.0) * rig.about.dt_s / pieces, 0.0)?
        }
        _ => acting.inside.grid(&params, rig.about.dt_s, step_s)?,
    };
    let setting = Setting {
        rig,
        params,
        effects: acting.inside.clone(),
        step_s,
        grid,
        offset,
        leads,
        initial_share,
        initial_muscle,
        input_noise: run.input_noise,
        given,
        kind,
    };
    match kind {
        RigStage::Pneumatics => setting.pneumatics(run.trials, out)?,
        RigStage::Muscle => setting.muscle(run.trials, out)?,
        RigStage::Sensing => setting.sensing(run.trials, &acting, out)?,
        _ => setting.actuation(run.trials, out)?,
    }
    if out.iter().all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(ProblemError::NotFinite { stage: rig.about.stages[run.stage].name.clone() })
    }
}

impl Setting<'_> {
    /// The start of a trial in the state that the trial before left, after the pause between the two.
    pub(super) fn start(&self, trial: usize) -> Start {
        if trial == 0 && self.initial_share > 0.0 {
            // The memory already holds the pause before the first trial.
            return Start::Carried { rest_s: 0.0 };
        }
        self.after_pause(trial)
    }

    pub(super) fn after_pause(&self, trial: usize) -> Start {
        let trials = &self.rig.about.trials;
        let rest_s = match trial.checked_sub(1) {
            Some(before) => {
                let end =
                    trials[before].start_s + trials[before].samples as f64 * self.rig.about.dt_s;
                trials[trial].start_s - end
            }
            None => 15.0,
        };
        // The motion to the new start took about a second of the pause.
        Start::Carried { rest_s: (rest_s - 1.0).max(0.0) }
    }

    /// Sets the initial state of the stage's memory, which was left at the other end of the stroke.
    fn set_initial_state(
        &self,
        memory: &mut Memory,
        settled: Memory,
        begin: impl FnMut(&mut Memory, Start) -> Result<(), ProblemError>,
    ) -> Result<(), ProblemError> {
        set_initial_state(self.initial_share, self.after_pause(0), memory, settled, begin)
    }

    /// Sets the initial state of the reference, which follows the muscle.
    pub(super) fn set_reference_state(
        &self,
        shown: &mut ReferenceSensor,
        length: &[f64],
    ) -> Result<(), ProblemError> {
        shown.set_initial_state(self.initial_muscle, self.after_pause(0), length)
    }

    fn is_vented(&self) -> bool {
        let inputs = &self.rig.inputs;
        let first = inputs.length[0].values.first().copied().unwrap_or(0.0);
        first > 0.5 * (inputs.stroke.0 + inputs.stroke.1)
    }

    /// Pressure before the session, kPa: a muscle that begins vented was filled before, and a
    /// muscle that begins filled was vented.
    pub(super) fn before_kpa(&self) -> f64 {
        if self.is_vented() { 1e-3 * self.params[Key::PS] } else { 0.0 }
    }

    /// Length before the session, mm.
    pub(super) fn before_mm(&self) -> f64 {
        let (filled, vented) = self.rig.inputs.stroke;
        if self.is_vented() { filled } else { vented }
    }

    pub(super) fn initial_kpa(&self, trial: usize) -> f64 {
        let supply = 1e-3 * self.params[Key::PS];
        match self.rig.inputs.begin[trial] {
            Begin::Empty => EMPTY_KPA.0 + self.offset * EMPTY_KPA.1,
            Begin::Full => supply * (1.0 - FULL_SHARE.0 + self.offset * FULL_SHARE.1),
            Begin::Pressure(kpa, sd) => kpa + self.offset * sd,
            Begin::Length(mm) => self.static_kpa(mm) + LENGTH_KPA * self.offset,
            // The muscle lags behind its pressure: tau L' = L_static - L.
            Begin::Moving(mm, mm_per_s) => {
                let ahead = mm + self.params[Key::TauM] * mm_per_s;
                self.static_kpa(ahead) + MOVING_KPA * self.offset
            }
        }
    }

    /// Pressure at which the muscle rests at a length, kPa.
    fn static_kpa(&self, mm: f64) -> f64 {
        let p = &self.params;
        let x = (1.0 - mm / p[Key::L0]) / p[Key::KMax];
        let law = p[Key::A0] * (1.0 - (-p[Key::A1] * x).exp()) * (p[Key::A3] * x * x).exp();
        (1e-3 * p[Key::PRef] * law).max(0.0)
    }

    /// Inlet and outlet, with commands that act ahead of their rows.
    pub(super) fn openings(&self, trial: usize) -> [Cow<'_, [f64]>; 2] {
        let own = &self.rig.session.trials[trial];
        timing::ahead(&own.inlet, &own.outlet, self.leads)
    }

    /// A measured input of the stage, smoothed, with a random draw of its noise if the run requests
    /// one.
    fn input(&self, trial: usize, of_pressure: bool) -> Vec<f64> {
        if let Some(given) = self.given.filter(|_| of_pressure == (self.kind == RigStage::Muscle)) {
            let trials = &self.rig.about.trials;
            let from = trials[..trial].iter().map(|t| t.samples).sum::<usize>();
            return given[from..from + trials[trial].samples].to_vec();
        }
        let inputs = &self.rig.inputs;
        let input = if of_pressure { &inputs.pressure[trial] } else { &inputs.length[trial] };
        let Some(seed) = self.input_noise else { return input.values.clone() };
        let noises = &self.rig.noises;
        match of_pressure {
            true => {
                let draws = &inputs.pressure_draws;
                draws.with_noise(&inputs.pressure, &noises.pressure_kpa, seed, trial)
            }
            false => inputs.length_draws.with_noise(&inputs.length, &noises.length_mm, seed, trial),
        }
    }

    /// Visits every trial with its part of the output.
    pub(super) fn each(
        &self,
        count: usize,
        mut out: &mut [f64],
        mut visit: impl FnMut(usize, &mut [f64]) -> Result<(), ProblemError>,
    ) -> Result<(), ProblemError> {
        for (trial, spec) in self.rig.about.trials[..count].iter().enumerate() {
            let (own, rest) = out.split_at_mut(spec.samples);
            visit(trial, own)?;
            out = rest;
        }
        Ok(())
    }

    pub(super) fn pneumatics(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Pneumatics::new(&self.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        self.each(count, out, |trial, own| {
            let (start, [inlet, outlet]) = (self.after_pause(trial), self.openings(trial));
            let openings = Openings { inlet: &inlet, outlet: &outlet };
            let initial = self.initial_kpa(trial);
            if stage.is_coupled() {
                let length = self.input(trial, false);
                stage.run_with_length(&mut memory, start, openings, &length, initial, own)?;
            } else {
                stage.run(&mut memory, start, openings, initial, own)?;
            }
            Ok(())
        })
    }

    pub(super) fn muscle(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Muscle::new(&self.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        let mut shown = self.shown(&self.effects)?;
        let before = self.before_kpa();
        let mut filled = [0.0; 2];
        stage.run(&mut memory, Start::Settled, &[before; 2], &mut filled)?;
        shown.condition(&filled)?;
        let first = self.input(0, true).first().copied().unwrap_or(before);
        let mut begun = [0.0];
        self.set_initial_state(&mut memory, stage.memory(), |memory, start| {
            Ok(stage.run(memory, start, &[first], &mut begun)?)
        })?;
        self.set_reference_state(&mut shown, &begun)?;
        self.each(count, out, |trial, own| {
            stage.run(&mut memory, self.start(trial), &self.input(trial, true), own)?;
            shown.run(self.start(trial), own)
        })
    }

    pub(super) fn actuation(&self, count: usize, out: &mut [f64]) -> Result<(), ProblemError> {
        let stage = Actuation::new(&self.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        let mut shown = self.shown(&self.effects)?;
        let before = self.before_kpa();
        let mut filled = [0.0; 2];
        if !stage.is_coupled() {
            let nodes = stage.grid().nodes(filled.len());
            stage.run_length(&mut memory, Start::Settled, &vec![before; nodes], &mut filled)?;
            shown.condition(&filled)?;
            let pressure = self.chamber_kpa(&stage, count)?;
            let first = pressure.first().and_then(|p| p.first()).copied().unwrap_or(before);
            let mut begun = [0.0];
            self.set_initial_state(&mut memory, stage.memory(), |memory, start| {
                Ok(stage.run_length(memory, start, &[first], &mut begun)?)
            })?;
            self.set_reference_state(&mut shown, &begun)?;
            return self.each(count, out, |trial, own| {
                stage.run_length(&mut memory, self.start(trial), &pressure[trial], own)?;
                shown.run(self.start(trial), own)
            });
        }
        let shut = [0.0; 2];
        let openings = Openings { inlet: &shut, outlet: &shut };
        stage.run(&mut memory, Start::Settled, openings, before, &mut [0.0; 2], &mut filled)?;
        shown.condition(&filled)?;
        let (initial, mut begun) = (self.initial_kpa(0), [0.0]);
        let shut = Openings { inlet: &[0.0], outlet: &[0.0] };
        self.set_initial_state(&mut memory, stage.memory(), |memory, start| {
            Ok(stage.run(memory, start, shut, initial, &mut [0.0], &mut begun)?)
        })?;
        self.set_reference_state(&mut shown, &begun)?;
        let mut pressure = Vec::new();
        self.each(count, out, |trial, own| {
            pressure.resize(own.len(), 0.0);
            let [inlet, outlet] = self.openings(trial);
            stage.run(
                &mut memory,
                self.start(trial),
                Openings { inlet: &inlet, outlet: &outlet },
                self.initial_kpa(trial),
                &mut pressure,
                own,
            )?;
            shown.run(self.start(trial), own)
        })
    }

    fn sensing(
        &self,
        count: usize,
        acting: &Acting<'_>,
        out: &mut [f64],
    ) -> Result<(), ProblemError> {
        let stage = Sensing::new(&self.params, &self.effects, &self.grid)?;
        let mut memory = stage.memory();
        let shown = self.shown(&self.effects.only(|e| !e.hides_input()))?;
        let needs_pressure = self
            .effects
            .acting_in(RigStage::Sensing)
            .any(|e| e.effect().needs == Some(Need::Pressure));
        let pressures = match needs_pressure && self.rig.inputs.pressure.is_empty() {
            true => self.simulated_pressure(count)?,
            false => Arc::default(),
        };
        // An effect that counts from the start of the session allows no motion before that start.
        if !self.effects.iter().any(|e| e.effect().counts_session()) {
            let (before, kpa) = (self.before_mm(), self.before_kpa());
            let nodes = self.grid.nodes(2);
            let mut volts = [0.0; 2];
            stage.run(
                &mut memory,
                Start::Settled,
                self.rig.about.trials[0].start_s,
                &vec![before; nodes],
                &vec![kpa; nodes],
                &mut volts,
            )?;
            let first = |of_pressure: bool, other: f64| match of_pressure {
                true if self.rig.inputs.pressure.is_empty() => other,
                _ => self.input(0, of_pressure).first().copied().unwrap_or(other),
            };
            let mut length = [first(false, before)];
            shown.undo(&mut length);
            let (pressure, mut volts) = ([first(true, self.initial_kpa(0))], [0.0]);
            self.set_initial_state(&mut memory, stage.memory(), |memory, start| {
                let start_s = self.rig.about.trials[0].start_s;
                Ok(stage.run(memory, start, start_s, &length, &pressure, &mut volts)?)
            })?;
        }
        let dimmed = self.dimmed(count)?;
        let hidden = self.hidden(count)?;
        let mut from = 0;
        self.each(count, out, |trial, own| {
            let mut length = self.input(trial, false);
            if let Some(hidden) = &hidden {
                length.iter_mut().zip(&hidden[from..]).for_each(|(x, h)| *x += h);
                from += own.len();
            }
            shown.undo(&mut length);
            let pressure = match (needs_pressure, self.rig.inputs.pressure.is_empty()) {
                (false, _) => Vec::new(),
                (true, false) => self.input(trial, true),
                (true, true) => pressures[trial].clone(),
            };
            let start_s = self.rig.about.trials[trial].start_s;
            let (length, pressure) = (self.refined(length), self.refined(pressure));
            let stage = dimmed.get(trial).and_then(Option::as_ref).unwrap_or(&stage);
            stage.run(&mut memory, self.start(trial), start_s, &length, &pressure, own)?;
            let record = self.rig.bridge.of_trial(trial, self.rig.noises.volts.sd(), 1.0);
            acting.follow(record, own);
            Ok(())
        })
    }

    /// For each trial, the sensing stage if the excitation of the bridge is not the usual one,
    /// otherwise `None`. All trials share the memory of the gauge.
    fn dimmed(&self, count: usize) -> Result<Vec<Option<Sensing>>, ProblemError> {
        let one = |trial: &RigTrial| {
            let mut params = self.params;
            params[Key::VExc] *= trial.excitation;
            let stage = || Ok(Sensing::new(&params, &self.effects, &self.grid)?);
            (trial.excitation != 1.0).then(stage).transpose()
        };
        self.rig.session.trials[..count].iter().map(one).collect()
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

    pub(super) fn shown(&self, effects: &EffectSet) -> Result<ReferenceSensor, ProblemError> {
        ReferenceSensor::new(&self.params, effects, self.rig.about.dt_s)
    }
}

/// Sets the memory that a stage has of the motion before the session.
///
/// As a rule a muscle that is vented at the session's start was filled before, so play and creep
/// begin from the filled side. A rig that had settled (just switched on, or simulated) remembers no
/// such motion. The initial state lies between the two. The share is a parameter of the recording:
///
/// ```text
/// cells = moved + share (settled - moved)
/// ```
///
/// The function moves a memory that was left at the other end of the stroke towards the memory of a stage that settled
/// where the session begins. `begin` runs a stage with a memory at the session's first sample, so that the first trial
/// follows without a pause.
pub(super) fn set_initial_state(
    share: f64,
    after_pause: Start,
    memory: &mut Memory,
    mut settled: Memory,
    mut begin: impl FnMut(&mut Memory, Start) -> Result<(), ProblemError>,
) -> Result<(), ProblemError> {
    if share > 0.0 {
        begin(memory, after_pause)?;
        begin(&mut settled, Start::Settled)?;
        memory.move_towards(&settled, share);
    }
    Ok(())
}

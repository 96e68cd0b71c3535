//! Candidate experiments on the rig, and the channels that a model predicts for each.

use stretch_calibrate::PRESSURE;
use stretch_data::{Trial, TrialKind};
use stretch_gap::{GapError, Laboratory, Model, Plan};
use stretch_sim::{
    Chain, DEFAULT_STEP_S, Held, Key, Openings, RATE_HZ, Recorded, Setting, Start, TrialPlan,
};

use super::{RigSimulator, nominal::TunedRig, session::VALVES};
use crate::{bench::even_trial, error::ProblemError};

/// Sample time of an experiment, s.
const DT_S: f64 = 1.0 / RATE_HZ;
/// Step of integration, s: four times the usual one, because differences between alternatives need few digits.
const STEP_S: f64 = 4.0 * DEFAULT_STEP_S;
/// Share by which the shunt changes the bridge's trim.
const SHUNT: f64 = 0.02;

/// A candidate: its name, instructions in a sentence, the minutes to prepare it, and its commands.
type Candidate = (&'static str, &'static str, f64, TrialPlan);

/// The trial of an experiment, which a replay simulates.
fn trial(name: &str, plan: TrialPlan) -> Trial {
    let more = plan.more_columns().into_iter().map(|c| (c.name, c.values));
    let valves = VALVES.map(str::to_owned).into_iter().zip([plan.inlet, plan.outlet]);
    even_trial(name, DT_S, valves.chain(more))
}

/// Commands in pieces of (inlet, outlet, seconds), after a second of rest.
fn pieces(pieces: &[(f64, f64, f64)]) -> TrialPlan {
    let mut plan = TrialPlan::new(String::new(), TrialKind::Other, 1.0);
    for &(inlet, outlet, s) in pieces {
        let samples = (s / DT_S).round() as usize;
        plan.inlet.extend(std::iter::repeat_n(inlet, samples));
        plan.outlet.extend(std::iter::repeat_n(outlet, samples));
    }
    plan
}

/// Candidates in which the muscle moves freely.
fn free() -> Vec<Candidate> {
    let repeat = |piece: &[(f64, f64, f64)], times: usize| piece.repeat(times);
    let mut ramps: Vec<(f64, f64, f64)> = Vec::new();
    for opening in [0.125, 0.5, 1.0] {
        ramps.extend([(opening, 0.0, 6.0), (0.0, opening, 6.0)]);
    }
    let mut loops = repeat(&[(0.02, 0.0, 5.0), (0.0, 0.02, 5.0)], 3);
    loops.extend(repeat(&[(1.0, 0.0, 0.3), (0.0, 1.0, 0.4)], 40));
    let mut minor = vec![(0.5, 0.0, 0.4)];
    minor.extend(repeat(
        &[(0.25, 0.0, 0.25), (0.0, 0.0, 0.3), (0.0, 0.25, 0.35), (0.0, 0.0, 0.3)],
        40,
    ));
    let rest = (0.0, 0.0, 4.0);
    let dwells = repeat(&[(1.0, 0.0, 0.15), rest, (1.0, 0.0, 0.3), rest, (0.0, 1.0, 1.0), rest], 4);
    let mut chirp = Vec::new();
    let mut half_s: f64 = 2.0;
    while half_s > 0.06 {
        chirp.extend([(0.5, 0.0, half_s), (0.0, 0.5, 1.15 * half_s)]);
        half_s *= 0.9;
    }
    let arbitrary = || TrialPlan::arbitrary(8, 3);
    let slow_fast = "Half a minute of slow loops, half a minute of fast ones.";
    let minor_how = "Small loops around the middle of the stroke.";
    let steps = "Steps, each followed by four seconds with both valves shut.";
    let dimmed = "Repeat an arbitrary trial with the excitation at 0.7 of its value.";
    vec![
        ("ramps", "Fill and vent at three openings.", 0.25, pieces(&ramps)),
        ("arbitrary", "One minute of random segments.", 0.25, arbitrary()),
        ("slow_fast_loops", slow_fast, 0.25, pieces(&loops)),
        ("minor_loops", minor_how, 0.25, pieces(&minor)),
        ("steps_with_dwells", steps, 0.25, pieces(&dwells)),
        ("chirp", "Filling and venting in turn, ever faster.", 0.25, pieces(&chirp)),
        ("excitation_0.7", dimmed, 0.5, TrialPlan { excitation: 0.7, ..arbitrary() }),
    ]
}

/// Candidates at lengths that are imposed from outside, for a length that goes from `stroke.0` to `stroke.1` mm.
fn held(stroke: (f64, f64)) -> Vec<Candidate> {
    let at = |share: f64| stroke.0 + share * (stroke.1 - stroke.0);
    let seconds = |s: f64| (s / DT_S) as usize;
    let hold = |length_mm: Vec<f64>| TrialPlan {
        inlet: vec![0.0; length_mm.len()],
        outlet: vec![0.0; length_mm.len()],
        set_length_mm: Some(length_mm),
        ..pieces(&[])
    };
    let mut clamped = hold(vec![at(0.5); seconds(40.0)]);
    for (i, (inlet, outlet)) in clamped.inlet.iter_mut().zip(&mut clamped.outlet).enumerate() {
        let fills = (i / seconds(5.0)).is_multiple_of(2);
        *if fills { inlet } else { outlet } = 0.1;
    }
    // Each of three blocks takes ten seconds, and the way from one block to the next three seconds.
    let block = |i: usize| {
        let (block, s) = (i / seconds(13.0), (i % seconds(13.0)) as f64 * DT_S);
        at(0.1 + 0.4 * (block as f64 + ((s - 10.0) / 3.0).max(0.0)))
    };
    let blocks = hold((0..seconds(36.0)).map(block).collect());
    // The shunt is off, on, and off again.
    let share = |i: usize| if (seconds(2.0)..seconds(6.0)).contains(&i) { SHUNT } else { 0.0 };
    let shunt = Some((0..seconds(8.0)).map(share).collect());
    let shunt = TrialPlan { shunt, ..hold(vec![at(1.0); seconds(8.0)]) };
    let clamp = "Clamp the crossbeam at half its stroke and sweep the pressure.";
    let set =
        "Set three lengths with gauge blocks, which replace the potentiometer as the reference.";
    let switch =
        "At rest, switch a shunt across the bridge on and off: only electrical effects respond.";
    let leave = "Leave the rig alone for two minutes with the bridge powered: what changes does not come from motion.";
    vec![
        ("clamped_pressure", clamp, 2.0, clamped),
        ("gauge_blocks", set, 3.0, blocks),
        ("shunt_step", switch, 1.0, shunt),
        ("rest", leave, 0.0, hold(vec![at(1.0); seconds(120.0)])),
    ]
}

impl RigSimulator {
    /// Every recorded channel of an experiment, in units of its noise.
    fn prediction(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, ProblemError> {
        let plan = TrialPlan::from_trial(trial, &self.base)?;
        let mut params = TunedRig::of(&self.base, &self.tuned, model).params;
        let effects = self.bench.unrecorded(model)?;
        params[Key::VExc] *= plan.excitation;
        let openings = Openings { inlet: &plan.inlet, outlet: &plan.outlet };
        let mut out = [(); 3].map(|()| vec![0.0; trial.len()]);
        let [pressure_kpa, length_mm, bridge_v] = &mut out;
        let recorded = Recorded { pressure_kpa, length_mm, bridge_v };
        let chain = Chain::new(&params, &effects, DT_S, STEP_S)?;
        let (memory, start) = (&mut chain.memory(), Start::Settled);
        match &plan.set_length_mm {
            None => chain.run(memory, start, 0.0, openings, 0.0, recorded)?,
            Some(length_mm) => {
                let setting = Setting { length_mm, shunt: plan.shunt.as_deref().unwrap_or(&[]) };
                let held = Held::new(&params, &effects, DT_S, STEP_S)?;
                held.run(memory, (start, 0.0), openings, setting, 0.0, recorded)?;
            }
        }
        let has_pressure = self.bench.columns.of(PRESSURE).is_some();
        let sds = [1e-3 * params[Key::SigmaP], params[Key::SigmaL], params[Key::SigmaV]];
        for (values, sd) in out.iter_mut().zip(sds) {
            values.iter_mut().for_each(|x| *x /= sd);
        }
        Ok(out.into_iter().skip(usize::from(!has_pressure)).collect())
    }
}

impl Laboratory for RigSimulator {
    fn experiments(&self) -> Vec<Plan> {
        let all = free().into_iter().chain(held(self.inputs.stroke));
        let plan = |(name, how, prepare_min, plan): Candidate| Plan {
            how: how.to_owned(),
            prepare_min,
            trial: trial(name, plan),
        };
        all.map(plan).collect()
    }

    /// Returns an arbitrary trial, which represents the recorded session.
    fn done(&self) -> Trial {
        trial("done", TrialPlan::arbitrary(9, 3))
    }

    fn predict(&self, model: &Model, trial: &Trial) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, trial)?)
    }
}

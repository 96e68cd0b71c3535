//! Candidate experiments on the rig, and the channels that a model predicts for each.

use stretch_data::{Channel, Trial, TrialKind};
use stretch_gap::{GapError, Laboratory, Model, Plan};
use stretch_sim::{
    Chain, DEFAULT_STEP_S, Grid, Key, Openings, RATE_HZ, Recorded, Reference, RigStage, Sensing,
    Start, TrialPlan,
};

use super::{RigSimulator, nominal::TunedRig, session::VALVES};
use crate::error::ProblemError;

/// Sample time of an experiment, s.
const DT_S: f64 = 1.0 / RATE_HZ;
/// Step of integration, s: four times the usual one, because differences between alternatives need few digits.
const STEP_S: f64 = 4.0 * DEFAULT_STEP_S;
/// Share by which the shunt changes the bridge's trim.
const SHUNT: f64 = 0.02;

/// An experiment on the rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Instructions, in a sentence.
    how: &'static str,
    /// Time to prepare the experiment, minutes.
    prepare_min: f64,
    /// Commands, and the length if it is set from outside; the name is that of the candidate.
    plan: TrialPlan,
    /// Pressure at a length that is set from outside, kPa.
    pressure_kpa: Vec<f64>,
}

impl Experiment {
    fn plan(&self) -> Plan {
        let TrialPlan { file, inlet, outlet, .. } = &self.plan;
        let valves = VALVES.into_iter().zip([inlet, outlet]);
        let valves =
            valves.map(|(name, values)| Channel { name: name.into(), values: values.clone() });
        let trial = Trial {
            name: file.clone(),
            time_s: (0..inlet.len()).map(|i| i as f64 / RATE_HZ).collect(),
            channels: valves.chain(self.plan.more_columns()).collect(),
        };
        let (name, how) = (file.clone(), self.how.to_owned());
        Plan { name, how, prepare_min: self.prepare_min, trial }
    }

    fn of(plan: TrialPlan, name: &str, how: &'static str, prepare_min: f64) -> Self {
        let plan = TrialPlan { file: name.to_owned(), ..plan };
        Self { how, prepare_min, plan, pressure_kpa: Vec::new() }
    }

    /// An experiment of pieces of (inlet, outlet, seconds), after a second of rest.
    fn pieces(name: &str, how: &'static str, pieces: &[(f64, f64, f64)]) -> Self {
        let mut plan = TrialPlan::new(name.to_owned(), TrialKind::Other, 1.0);
        for &(inlet, outlet, s) in pieces {
            let samples = (s / DT_S).round() as usize;
            plan.inlet.extend(std::iter::repeat_n(inlet, samples));
            plan.outlet.extend(std::iter::repeat_n(outlet, samples));
        }
        Self { how, prepare_min: 0.25, plan, pressure_kpa: Vec::new() }
    }

    /// An experiment at lengths (mm) that are set from outside, without pressure.
    fn held(name: &str, how: &'static str, prepare_min: f64, length_mm: Vec<f64>) -> Self {
        let samples = length_mm.len();
        let plan = TrialPlan {
            inlet: vec![0.0; samples],
            outlet: vec![0.0; samples],
            set_length_mm: Some(length_mm),
            ..TrialPlan::new(name.to_owned(), TrialKind::Other, 0.0)
        };
        Self { how, prepare_min, plan, pressure_kpa: vec![0.0; samples] }
    }

    /// The candidates for a rig whose length goes from `stroke.0` to `stroke.1` mm and whose supply is at `supply_kpa`.
    fn all(stroke: (f64, f64), supply_kpa: f64) -> Vec<Self> {
        let at = |share: f64| stroke.0 + share * (stroke.1 - stroke.0);
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
        let dwells = repeat(
            &[
                (1.0, 0.0, 0.15),
                (0.0, 0.0, 4.0),
                (1.0, 0.0, 0.3),
                (0.0, 0.0, 4.0),
                (0.0, 1.0, 1.0),
                (0.0, 0.0, 4.0),
            ],
            4,
        );
        let mut chirp = Vec::new();
        let mut half_s: f64 = 2.0;
        while half_s > 0.06 {
            chirp.extend([(0.5, 0.0, half_s), (0.0, 0.5, 1.15 * half_s)]);
            half_s *= 0.9;
        }
        let seconds = |s: f64| (s / DT_S) as usize;
        let sweep: Vec<f64> = (0..seconds(40.0))
            .map(|i| {
                let turn = (i as f64 * DT_S / 10.0).fract();
                supply_kpa * (1.0 - (2.0 * turn - 1.0).abs())
            })
            .collect();
        let mut clamped = Self::held(
            "clamped_pressure",
            "Clamp the crossbeam at half its stroke and sweep the pressure.",
            2.0,
            vec![at(0.5); sweep.len()],
        );
        clamped.pressure_kpa = sweep;
        let TrialPlan { inlet, outlet, .. } = &mut clamped.plan;
        for (i, (inlet, outlet)) in inlet.iter_mut().zip(outlet).enumerate() {
            let fills = (i / seconds(5.0)).is_multiple_of(2);
            *if fills { inlet } else { outlet } = 0.1;
        }
        // Each of three blocks takes ten seconds, and the way from one block to the next three seconds.
        let blocks: Vec<f64> = (0..seconds(36.0))
            .map(|i| {
                let (block, s) = (i / seconds(13.0), (i % seconds(13.0)) as f64 * DT_S);
                at(0.1 + 0.4 * (block as f64 + ((s - 10.0) / 3.0).max(0.0)))
            })
            .collect();
        let blocks = Self::held(
            "gauge_blocks",
            "Set three lengths with gauge blocks, which replace the potentiometer as the reference.",
            3.0,
            blocks,
        );
        let mut shunt = Self::held(
            "shunt_step",
            "At rest, switch a shunt across the bridge on and off: only electrical effects respond.",
            1.0,
            vec![at(1.0); seconds(8.0)],
        );
        // The shunt is off, on, and off again.
        let share = |i: usize| if (seconds(2.0)..seconds(6.0)).contains(&i) { SHUNT } else { 0.0 };
        shunt.plan.shunt = Some((0..seconds(8.0)).map(share).collect());
        let rest = Self::held(
            "rest",
            "Leave the rig alone for two minutes with the bridge powered: what changes does not come from motion.",
            0.0,
            vec![at(1.0); seconds(120.0)],
        );
        let mut low = Self::of(
            TrialPlan::arbitrary(8, 3),
            "excitation_0.7",
            "Repeat an arbitrary trial with the excitation at 0.7 of its value.",
            0.5,
        );
        low.plan.excitation = 0.7;
        vec![
            Self::pieces("ramps", "Fill and vent at three openings.", &ramps),
            Self::of(
                TrialPlan::arbitrary(8, 3),
                "arbitrary",
                "One minute of random segments.",
                0.25,
            ),
            Self::pieces(
                "slow_fast_loops",
                "Half a minute of slow loops, half a minute of fast ones.",
                &loops,
            ),
            Self::pieces("minor_loops", "Small loops around the middle of the stroke.", &minor),
            Self::pieces(
                "steps_with_dwells",
                "Steps, each followed by four seconds with both valves shut.",
                &dwells,
            ),
            Self::pieces("chirp", "Filling and venting in turn, ever faster.", &chirp),
            clamped,
            low,
            blocks,
            shunt,
            rest,
        ]
    }
}

impl RigSimulator {
    /// Every recorded channel of an experiment, in units of its noise.
    fn prediction(
        &self,
        model: &Model,
        Experiment { plan, pressure_kpa: set_kpa, .. }: &Experiment,
    ) -> Result<Vec<Vec<f64>>, ProblemError> {
        let mut params = TunedRig::of(&self.base, &self.tuned, model).params;
        let effects = self.bench.unrecorded(model)?;
        params[Key::VExc] *= plan.excitation;
        let mut out = [(); 3].map(|()| vec![0.0; plan.inlet.len()]);
        let [pressure_kpa, length_mm, bridge_v] = &mut out;
        match &plan.set_length_mm {
            None => {
                let chain = Chain::new(&params, &effects, DT_S, STEP_S)?;
                let openings = Openings { inlet: &plan.inlet, outlet: &plan.outlet };
                let recorded = Recorded { pressure_kpa, length_mm, bridge_v };
                chain.run(&mut chain.memory(), Start::Settled, 0.0, openings, 0.0, recorded)?;
            }
            Some(length) => {
                let grid = Grid::samples(DT_S)?;
                let sensing = Sensing::new(&params, &effects, &grid)?;
                let (mut memory, start) = (sensing.memory(), Start::Settled);
                let set = (length.as_slice(), plan.shunt.as_deref().unwrap_or(&[]));
                sensing.run_shunted(&mut memory, start, 0.0, set, set_kpa, bridge_v)?;
                let reference = Reference::new(&params, &effects, &grid)?;
                reference.run(&mut reference.memory(), Start::Settled, length, length_mm)?;
                pressure_kpa.copy_from_slice(set_kpa);
            }
        }
        let has_pressure = self.stage_kinds.contains(&RigStage::Pneumatics);
        let sds = [1e-3 * params[Key::SigmaP], params[Key::SigmaL], params[Key::SigmaV]];
        let channels = out.into_iter().zip(sds).enumerate();
        Ok(channels
            .filter(|(i, _)| *i > 0 || has_pressure)
            .map(|(_, (mut values, sd))| {
                values.iter_mut().for_each(|x| *x /= sd);
                values
            })
            .collect())
    }
}

impl Laboratory for RigSimulator {
    type Setting = Experiment;

    fn experiments(&self) -> Vec<(Plan, Experiment)> {
        let all = Experiment::all(self.inputs.stroke, 1e-3 * self.base[Key::PS]);
        all.into_iter().map(|x| (x.plan(), x)).collect()
    }

    /// Returns an arbitrary trial, which represents the recorded session.
    fn done(&self) -> Experiment {
        Experiment::of(TrialPlan::arbitrary(9, 3), "done", "", 0.0)
    }

    fn predict(&self, model: &Model, experiment: &Experiment) -> Result<Vec<Vec<f64>>, GapError> {
        Ok(self.prediction(model, experiment)?)
    }
}

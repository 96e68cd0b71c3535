//! The rig as a [`Simulator`]: pneumatics, muscle (or both as actuation) and sensing, each on measured inputs.

mod experiments;
mod extent;
mod params;
mod run;
mod session;
pub(crate) mod smooth;

use std::path::Path;

use stretch_data::{DataSet, RigFile};
use stretch_gap::{
    Description, GapError, Motion, ParameterSpec, Run, Simulator, StageSpec, TrialSpec, Wander,
};
use stretch_sim::{Catalogue, Effect, Key, PARAMETERS, RigParams, Search, Stage};

use extent::{extent_of, tuned};
use params::read_params;
use session::Inputs;
pub use session::{RigTrial, Session};

use crate::{
    error::BenchError,
    specs::{Place, spec},
};

/// Slow fluctuation of the supply, a share of it (1 sd).
const SUPPLY_WANDER: f64 = 0.003;
/// Its correlation time, s.
const SUPPLY_CORRELATION_S: f64 = 12.0;
/// Distance of the knots that follow it, s.
const SUPPLY_KNOT_S: f64 = 2.0;

/// A whole rig beside its recorded session.
#[derive(Debug)]
pub struct RigSimulator {
    base: RigParams,
    session: Session,
    inputs: Inputs,
    about: Description,
    stage_kinds: Vec<Stage>,
    /// Key of each parameter; none for the pressure at a trial's start.
    keys: Vec<Option<Key>>,
    rows: Vec<&'static Effect>,
    measured: Vec<Vec<f64>>,
}

impl RigSimulator {
    /// Reads a data set's folder: its trials, and its rig file unless another is given.
    ///
    /// # Errors
    /// As [`Session::read`] and [`RigSimulator::new`].
    pub fn read(
        folder: &Path,
        rig: Option<&RigFile>,
        catalogue: &Catalogue,
    ) -> Result<Self, BenchError> {
        let set = DataSet::read(folder)?;
        let own = set.read_rig(folder)?;
        let session = Session::read(folder, &set)?;
        Self::new(session, rig.or(own.as_ref()), catalogue)
    }

    /// Binds a rig to a session; the effects of `catalogue` are looked for.
    ///
    /// # Errors
    /// Names in the rig file that nobody knows.
    pub fn new(
        session: Session,
        rig: Option<&RigFile>,
        catalogue: &Catalogue,
    ) -> Result<Self, BenchError> {
        let (base, tolerances) = read_params(rig)?;
        let has_pressure = session.trials[0].pressure_kpa.is_some();
        let step = base[Key::Travel] / (base[Key::Bits].exp2() - 1.0);
        let length_sd = (base[Key::SigmaL].powi(2) + step * step / 12.0).sqrt();
        let step = base[Key::VFs] / (base[Key::Bits].exp2() - 1.0);
        let volts_sd = (base[Key::SigmaV].powi(2) + step * step / 12.0).sqrt();
        let pressure_sd = 1e-3 * base[Key::SigmaP];
        let inputs = Inputs::of(&session, length_sd, pressure_sd, 1e-3 * base[Key::PS]);
        let stage_kinds = if has_pressure {
            vec![Stage::Pneumatics, Stage::Muscle, Stage::Sensing]
        } else {
            vec![Stage::Actuation, Stage::Sensing]
        };
        let mut parameters = Vec::new();
        let mut keys = Vec::new();
        for info in &PARAMETERS {
            let sd = tolerances[info.key as usize];
            if sd <= 0.0 || !stage_kinds.iter().any(|s| s.holds(info.stage)) {
                continue;
            }
            let nominal = base[info.key];
            let wander = (info.key == Key::PS).then_some(Wander {
                sd: SUPPLY_WANDER * nominal,
                correlation_s: SUPPLY_CORRELATION_S,
                knot_s: SUPPLY_KNOT_S,
            });
            parameters.push(ParameterSpec {
                name: info.name.into(),
                unit: info.unit.into(),
                nominal,
                sd,
                least: 0.15 * nominal,
                wander,
                per_trial_sd: None,
                // These three stand in for one another in the nominal rig.
                is_evidence: !matches!(info.key, Key::E0 | Key::R0 | Key::VExc | Key::G),
            });
            keys.push(Some(info.key));
        }
        parameters.push(ParameterSpec {
            name: "p_start".into(),
            unit: "1".into(),
            nominal: 0.0,
            sd: 0.0,
            least: f64::NEG_INFINITY,
            wander: None,
            per_trial_sd: Some(1.0),
            is_evidence: false,
        });
        keys.push(None);
        let stages: Vec<StageSpec> = stage_kinds
            .iter()
            .map(|&kind| {
                let (channel, unit, noise) = match kind {
                    Stage::Pneumatics => ("pressure_kpa", "kPa", pressure_sd),
                    Stage::Sensing => ("bridge_v", "V", volts_sd),
                    _ => ("length_mm", "mm", length_sd),
                };
                let own = |key: Key| tuned(kind).any(|k| k == key);
                let is_chamber = kind.holds(Stage::Pneumatics);
                let acting = (0..keys.len()).filter(|&i| keys[i].map_or(is_chamber, own)).collect();
                StageSpec {
                    name: kind.name().into(),
                    channel: channel.into(),
                    unit: unit.into(),
                    parameters: acting,
                    noise: (noise > 0.0).then_some(noise),
                }
            })
            .collect();
        let index = |stage: Stage| -> Vec<usize> {
            (0..stage_kinds.len())
                .filter(|&i| {
                    stage_kinds[i].holds(stage)
                        || (stage == Stage::Reference && stage_kinds[i] != Stage::Pneumatics)
                })
                .collect()
        };
        let extent = extent_of(&base, &inputs, &session);
        let rows: Vec<_> = catalogue.iter().collect();
        let place = |effect: &Effect| Place {
            touches: index(effect.stage),
            search: Search::of(effect, &extent),
            unit: |_| 1.0,
        };
        let effects = rows.iter().map(|effect| spec(effect, place(effect))).collect();
        let trials = session
            .trials
            .iter()
            .map(|t| TrialSpec {
                name: t.name.clone(),
                samples: t.length_mm.len(),
                start_s: t.start_s,
                is_test: t.is_test,
            })
            .collect();
        let measured = stage_kinds
            .iter()
            .map(|kind| {
                let mut all = Vec::new();
                for trial in &session.trials {
                    all.extend_from_slice(match kind {
                        Stage::Pneumatics => trial.pressure_kpa.as_deref().unwrap_or(&[]),
                        Stage::Sensing => &trial.bridge_v,
                        _ => &trial.length_mm,
                    });
                }
                all
            })
            .collect();
        let dt_s = session.trials[0].dt_s;
        let about = Description { stages, parameters, effects, trials, dt_s };
        Ok(Self { base, session, inputs, about, stage_kinds, keys, rows, measured })
    }

    /// The session that it is bound to.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Nominal parameters as shipped.
    pub fn nominal(&self) -> &RigParams {
        &self.base
    }

    /// Measured inputs, smoothed as the stages see them: length (mm) of a trial.
    pub fn smooth_length(&self, trial: usize) -> &[f64] {
        &self.inputs.length[trial].values
    }
}

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        &self.measured[stage]
    }

    fn wander_clock(&self, parameter: usize) -> Option<Vec<u32>> {
        if self.keys[parameter] != Some(Key::PS) {
            return None;
        }
        // The supply reaches the chamber through the inlet only: while it is shut, the clock stands still.
        let mut clock = Vec::new();
        for trial in &self.session.trials {
            let mut last = 0;
            for (i, opening) in trial.inlet.iter().enumerate() {
                if *opening > 0.0 {
                    last = i as u32;
                }
                clock.push(last);
            }
        }
        Some(clock)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(run::simulate(self, run, None, out)?)
    }

    fn motion(&self) -> Motion<'_> {
        let stage = self.stages().iter().position(|s| s.channel == "length_mm").unwrap_or(0);
        Motion {
            values: &self.measured[stage],
            unit: "mm",
            falling: "inflation",
            rising: "deflation",
        }
    }

    fn sensor(&self) -> Option<usize> {
        self.stage_kinds.iter().position(|kind| *kind == Stage::Sensing)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        let smooth = match self.stage_kinds[stage] {
            Stage::Muscle => &self.inputs.pressure,
            Stage::Sensing => &self.inputs.length,
            _ => return None,
        };
        Some(smooth.iter().flat_map(|s| &s.values).copied().collect())
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        if self.input(run.stage).is_none() {
            return Ok(false);
        }
        run::simulate(self, run, Some(input), out)?;
        Ok(true)
    }
}

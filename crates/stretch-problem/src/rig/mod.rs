//! The rig as a [`Simulator`](stretch_gap::Simulator): pneumatics, muscle (or both as actuation)
//! and sensing, each on measured inputs.

mod cache;
mod directions;
mod experiments;
mod facts;
mod fixed;
mod noises;
mod nominal;
mod rails;
mod record_columns;
mod reference_sensor;
mod run;
mod session;
mod simulator;
pub(crate) mod smooth;
mod stand_ins;
mod timing;

use std::path::Path;

use stretch_data::DataSet;
use stretch_gap::{Description, DescriptionSpec, TrialSpec};
use stretch_recording::ReadOptions;
use stretch_sim::{
    Bridge, Catalogue, Effect, EffectSet, Extent, Key, Place as EffectPlace, Rig, RigParams,
    RigStage, Search, Tolerance,
};

use cache::RigCache;
use facts::facts;
use noises::Noises;
use nominal::{TunedParameter, parameters, stages};
use session::Inputs;
pub use session::{RigSession, RigTrial};

use crate::{
    bench::{
        acting::FitRecord,
        rig_file,
        specs::{Place, shown, spec},
    },
    error::ProblemError,
};

/// The data from which a [`RigSimulator`] is built.
#[derive(Debug, Clone)]
pub struct RigSetup<'a> {
    /// The measured session.
    pub session: RigSession,
    /// The rig: parameters with tolerances, and the effects that the rig already has.
    pub rig: Rig,
    /// Effects that are looked for; effects that the rig already has are left out.
    pub catalogue: &'a Catalogue,
}

/// A whole rig with its recorded session.
#[derive(Debug, Clone)]
pub struct RigSimulator {
    base: RigParams,
    tolerances: [Tolerance; Key::COUNT],
    /// Effects that the rig already has.
    effects: EffectSet,
    session: RigSession,
    inputs: Inputs,
    noises: Noises,
    about: Description,
    stage_kinds: Vec<RigStage>,
    /// What each parameter of the diagnosis sets.
    tuned: Vec<TunedParameter>,
    rows: Vec<&'static Effect>,
    measured: Vec<Vec<f64>>,
    /// The samples of the bridge voltage from which effects may be estimated.
    bridge: FitRecord,
    found: RigCache,
    notes: Vec<String>,
}

impl RigSimulator {
    /// Reads a data set's folder: its trials, and its rig file unless another is given.
    ///
    /// # Errors
    /// A rig file that cannot be read, and as [`RigSession::read`] and [`RigSimulator::new`].
    pub fn read(
        folder: &Path,
        rig: Option<&Path>,
        catalogue: &Catalogue,
        recorded: ReadOptions,
    ) -> Result<Self, ProblemError> {
        let set = DataSet::read(folder)?;
        let own = set.rig.as_ref().map(|file| folder.join(file));
        let rig = rig.or(own.as_deref()).map(rig_file::rig).transpose()?.unwrap_or_default();
        let session = RigSession::read(folder, &set, recorded)?;
        Self::new(RigSetup { session, rig, catalogue })
    }

    /// Binds a rig to a session. The effects of the rig act in every run and are not looked for.
    ///
    /// # Errors
    /// A rig with a value outside of its limits.
    pub fn new(setup: RigSetup<'_>) -> Result<Self, ProblemError> {
        let RigSetup { session, rig, catalogue } = setup;
        rig.check()?;
        let Rig { params: base, effects, .. } = &rig;
        let noises = Noises::of(base, &session);
        let (length_sd, pressure_sd) = (noises.length_mm.sd(), noises.pressure_kpa.sd());
        let inputs = Inputs::of(&session, length_sd, pressure_sd, 1e-3 * base[Key::PS]);
        let stage_kinds = match session.trials[0].pressure_kpa {
            Some(_) => vec![RigStage::Pneumatics, RigStage::Muscle, RigStage::Sensing],
            None => vec![RigStage::Actuation, RigStage::Sensing],
        };
        let (parameters, tuned) = parameters(&rig, &stage_kinds);
        let stages = stages(&stage_kinds, &tuned, &noises);
        let dt_s = session.dt_s();
        let trials: Vec<_> = session.trials.iter().map(trial_spec).collect();
        let measured: Vec<_> = stage_kinds.iter().map(|kind| measured(&session, *kind)).collect();
        let bridge = FitRecord::of(&trials, measured.last().map_or(&[], Vec::as_slice), dt_s);
        let extents = Extents::of(base, &inputs, &bridge);
        let place = |effect: &Effect| Place {
            touches: touched(&stage_kinds, effect.stage),
            search: Search::of(effect, extents.at(effect)),
            unit: |_| 1.0,
        };
        let missing = catalogue.iter().filter(|e| effects.find(e.name).is_none());
        let mut notes = session.notes.clone();
        let (rows, places) = shown(missing.map(|e| (e, place(e))), dt_s, &mut notes);
        let missing = rows.iter().zip(places).map(|(effect, place)| spec(effect, place)).collect();
        let about = DescriptionSpec { stages, parameters, effects: missing, trials, dt_s };
        let about = Description::new(about)?;
        let known = facts(&about, &session, &inputs, (&stage_kinds, &tuned), &measured);
        Ok(Self {
            about: about.with_record(known)?,
            base: *base,
            tolerances: rig.tolerances,
            effects: effects.clone(),
            session,
            inputs,
            noises,
            stage_kinds,
            tuned,
            rows,
            measured,
            bridge,
            found: RigCache::new(),
            notes,
        })
    }

    /// The session that it is bound to.
    pub fn session(&self) -> &RigSession {
        &self.session
    }

    /// Notes on the session, and on effects that it cannot show, in sentences for a report.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Nominal parameters as shipped.
    pub fn nominal(&self) -> &RigParams {
        &self.base
    }
}

/// Indices of the stages whose output an effect of `stage` changes.
fn touched(kinds: &[RigStage], stage: RigStage) -> Vec<usize> {
    let shows = |kind: RigStage| stage == RigStage::Reference && kind != RigStage::Pneumatics;
    (0..kinds.len()).filter(|&i| kinds[i].holds(stage) || shows(kinds[i])).collect()
}

fn trial_spec(trial: &RigTrial) -> TrialSpec {
    TrialSpec {
        name: trial.name.clone(),
        samples: trial.length_mm.len(),
        start_s: trial.start_s,
        is_test: trial.is_test,
    }
}

/// The measured output of a stage, all trials end to end.
fn measured(session: &RigSession, stage: RigStage) -> Vec<f64> {
    let channel = |trial: &'_ RigTrial| match stage {
        RigStage::Pneumatics => trial.pressure_kpa.clone().unwrap_or_default(),
        RigStage::Sensing => trial.bridge_v.clone(),
        _ => trial.length_mm.clone(),
    };
    session.trials.iter().flat_map(channel).collect()
}

/// Share of the samples at either end of the voltage that are left out as noise.
const OUTERMOST: f64 = 0.002;

/// Range of the voltage over the fit samples, and range of the strain over all trials.
struct Extents {
    volts: Extent,
    strain: Extent,
}

impl Extents {
    fn of(params: &RigParams, inputs: &Inputs, bridge: &FitRecord) -> Self {
        let mut volts: Vec<f64> = bridge.samples().collect();
        volts.sort_by(f64::total_cmp);
        let at = |q: f64| volts[(q * (volts.len() - 1) as f64) as usize];
        let strain = Bridge::new(params).strain(inputs.stroke.0);
        Self {
            volts: Extent::between(at(OUTERMOST), at(1.0 - OUTERMOST)),
            strain: Extent::between(strain, params[Key::E0]),
        }
    }

    /// The range of the channel that an effect acts on.
    fn at(&self, effect: &Effect) -> &Extent {
        match effect.at() {
            Some((_, EffectPlace::Volts)) => &self.volts,
            _ => &self.strain,
        }
    }
}

//! The rig as a [`Simulator`](stretch_gap::Simulator): pneumatics, muscle (or both as actuation)
//! and sensing, each on measured inputs.

pub(crate) mod cache;
mod directions;
mod experiments;
mod facts;
mod fixed;
mod noises;
mod nominal;
mod run;
mod session;
mod stand_ins;
mod timing;

use std::path::Path;

use stretch_calibrate::PRESSURE;
use stretch_data::DataSet;
use stretch_gap::{Description, Distortion, GapError, Line, Model, Run, Simulator};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::{
    Bridge, Catalogue, Effect, Extent, Key, Place as EffectPlace, Rig, RigParams, RigStage, Search,
    Tolerance,
};

use cache::RigCache;
use facts::facts;
use noises::Noises;
use nominal::{TunedParameter, parameters, stages};
pub use session::RigSession;
use session::{Inputs, LENGTH, NEEDED, VOLTAGE};

use crate::{
    bench::{
        Bench, Place, columns::Columns, rails::leave_out_rails, read_rig, smooth::MeasuredInput,
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
    bench: Bench,
    base: RigParams,
    tolerances: [Tolerance; Key::COUNT],
    /// By trial, the excitation of the bridge as a share of the nominal one.
    excitation: Vec<f64>,
    inputs: Inputs,
    noises: Noises,
    stage_kinds: Vec<RigStage>,
    /// What each parameter of the diagnosis sets.
    tuned: Vec<TunedParameter>,
    found: RigCache,
}

impl RigSimulator {
    /// Reads a data set's folder: its trials, and its rig file unless another is given.
    ///
    /// # Errors
    /// Files that cannot be read, and as [`RigSession::new`] and [`RigSimulator::new`].
    pub fn read(
        folder: &Path,
        rig: Option<&Path>,
        catalogue: &Catalogue,
        recorded: ReadOptions,
    ) -> Result<Self, ProblemError> {
        let set = DataSet::read(folder)?;
        let own = set.rig.as_ref().map(|file| folder.join(file));
        let rig = rig
            .or(own.as_deref())
            .map(|path| read_rig(path, Rig::from_file))
            .transpose()?
            .unwrap_or_default();
        let options = NEEDED.iter().fold(recorded, |options, name| options.require(*name));
        let session = RigSession::new(&Recording::session(&set, folder, &options)?)?;
        Self::new(RigSetup { session, rig, catalogue })
    }

    /// Binds a rig to a session. The effects of the rig act in every run and are not looked for.
    ///
    /// # Errors
    /// A rig with a value outside of its limits.
    pub fn new(setup: RigSetup<'_>) -> Result<Self, ProblemError> {
        let RigSetup { session: RigSession { mut columns, excitation }, rig, catalogue } = setup;
        rig.check()?;
        let noise = |key: Key| rig.params[key];
        let recorders = [
            (VOLTAGE, noise(Key::SigmaV)),
            (LENGTH, noise(Key::SigmaL)),
            (PRESSURE, 1e-3 * noise(Key::SigmaP)),
        ];
        recorders.into_iter().for_each(|(name, sd)| leave_out_rails(&mut columns, name, sd));
        let noises = Noises::of(&rig.params, &columns);
        let inputs = Inputs::of(&columns, &noises, None, 1e-3 * rig.params[Key::PS]);
        let stage_kinds = match inputs.pressure {
            Some(_) => vec![RigStage::Pneumatics, RigStage::Muscle, RigStage::Sensing],
            None => vec![RigStage::Actuation, RigStage::Sensing],
        };
        let (parameters, tuned) = parameters(&rig, &stage_kinds, columns.trials.len());
        let stages = stages(&stage_kinds, &tuned, &noises);
        let [strain, volts] = extents(&rig.params, &inputs, &columns);
        let place = |effect: &'static Effect| {
            let is_of_volts = matches!(effect.at(), Some((_, EffectPlace::Volts)));
            let search = Search::of(effect, if is_of_volts { &volts } else { &strain });
            (effect, Place { touches: touched(&stage_kinds, effect.stage), search, unit: |_| 1.0 })
        };
        let (candidates, sensor) = (catalogue.iter().map(place), (noises.volts.sd(), 1.0));
        let Rig { params: base, tolerances, effects } = rig;
        let described = (stages, parameters);
        let known = |bench: &Bench| facts(bench, &inputs, (&stage_kinds, &tuned));
        let bench = Bench::new(described, columns, effects, candidates, sensor, known)?;
        Ok(Self {
            bench,
            base,
            tolerances,
            excitation,
            inputs,
            noises,
            stage_kinds,
            tuned,
            found: RigCache::new(cache::MOST),
        })
    }

    /// Nominal parameters as shipped.
    pub fn nominal(&self) -> &RigParams {
        &self.base
    }
}

impl Simulator for RigSimulator {
    fn description(&self) -> &Description {
        &self.bench.about
    }

    fn measured(&self, stage: usize) -> &[f64] {
        self.bench.measured(stage)
    }

    fn simulate(&self, run: Run<'_>, out: &mut [f64]) -> Result<(), GapError> {
        Ok(run::simulate(self, run, None, out)?)
    }

    fn input(&self, stage: usize) -> Option<Vec<f64>> {
        match self.stage_kinds[stage] {
            RigStage::Muscle => self.inputs.pressure.as_ref().map(MeasuredInput::values),
            RigStage::Sensing => Some(self.inputs.length.values()),
            _ => None,
        }
    }

    fn simulate_on(&self, run: Run<'_>, input: &[f64], out: &mut [f64]) -> Result<bool, GapError> {
        if self.input(run.stage).is_none() {
            return Ok(false);
        }
        run::simulate(self, run, Some(input), out)?;
        Ok(true)
    }

    fn corrected(
        &self,
        column: &str,
        error: Distortion,
    ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
        let rig = self.with_corrected(column, error);
        Ok(rig.map(|rig| Box::new(rig) as Box<dyn Simulator + Send>))
    }

    fn lines(&self, stage: usize, model: &Model) -> Vec<Line> {
        if stage == self.bench.sensor { self.bench.lines(model) } else { Vec::new() }
    }
}

/// Indices of the stages whose output an effect of `stage` changes.
fn touched(kinds: &[RigStage], stage: RigStage) -> Vec<usize> {
    let shows = |kind: RigStage| stage == RigStage::Reference && kind != RigStage::Pneumatics;
    (0..kinds.len()).filter(|&i| kinds[i].holds(stage) || shows(kinds[i])).collect()
}

/// Share of the samples at either end of the voltage that are left out as noise.
const OUTERMOST: f64 = 0.002;

/// Range of the strain over all trials, and range of the voltage over the fit samples.
fn extents(params: &RigParams, inputs: &Inputs, columns: &Columns) -> [Extent; 2] {
    let all = columns.all(VOLTAGE);
    let mut volts: Vec<f64> = columns.fitted().flat_map(|r| &all[r]).copied().collect();
    volts.sort_by(f64::total_cmp);
    let at = |q: f64| volts[(q * (volts.len() - 1) as f64) as usize];
    let strain = Bridge::new(params).strain(inputs.stroke.0);
    [Extent::between(strain, params[Key::E0]), Extent::between(at(OUTERMOST), at(1.0 - OUTERMOST))]
}

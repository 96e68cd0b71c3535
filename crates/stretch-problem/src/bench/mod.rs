//! Parts that a whole rig and a gauge alone share: recordings on one grid, smoothed inputs, effects of the catalogue, and
//! the results of a diagnosis.

mod acting;
mod built_in;
pub(crate) mod columns;
pub(crate) mod courses;
mod isolated_outliers;
pub(crate) mod rails;
pub(crate) mod shortened;
pub(crate) mod smooth;
mod specs;

use std::path::Path;

use stretch_data::{Channel, RigFile, Trial};
use stretch_gap::{Description, DescriptionSpec, Model, ParameterSpec, RecordFacts, StageSpec};
use stretch_sim::{Effect, EffectSet, Measured, SimError};

use crate::error::ProblemError;
pub(crate) use acting::Acting;
pub(crate) use built_in::BuiltIn;
use columns::Columns;
use specs::shown;
pub(crate) use specs::{Place, skew_of, too_slow};

/// A simulator of the catalogue's effects with its recording.
#[derive(Debug, Clone)]
pub(crate) struct Bench {
    pub(crate) about: Description,
    pub(crate) columns: Columns,
    /// Effects that the simulator already has.
    pub(crate) effects: EffectSet,
    /// The effects that are looked for, in the order of the description.
    pub(crate) rows: Vec<&'static Effect>,
    /// The stage of the sensor.
    pub(crate) sensor: usize,
    /// Noise of the sensor's signal, one standard deviation.
    pub(crate) noise: f64,
    /// Size of the unit of the sensor's effects, in the unit of its signal.
    pub(crate) unit: f64,
}

impl Bench {
    /// Describes a simulator whose last stage is the sensor. The effects that are looked for are the `candidates` that
    /// the simulator does not have and that the recording can show.
    pub(crate) fn new(
        (stages, parameters): (Vec<StageSpec>, Vec<ParameterSpec>),
        mut columns: Columns,
        effects: EffectSet,
        candidates: impl Iterator<Item = (&'static Effect, Place)>,
        (noise, unit): (f64, f64),
        facts: impl FnOnce(&Self) -> RecordFacts,
    ) -> Result<Self, ProblemError> {
        let missing = candidates.filter(|(effect, _)| effects.find(effect.name).is_none());
        let (rows, specs) = shown(missing, columns.dt_s, &mut columns.notes);
        let sensor = stages.len() - 1;
        let (trials, dt_s) = (columns.trials.clone(), columns.dt_s);
        let about = DescriptionSpec { stages, parameters, effects: specs, trials, dt_s };
        let about = Description::new(about)?;
        let own = Self { about, columns, effects, rows, sensor, noise, unit };
        let facts = facts(&own);
        Ok(Self { about: own.about.with_record(facts)?, ..own })
    }

    /// The measured output of a stage, all trials concatenated.
    pub(crate) fn measured(&self, stage: usize) -> &[f64] {
        self.columns.all(&self.about.spec().stages[stage].channel)
    }

    /// The samples of the sensor's signal in one trial from which effects may be estimated.
    pub(crate) fn record(&self, trial: usize) -> Measured<'_> {
        let range = self.columns.fitted().nth(trial).unwrap_or_default();
        let samples = &self.measured(self.sensor)[range];
        Measured { samples, noise: self.noise, unit: self.unit, dt_s: self.columns.dt_s }
    }

    /// The effects of a simulator and of a model without a recording: typical values replace those that would be
    /// estimated from a recording.
    pub(crate) fn unrecorded(&self, model: &Model) -> Result<EffectSet, SimError> {
        let mut effects = self.effects.clone();
        for (index, values) in &model.effects {
            effects.push(self.rows[*index], &self.rows[*index].with_stand_ins(values))?;
        }
        Ok(effects)
    }
}

/// Offset and slope of the straight line of y over x by least squares, from pairs (x, y). The slope is `flat` if x or y
/// never changes.
pub(crate) fn straight_line<I: Iterator<Item = (f64, f64)>>(
    pairs: impl Fn() -> I,
    flat: f64,
) -> (f64, f64) {
    let (n, x, y) = pairs().fold((0.0_f64, 0.0, 0.0), |(n, a, b), (x, y)| (n + 1.0, a + x, b + y));
    let (mean_x, mean_y) = (x / n.max(1.0), y / n.max(1.0));
    let (xx, xy) = pairs().fold((0.0, 0.0), |(xx, xy), (x, y)| {
        (xx + (x - mean_x) * (x - mean_x), xy + (x - mean_x) * (y - mean_y))
    });
    let slope = if xx > 0.0 && xy != 0.0 { xy / xx } else { flat };
    (mean_y - slope * mean_x, slope)
}

/// A trial of named columns with a value every `dt_s` seconds.
pub(crate) fn even_trial(
    name: &str,
    dt_s: f64,
    columns: impl IntoIterator<Item = (String, Vec<f64>)>,
) -> Trial {
    let columns = columns.into_iter().map(|(name, values)| Channel { name, values });
    let channels: Vec<Channel> = columns.collect();
    let (samples, rate_hz) = (channels.first().map_or(0, |c| c.values.len()), 1.0 / dt_s);
    let time_s = (0..samples).map(|i| i as f64 / rate_hz).collect();
    Trial { name: name.to_owned(), time_s, channels }
}

/// Reads a rig file as one kind of rig; an error names the file.
pub(crate) fn read_rig<T>(
    path: &Path,
    read: fn(&RigFile) -> Result<T, SimError>,
) -> Result<T, ProblemError> {
    let refused = |cause| ProblemError::Refused(format!("{}: {cause}", path.display()));
    read(&RigFile::read(path)?).map_err(refused)
}

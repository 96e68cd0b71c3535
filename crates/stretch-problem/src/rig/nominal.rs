//! The parameters of a rig that may be re-tuned, and the stages in which they act.

use stretch_gap::{Model, ParameterSpec, SlowDrift, StageSpec};
use stretch_sim::{Key, PARAMETERS, Rig, RigParams, RigStage};

use super::{
    noises::Noises,
    timing::{self, Leads},
};

/// Usual slow drift of a laboratory's supply (Ornstein-Uhlenbeck), as a share of the supply (1 sd).
/// Regulators hold the supply to a tenth of a per cent to half a per cent.
const SUPPLY_DRIFT: f64 = 0.0025;
/// Correlation time of the supply's drift, s: between the cycle of a compressor, which is slower, and the oscillation
/// of a regulator, which is faster.
const SUPPLY_CORRELATION_S: f64 = 4.0;

/// What a parameter of the diagnosis sets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TunedParameter {
    /// A parameter of the rig.
    Rig(Key),
    /// The pressure at a trial's start.
    StartPressure,
    /// How far ahead of its row every second switch of the commands acts: the even switches (0) or
    /// the odd switches (1).
    CommandLead(usize),
    /// The initial state of a stage's memories, between the state after the motion before and a steady state: at the
    /// first trial (0) or at all later trials (1).
    InitialState(RigStage, usize),
}

/// The parameters of a diagnosis, and what each sets: the rig's parameters with a tolerance in the
/// stages, the pressure at a trial's start, the timing of commands, and the initial hysteresis
/// states.
pub(super) fn parameters(
    rig: &Rig,
    kinds: &[RigStage],
    trials: usize,
) -> (Vec<ParameterSpec>, Vec<TunedParameter>) {
    let parameter = |key: Key| {
        let (info, nominal) = (key.info(), rig.params[key]);
        let drift = (key == Key::PS).then_some(SlowDrift {
            sd: SUPPLY_DRIFT * nominal,
            correlation_s: SUPPLY_CORRELATION_S,
        });
        ParameterSpec {
            least: 0.15 * nominal,
            drift,
            // These four parameters can replace one another in the nominal rig.
            is_evidence: !matches!(key, Key::E0 | Key::R0 | Key::VExc | Key::G),
            ..ParameterSpec::new(info.name, info.unit, nominal)
                .within(rig.tolerances[key as usize].sd(nominal))
        }
    };
    let start = ParameterSpec {
        per_trial_sd: Some(1.0),
        is_evidence: false,
        ..ParameterSpec::new("p_start", "1", 0.0)
    };
    PARAMETERS
        .iter()
        .filter(|info| kinds.iter().any(|kind| kind.holds(info.stage)))
        .map(|info| (parameter(info.key), TunedParameter::Rig(info.key)))
        .filter(|(parameter, _)| parameter.sd > 0.0)
        .chain([(start, TunedParameter::StartPressure)])
        .chain([0, 1].map(|which| (timing::at_rows(which), TunedParameter::CommandLead(which))))
        .chain(kinds.iter().flat_map(|kind| initial_states(kind, trials)))
        .unzip()
}

/// Standard deviation, around 0, of the prior of the share of the steady state in the initial state. A rig in a steady
/// state before the session or before every trial (share 1) is plausible.
const INITIAL_STATE: f64 = 0.4;

/// The initial state of a stage's memories: 0 as after the motion before, 1 as in a steady state where the trial
/// begins. The motion before the first trial came from the other end of the stroke. The chamber has no such
/// parameters, because its pressure is measured.
fn initial_states(kind: &RigStage, trials: usize) -> Vec<(ParameterSpec, TunedParameter)> {
    let names = match kind {
        RigStage::Pneumatics | RigStage::Reference => return Vec::new(),
        RigStage::Sensing => ["initial_gauge", "initial_gauge_later"],
        RigStage::Muscle | RigStage::Actuation => ["initial_muscle", "initial_muscle_later"],
    };
    let one = |(which, name): (usize, &str)| {
        let spec = ParameterSpec {
            least: 0.0,
            is_evidence: false,
            ..ParameterSpec::new(name, "1", 0.0).within(INITIAL_STATE)
        };
        (spec, TunedParameter::InitialState(*kind, which))
    };
    names.into_iter().enumerate().take(trials).map(one).collect()
}

/// Stages with their channels, the parameters that act in them, and their noise.
pub(super) fn stages(
    kinds: &[RigStage],
    parameters: &[TunedParameter],
    noises: &Noises,
) -> Vec<StageSpec> {
    let stage = |kind: &RigStage| {
        let (channel, unit, noise, drift) = match kind {
            RigStage::Pneumatics => {
                ("pressure_kpa", "kPa", &noises.pressure_kpa, noises.pressure_drift)
            }
            RigStage::Sensing => ("bridge_v", "V", &noises.volts, noises.volts_drift),
            _ => ("length_mm", "mm", &noises.length_mm, noises.length_drift),
        };
        // The pressure at a trial's start and the timing of commands belong to the chamber.
        let owner = |parameter: &TunedParameter| match parameter {
            TunedParameter::Rig(key) => key.info().stage,
            TunedParameter::InitialState(stage, _) => *stage,
            TunedParameter::StartPressure | TunedParameter::CommandLead(_) => RigStage::Pneumatics,
        };
        // The slow noise of a measured input reaches the output as well.
        let recorders = if kind.holds(RigStage::Pneumatics) { 1.0_f64 } else { 2.0 };
        StageSpec {
            name: kind.name().into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: (0..parameters.len())
                .filter(|&i| kind.holds(owner(&parameters[i])))
                .collect(),
            noise: (noise.sd() > 0.0).then(|| noise.clone()),
            recorder_drift: drift
                .map(|drift| SlowDrift { sd: drift.sd * recorders.sqrt(), ..drift }),
        }
    };
    kinds.iter().map(stage).collect()
}

/// The parameters of a model, sorted by what they set.
#[derive(Debug, Clone, Copy)]
pub(super) struct TunedRig {
    pub(super) params: RigParams,
    /// Offset of the pressure at a trial's start, standard deviations.
    pub(super) offset: f64,
    /// How far ahead of their rows commands act, samples.
    pub(super) leads: Leads,
    /// Share of the steady state in the initial state of the muscle at the first and at later trials, 0 to 1.
    pub(super) initial_muscle: [f64; 2],
    /// The same of the gauge.
    pub(super) initial_gauge: [f64; 2],
}

impl TunedRig {
    pub(super) fn of(base: &RigParams, parameters: &[TunedParameter], model: &Model) -> Self {
        let mut out = Self {
            params: *base,
            offset: 0.0,
            leads: [0.0; 2],
            initial_muscle: [0.0; 2],
            initial_gauge: [0.0; 2],
        };
        for (parameter, value) in parameters.iter().zip(&model.parameters) {
            let share = value.clamp(0.0, 1.0);
            match parameter {
                TunedParameter::Rig(key) => out.params[*key] = *value,
                TunedParameter::StartPressure => out.offset = *value,
                TunedParameter::CommandLead(which) => out.leads[*which] = *value,
                TunedParameter::InitialState(RigStage::Sensing, at) => {
                    out.initial_gauge[*at] = share
                }
                TunedParameter::InitialState(_, at) => out.initial_muscle[*at] = share,
            }
        }
        out
    }
}

//! What may be re-tuned of a rig, and the stages that it acts in.

use stretch_gap::{ParameterSpec, SlowDrift, StageSpec};
use stretch_sim::{Key, PARAMETERS, Rig, Stage};

use super::{noises::Noises, timing};

/// Fluctuation of the supply as laboratories have it, a share of it (1 sd): regulators hold a tenth of a per cent to half of one.
const SUPPLY_WANDER: f64 = 0.0025;
/// Its correlation time, s: a compressor's cycle at one end, a regulator's hunting at the other.
const SUPPLY_CORRELATION_S: f64 = 4.0;

/// What a parameter of the diagnosis turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Knob {
    /// A parameter of the rig.
    Rig(Key),
    /// The pressure at a trial's start.
    Start,
    /// How far ahead of their rows every other command acts.
    Lead(usize),
    /// How little of the move before the session a stage remembers.
    Unwound(Stage),
}

impl Knob {
    pub(super) fn key(self) -> Option<Key> {
        match self {
            Self::Rig(key) => Some(key),
            Self::Start | Self::Lead(_) | Self::Unwound(_) => None,
        }
    }
}

/// Parameters with a tolerance in the stages, then the pressure at a trial's start and the timing of commands; and what each turns.
pub(super) fn parameters(rig: &Rig, kinds: &[Stage]) -> (Vec<ParameterSpec>, Vec<Knob>) {
    let parameter = |key: Key| {
        let (info, nominal) = (key.info(), rig.params[key]);
        let drift = (key == Key::PS).then_some(SlowDrift {
            sd: SUPPLY_WANDER * nominal,
            correlation_s: SUPPLY_CORRELATION_S,
        });
        ParameterSpec {
            least: 0.15 * nominal,
            drift,
            // These stand in for one another in the nominal rig.
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
        .map(|info| (parameter(info.key), Knob::Rig(info.key)))
        .filter(|(parameter, _)| parameter.sd > 0.0)
        .chain([(start, Knob::Start)])
        .chain([0, 1].map(|which| (timing::at_rows(which), Knob::Lead(which))))
        .chain(kinds.iter().filter_map(unwound))
        .unzip()
}

/// Share, 1 sd, by which memories at the session's start may lie off those of a rig that came from the other end of its stroke: a rig
/// that had settled before (1) is no great surprise.
const UNWOUND: f64 = 0.4;

/// How little of the move before the session a stage remembers: 0 as if it had come from the other end of the stroke, 1 as if it had
/// settled where it begins. Pressures of a chamber are measured.
fn unwound(kind: &Stage) -> Option<(ParameterSpec, Knob)> {
    let name = match kind {
        Stage::Pneumatics | Stage::Reference => return None,
        Stage::Sensing => "unwound_gauge",
        Stage::Muscle | Stage::Actuation => "unwound_muscle",
    };
    let spec = ParameterSpec {
        least: 0.0,
        is_evidence: false,
        ..ParameterSpec::new(name, "1", 0.0).within(UNWOUND)
    };
    Some((spec, Knob::Unwound(*kind)))
}

/// Stages with their channels, the parameters that act in them, and their noise.
pub(super) fn stages(kinds: &[Stage], keys: &[Knob], noises: &Noises) -> Vec<StageSpec> {
    let stage = |kind: &Stage| {
        let (channel, unit, noise) = match kind {
            Stage::Pneumatics => ("pressure_kpa", "kPa", &noises.pressure_kpa),
            Stage::Sensing => ("bridge_v", "V", &noises.volts),
            _ => ("length_mm", "mm", &noises.length_mm),
        };
        // The start's pressure and the timing of commands belong to the chamber.
        let owner = |knob: &Knob| match knob {
            Knob::Rig(key) => key.info().stage,
            Knob::Unwound(own) => *own,
            Knob::Start | Knob::Lead(_) => Stage::Pneumatics,
        };
        StageSpec {
            name: kind.name().into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: (0..keys.len()).filter(|&i| kind.holds(owner(&keys[i]))).collect(),
            noise: (noise.sd() > 0.0).then(|| noise.clone()),
        }
    };
    kinds.iter().map(stage).collect()
}

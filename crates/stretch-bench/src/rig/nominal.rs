//! What may be re-tuned of a rig, and the stages that it acts in.

use stretch_gap::{ParameterSpec, StageSpec, Wander};
use stretch_sim::{Key, PARAMETERS, Rig, RigParams, Stage};

use super::timing;

/// Slow fluctuation of the supply, a share of it (1 sd).
const SUPPLY_WANDER: f64 = 0.003;
/// Its correlation time, s.
const SUPPLY_CORRELATION_S: f64 = 12.0;
/// Distance of the knots that follow it, s.
const SUPPLY_KNOT_S: f64 = 2.0;

/// Noise of the channels with the steps of their converters, 1 sd.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sds {
    pub(super) length_mm: f64,
    pub(super) volts: f64,
    pub(super) pressure_kpa: f64,
}

impl Sds {
    pub(super) fn of(params: &RigParams) -> Self {
        // A step adds a uniform error of variance step^2/12.
        let with_step = |sigma: Key, full_scale: Key| {
            let step = params[full_scale] / (params[Key::Bits].exp2() - 1.0);
            (params[sigma].powi(2) + step * step / 12.0).sqrt()
        };
        Self {
            length_mm: with_step(Key::SigmaL, Key::Travel),
            volts: with_step(Key::SigmaV, Key::VFs),
            pressure_kpa: 1e-3 * params[Key::SigmaP],
        }
    }
}

/// What a parameter of the diagnosis turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Knob {
    /// A parameter of the rig.
    Rig(Key),
    /// The pressure at a trial's start.
    Start,
    /// How far ahead of their rows every other command acts.
    Lead(usize),
}

impl Knob {
    pub(super) fn key(self) -> Option<Key> {
        match self {
            Self::Rig(key) => Some(key),
            Self::Start | Self::Lead(_) => None,
        }
    }
}

/// Parameters with a tolerance in the stages, then the pressure at a trial's start and the timing of commands; and what each turns.
pub(super) fn parameters(rig: &Rig, kinds: &[Stage]) -> (Vec<ParameterSpec>, Vec<Knob>) {
    let parameter = |key: Key| {
        let (info, nominal) = (key.info(), rig.params[key]);
        let wander = (key == Key::PS).then_some(Wander {
            sd: SUPPLY_WANDER * nominal,
            correlation_s: SUPPLY_CORRELATION_S,
            knot_s: SUPPLY_KNOT_S,
        });
        ParameterSpec {
            least: 0.15 * nominal,
            wander,
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
        .unzip()
}

/// Stages with their channels, the parameters that act in them, and their noise.
pub(super) fn stages(kinds: &[Stage], keys: &[Knob], sds: Sds) -> Vec<StageSpec> {
    let stage = |kind: &Stage| {
        let (channel, unit, noise) = match kind {
            Stage::Pneumatics => ("pressure_kpa", "kPa", sds.pressure_kpa),
            Stage::Sensing => ("bridge_v", "V", sds.volts),
            _ => ("length_mm", "mm", sds.length_mm),
        };
        // The start's pressure and the timing of commands belong to the chamber.
        let owner = |knob: &Knob| knob.key().map_or(Stage::Pneumatics, |key| key.info().stage);
        StageSpec {
            name: kind.name().into(),
            channel: channel.into(),
            unit: unit.into(),
            parameters: (0..keys.len()).filter(|&i| kind.holds(owner(&keys[i]))).collect(),
            noise: (noise > 0.0).then_some(noise),
        }
    };
    kinds.iter().map(stage).collect()
}

//! The columns of a rig's recording, and the stages that each column drives.

use std::borrow::Cow;

use stretch_calibrate::PRESSURE;
use stretch_gap::{Column, Description, Distortion};
use stretch_sim::{Key, RigStage};

use super::{
    RigSimulator,
    session::{Inputs, LENGTH, VALVES, VOLTAGE},
};
use crate::bench::skew_of;

pub(super) const COMMANDS: &str = "inlet, outlet";

/// Range of the delays of the voltage if the catalogue has no skew, s.
const SKEW_S: [f64; 2] = [-0.1, 0.2];

/// The columns of a recording, and the stages that each column drives.
pub(super) fn record_columns(
    about: &Description,
    stage_kinds: &[RigStage],
) -> Vec<Column<'static>> {
    // The start of a trial is read from the pressure, or from the length if there is no pressure.
    let reads = |stages: [RigStage; 2]| -> Vec<usize> {
        (0..stage_kinds.len()).filter(|&i| stages.contains(&stage_kinds[i])).collect()
    };
    let skew_s = skew_of(about, SKEW_S);
    let output = |(stage, kind): (usize, &RigStage)| {
        let (name, read_by, skew_s, hint) = match kind {
            RigStage::Pneumatics => (
                PRESSURE,
                reads([RigStage::Pneumatics, RigStage::Muscle]),
                [0.0; 2],
                "the pressure gauge, its scale and its zero",
            ),
            RigStage::Sensing => (
                VOLTAGE,
                Vec::new(),
                skew_s,
                "the bridge's wires, the amplifier and the scale of its converter",
            ),
            _ => (
                LENGTH,
                reads([RigStage::Actuation, RigStage::Sensing]),
                [0.0; 2],
                "the potentiometer, its scale and its zero, and L0 in the rig file",
            ),
        };
        Column {
            name: Cow::Borrowed(name),
            read_by,
            skew_s,
            hint: Cow::Borrowed(hint),
            ..Column::output(stage, &about.stages[stage])
        }
    };
    let commanded =
        |&i: &usize| matches!(stage_kinds[i], RigStage::Pneumatics | RigStage::Actuation);
    let commands = Column {
        name: Cow::Borrowed(COMMANDS),
        unit: Cow::Borrowed("1"),
        values: Cow::Borrowed(&[]),
        output_of: None,
        read_by: (0..stage_kinds.len()).filter(commanded).collect(),
        is_command: true,
        skew_s: [0.0; 2],
        hint: Cow::Borrowed(
            "the scale on which commands are written, the valves' supply, and the volume and the conductances in the rig file",
        ),
    };
    stage_kinds.iter().enumerate().map(output).chain([commands]).collect()
}

impl RigSimulator {
    /// The rig on inputs in which one column is corrected; `None` if the column drives no stage.
    /// The measured outputs stay as they are.
    pub(super) fn with_corrected(&self, column: &str, error: Distortion) -> Option<Self> {
        let names: &[&str] = match column {
            PRESSURE => &[PRESSURE],
            LENGTH => &[LENGTH],
            COMMANDS => &VALVES,
            _ => return None,
        };
        let mut columns = self.bench.columns.clone();
        for (name, values) in columns.names.iter().zip(&mut columns.values) {
            if !names.contains(&name.as_str()) {
                continue;
            }
            for range in &columns.ranges {
                let own = &mut values[range.clone()];
                own.copy_from_slice(&error.undone(own, columns.dt_s));
            }
            if column == COMMANDS {
                // An opening stays between shut (0) and open (1).
                values.iter_mut().for_each(|opening| *opening = opening.clamp(0.0, 1.0));
            }
        }
        let (corrected, supply_kpa) = ((column, error.scale.abs()), 1e-3 * self.base[Key::PS]);
        let inputs = Inputs::of(&columns, &self.noises, Some(corrected), supply_kpa);
        Some(Self { inputs, ..self.clone() })
    }
}

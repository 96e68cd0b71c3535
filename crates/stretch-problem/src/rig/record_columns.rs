//! The columns of a rig's record, and which stages are driven by them.

use std::borrow::Cow;

use stretch_gap::{Column, Description};
use stretch_sim::Stage;

use crate::bench::specs::skew_of;

pub(super) const PRESSURE: &str = "pressure_kpa";
pub(super) const LENGTH: &str = "length_mm";
const VOLTAGE: &str = "bridge_v";
pub(super) const COMMANDS: &str = "inlet, outlet";

/// Delays of the voltage without a catalogue, s.
const SKEW_S: [f64; 2] = [-0.1, 0.2];

/// The columns, and which stages are driven by them.
pub(super) fn record_columns(about: &Description, stage_kinds: &[Stage]) -> Vec<Column<'static>> {
    // How a trial begins is read off the record, too: of the pressure, or of the length where there is none.
    let reads = |stages: [Stage; 2]| -> Vec<usize> {
        (0..stage_kinds.len()).filter(|&i| stages.contains(&stage_kinds[i])).collect()
    };
    let skew_s = skew_of(about, SKEW_S);
    let output = |(stage, kind): (usize, &Stage)| {
        let (name, read_by, skew_s, hint) = match kind {
            Stage::Pneumatics => (
                PRESSURE,
                reads([Stage::Pneumatics, Stage::Muscle]),
                [0.0; 2],
                "the pressure gauge, its scale and its zero",
            ),
            Stage::Sensing => (
                VOLTAGE,
                Vec::new(),
                skew_s,
                "the bridge's wires, the amplifier and the scale of its converter",
            ),
            _ => (
                LENGTH,
                reads([Stage::Actuation, Stage::Sensing]),
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
    let commanded = |&i: &usize| matches!(stage_kinds[i], Stage::Pneumatics | Stage::Actuation);
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

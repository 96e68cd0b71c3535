//! The rig driven by a record of which one column was put right.

use std::borrow::Cow;

use stretch_gap::{Column, Distortion};
use stretch_sim::{Key, Stage};

use super::{
    RigSimulator,
    session::{Inputs, RigTrial},
};
use crate::bench::specs::skew_of;

const PRESSURE: &str = "pressure_kpa";
const LENGTH: &str = "length_mm";
const VOLTAGE: &str = "bridge_v";
const COMMANDS: &str = "inlet, outlet";

/// Delays of the voltage without a catalogue, s.
const SKEW_S: [f64; 2] = [-0.1, 0.2];

impl RigSimulator {
    /// The columns, and which stages are driven by them.
    pub(super) fn record(&self) -> Vec<Column<'_>> {
        // How a trial begins is read off the record, too: of the pressure, or of the length where there is none.
        let reads = |stages: [Stage; 2]| -> Vec<usize> {
            (0..self.stage_kinds.len()).filter(|&i| stages.contains(&self.stage_kinds[i])).collect()
        };
        let skew_s = skew_of(&self.about, SKEW_S);
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
                ..Column::output(stage, &self.about.stages[stage], &self.measured[stage])
            }
        };
        let commanded =
            |&i: &usize| matches!(self.stage_kinds[i], Stage::Pneumatics | Stage::Actuation);
        let commands = Column {
            name: Cow::Borrowed(COMMANDS),
            unit: Cow::Borrowed("1"),
            values: Cow::Borrowed(&[]),
            output_of: None,
            read_by: (0..self.stage_kinds.len()).filter(commanded).collect(),
            is_command: true,
            skew_s: [0.0; 2],
            hint: Cow::Borrowed(
                "the scale on which commands are written, the valves' supply, and the volume and the conductances in the rig file",
            ),
        };
        self.stage_kinds.iter().enumerate().map(output).chain([commands]).collect()
    }

    /// The rig with a session in which one column is put right; none where the column drives nothing. What was measured of
    /// the outputs stays as it is.
    pub(super) fn driven(&self, column: &str, error: Distortion) -> Option<Self> {
        let dt_s = self.about.dt_s;
        let mut rig = self.clone();
        let right = |values: &mut Vec<f64>| *values = error.undone(values, dt_s);
        let each = |trials: &mut Vec<RigTrial>, of: fn(&mut RigTrial) -> Option<&mut Vec<f64>>| {
            trials.iter_mut().filter_map(of).for_each(right);
        };
        let trials = &mut rig.session.trials;
        match column {
            PRESSURE => each(trials, |t| t.pressure_kpa.as_mut()),
            LENGTH => each(trials, |t| Some(&mut t.length_mm)),
            COMMANDS => {
                for trial in trials {
                    for valve in [&mut trial.inlet, &mut trial.outlet] {
                        right(valve);
                        // No valve opens further than it can.
                        valve.iter_mut().for_each(|opening| *opening = opening.clamp(0.0, 1.0));
                    }
                }
            }
            _ => return None,
        }
        let noise = |own: &str, sd: f64| if own == column { sd / error.scale.abs() } else { sd };
        let supply_kpa = 1e-3 * rig.base[Key::PS];
        rig.inputs = Inputs::of(
            &rig.session,
            noise(LENGTH, rig.noises.length_mm.sd()),
            noise(PRESSURE, rig.noises.pressure_kpa.sd()),
            supply_kpa,
        );
        Some(rig)
    }
}

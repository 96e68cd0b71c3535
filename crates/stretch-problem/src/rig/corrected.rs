//! The rig driven by a recording with one corrected column.

use stretch_gap::Distortion;
use stretch_sim::Key;

use super::{
    RigSimulator,
    record_columns::{COMMANDS, LENGTH, PRESSURE},
    session::{Inputs, RigTrial},
};

impl RigSimulator {
    /// The rig with a session in which one column is corrected; none where the column drives no stage. The measured outputs stay as they
    /// are.
    pub(super) fn with_corrected(&self, column: &str, error: Distortion) -> Option<Self> {
        let dt_s = self.about.dt_s;
        let mut rig = self.clone();
        let correct = |values: &mut Vec<f64>| *values = error.undone(values, dt_s);
        let each = |trials: &mut Vec<RigTrial>, of: fn(&mut RigTrial) -> Option<&mut Vec<f64>>| {
            trials.iter_mut().filter_map(of).for_each(correct);
        };
        let trials = &mut rig.session.trials;
        match column {
            PRESSURE => each(trials, |t| t.pressure_kpa.as_mut()),
            LENGTH => each(trials, |t| Some(&mut t.length_mm)),
            COMMANDS => {
                for trial in trials {
                    for valve in [&mut trial.inlet, &mut trial.outlet] {
                        correct(valve);
                        // An opening stays between shut (0) and open (1).
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

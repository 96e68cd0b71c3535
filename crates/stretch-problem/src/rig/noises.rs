//! Noise of the rig's channels, from the recording or from the rig file.

use stretch_calibrate::PRESSURE;
use stretch_gap::{Noise, SlowDrift, WINDOW};
use stretch_sim::{Key, RigParams};

use super::session::{LENGTH, VALVES, VOLTAGE};
use crate::bench::columns::Columns;

/// The noise is estimated from the windows without a command that begin longest after a command: from this share of all
/// such windows, but from at least this number of them.
const USED: (f64, usize) = (0.5, 24);

/// Time after a command from which a parabola describes the remaining motion of the muscle, s: a
/// few time constants of the muscle.
const SETTLED_S: f64 = 2.0;

/// Slow noise of a recorder (1 sd), in multiples of its noise: amplifiers have flicker noise, and
/// references drift with the room temperature.
const DRIFT: f64 = 0.3;
/// Correlation time of the slow noise of a recorder, s.
const DRIFT_CORRELATION_S: f64 = 2.0;
/// Greatest noise of a recorder, in multiples of the noise that the rig file states. Noise beyond this limit does not
/// come from the recorder.
const MOST_NOISE: f64 = 2.0;

/// Noise of every channel, with the quantisation noise of the converters.
#[derive(Debug, Clone)]
pub(super) struct Noises {
    pub(super) length_mm: Noise,
    pub(super) volts: Noise,
    pub(super) pressure_kpa: Noise,
    pub(super) length_drift: Option<SlowDrift>,
    pub(super) volts_drift: Option<SlowDrift>,
    pub(super) pressure_drift: Option<SlowDrift>,
}

impl Noises {
    /// Noise from the windows of the fit trials in which nothing was commanded; if there are too
    /// few such windows, the noise of the rig file.
    pub(super) fn of(params: &RigParams, columns: &Columns) -> Self {
        // The step of a converter adds a uniform error of variance step^2/12.
        let with_step = |sigma: Key, full_scale: Key| {
            let step = params[full_scale] / (params[Key::Bits].exp2() - 1.0);
            (params[sigma].powi(2) + step * step / 12.0).sqrt()
        };
        let quiet = quiet(columns);
        let of = |stated: f64, channel: &str| {
            let values = columns.all(channel);
            let window = |&from: &usize| values.get(from..from + WINDOW).unwrap_or(&[]).to_vec();
            let windows: Vec<Vec<f64>> = quiet.places.iter().map(window).collect();
            Noise::of_windows(&windows, Some(stated), quiet.is_still, columns.dt_s)
                .unwrap_or_else(|| Noise::known(stated))
        };
        // A drift of the recorder would hide jumps.
        let drift = |stated: f64, noise: &Noise| {
            let sd = DRIFT * (MOST_NOISE * stated / noise.sd()).min(1.0);
            (!noise.jumps()).then_some(SlowDrift { sd, correlation_s: DRIFT_CORRELATION_S })
        };
        let of_length = with_step(Key::SigmaL, Key::Travel);
        let of_volts = with_step(Key::SigmaV, Key::VFs);
        let of_pressure = 1e-3 * params[Key::SigmaP];
        let length_mm = of(of_length, LENGTH);
        let volts = of(of_volts, VOLTAGE);
        let pressure_kpa = of(of_pressure, PRESSURE);
        Self {
            length_drift: drift(of_length, &length_mm),
            volts_drift: drift(of_volts, &volts),
            pressure_drift: drift(of_pressure, &pressure_kpa),
            length_mm,
            volts,
            pressure_kpa,
        }
    }
}

/// Windows without a command.
struct Quiet {
    /// First sample of each window.
    places: Vec<usize>,
    /// Whether all windows begin long after a command.
    is_still: bool,
}

fn quiet(columns: &Columns) -> Quiet {
    let [inlet, outlet] = VALVES.map(|name| columns.all(name));
    let commands: Vec<(&f64, &f64)> = inlet.iter().zip(outlet).collect();
    // The number of samples since the last command, and the first sample.
    let mut all: Vec<(usize, usize)> = Vec::new();
    let trials = columns.trials.iter().zip(&columns.ranges);
    for (_, range) in trials.filter(|(trial, _)| !trial.is_test) {
        let mut from = range.start;
        for still in commands[range.clone()].chunk_by(|a, b| a == b) {
            let mut at = 0;
            while at + WINDOW <= still.len() {
                all.push((at, from + at));
                at += WINDOW / 2;
            }
            from += still.len();
        }
    }
    all.sort_by_key(|window| std::cmp::Reverse(window.0));
    let used = ((USED.0 * all.len() as f64) as usize).max(USED.1);
    let settled = (SETTLED_S / columns.dt_s) as usize;
    let count = all.iter().filter(|(since, _)| *since >= settled).count();
    let is_still = count >= USED.1;
    all.truncate(if is_still { used.min(count) } else { used });
    Quiet { places: all.into_iter().map(|(_, place)| place).collect(), is_still }
}

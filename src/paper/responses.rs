//! Studies that the paper of the published method proposes: the error as a function of the gap
//! between two pulses, and the frequency response of the sensor.

use std::f64::consts::TAU;

use serde::Serialize;
use stretch_data::{Split, TrialKind};
use stretch_sim::{Grid, Key, Rig, Sensing, Session, SimError, Start, TrialPlan};

use super::experiment::Pipeline;

/// Tested gaps, in seconds: the paper's range and a little more.
const GAPS_S: [f64; 9] = [0.10, 0.15, 0.22, 0.32, 0.46, 0.66, 0.95, 1.4, 2.0];

/// Length of a trial, in seconds.
const TRIAL_S: f64 = 30.0;

/// Errors on a trial in which all pulse pairs have the same gap.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct GapPoint {
    /// Time from the end of the first pulse to the start of the second, in seconds.
    pub(crate) gap_s: f64,
    /// RMSE of raw, linear and non-linear with the published method, in millimetres.
    pub(crate) published_rmse_mm: [f64; 3],
    /// RMSE of raw, linear, non-linear and observer with our method, in millimetres.
    pub(crate) ours_rmse_mm: [f64; 4],
}

/// Continues a session with one trial of pulse pairs for each gap.
///
/// A pulse is 0.25 s of fully open inlet. The outlet is open in the gap and for 1 s after a pair.
/// Then both valves are closed for 0.5 s.
pub(crate) fn pulse_gaps(
    session: &mut Session,
    published: &Pipeline,
    ours: &Pipeline,
) -> anyhow::Result<Vec<GapPoint>> {
    let mut points = Vec::new();
    for gap_s in GAPS_S {
        let (_, trial) = session.run(&pairs(gap_s))?;
        let trials = [trial];
        let there = published.judge(&trials, true)?;
        let here = ours.judge(&trials, false)?;
        points.push(GapPoint {
            gap_s,
            published_rmse_mm: [0, 1, 2].map(|method| there.pooled[method].rmse),
            ours_rmse_mm: [0, 1, 2, 3].map(|method| here.pooled[method].rmse),
        });
    }
    Ok(points)
}

fn pairs(gap_s: f64) -> TrialPlan {
    let samples = |seconds: f64| (seconds * stretch_sim::RATE_HZ).round() as usize;
    let total = samples(TRIAL_S);
    let (mut inlet, mut outlet) = (vec![0.0; samples(1.0)], vec![0.0; samples(1.0)]);
    let cycle =
        [(1.0, 0.0, 0.25), (0.0, 1.0, gap_s), (1.0, 0.0, 0.25), (0.0, 1.0, 1.0), (0.0, 0.0, 0.5)];
    for (fill, vent, seconds) in cycle.into_iter().cycle() {
        if inlet.len() >= total {
            break;
        }
        inlet.extend(std::iter::repeat_n(fill, samples(seconds)));
        outlet.extend(std::iter::repeat_n(vent, samples(seconds)));
    }
    inlet.truncate(total);
    outlet.truncate(total);
    TrialPlan {
        file: format!("gap_{:03}_ms.csv", (1000.0 * gap_s).round()),
        kind: TrialKind::Pulses,
        opening: None,
        split: Split::Test,
        full: false,
        rate_hz: stretch_sim::RATE_HZ,
        inlet,
        outlet,
        excitation: 1.0,
        set_length_mm: None,
        shunt: None,
        start_s: None,
    }
}

/// Tested frequencies, in hertz.
const FREQUENCIES_HZ: [f64; 12] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0, 1.6, 2.5, 4.0, 7.0, 12.0];

/// Amplitude of the length, in millimetres.
const AMPLITUDE_MM: f64 = 3.0;

/// Number of periods to settle, and number of periods that are evaluated.
const PERIODS: (f64, f64) = (4.0, 6.0);

/// Sample rate of this simulation, Hz.
const RATE_HZ: f64 = 500.0;

/// Gain and phase of the bridge voltage at one frequency.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FrequencyPoint {
    /// Frequency of the length, in hertz.
    pub(crate) frequency_hz: f64,
    /// Amplitude of the voltage's fundamental over that of the length, in volts
    /// per millimetre.
    pub(crate) gain_v_per_mm: f64,
    /// Phase by which the voltage leads the contraction, in degrees.
    pub(crate) lead_deg: f64,
}

/// Drives the sensing stage with sines of 3 mm about the middle of the stroke, at constant pressure
/// and without noise. Estimates the fundamental by projection on sine and cosine.
pub(crate) fn frequency_response(rig: &Rig) -> anyhow::Result<Vec<FrequencyPoint>> {
    let grid = Grid::samples(1.0 / RATE_HZ).map_err(SimError::from)?;
    let stage = Sensing::new(&rig.params, &rig.effects, &grid)?;
    let middle_mm = rig.params[Key::L0] * (1.0 - 0.5 * rig.params[Key::KMax]);
    FREQUENCIES_HZ
        .into_iter()
        .map(|frequency_hz| {
            let settle_s = (PERIODS.0 / frequency_hz).max(20.0);
            let samples = ((settle_s + PERIODS.1 / frequency_hz) * RATE_HZ) as usize;
            let phase = |n: usize| TAU * frequency_hz * n as f64 / RATE_HZ;
            // A positive sine is a contraction, so the length decreases.
            let length_mm: Vec<f64> =
                (0..samples).map(|n| middle_mm - AMPLITUDE_MM * phase(n).sin()).collect();
            let pressure_kpa = vec![300.0; samples];
            let mut volts = vec![0.0; samples];
            stage.run(
                &mut stage.memory(),
                Start::Settled,
                0.0,
                &length_mm,
                &pressure_kpa,
                &mut volts,
            )?;
            let from = (settle_s * RATE_HZ) as usize;
            let count = (samples - from) as f64;
            let mean = volts[from..].iter().sum::<f64>() / count;
            let project = |wave: fn(f64) -> f64| {
                let products = volts[from..].iter().enumerate();
                products.map(|(i, v)| (v - mean) * wave(phase(from + i))).sum::<f64>() * 2.0 / count
            };
            let (in_phase, leading) = (project(f64::sin), project(f64::cos));
            Ok(FrequencyPoint {
                frequency_hz,
                gain_v_per_mm: in_phase.hypot(leading) / AMPLITUDE_MM,
                lead_deg: leading.atan2(in_phase).to_degrees(),
            })
        })
        .collect()
}

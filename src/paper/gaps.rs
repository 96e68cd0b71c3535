//! Error against the gap between two pulses, which the paper asks for.

use serde::Serialize;
use stretch_data::{Split, TrialKind};
use stretch_sim::{RATE_HZ, Session, TrialPlan};

use super::pipeline::Pipeline;

/// Gaps that are tried, in seconds: the paper's range and a little beyond.
const GAPS_S: [f64; 9] = [0.10, 0.15, 0.22, 0.32, 0.46, 0.66, 0.95, 1.4, 2.0];

/// Length of a trial, in seconds.
const TRIAL_S: f64 = 30.0;

/// Errors on a trial whose pulse pairs all have one gap.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct GapPoint {
    /// From the end of the first pulse to the start of the second, in seconds.
    pub(crate) gap_s: f64,
    /// RMSE of raw, linear and non-linear as published, in millimetres.
    pub(crate) published_rmse_mm: [f64; 3],
    /// RMSE of raw, linear, non-linear and the observer as decided here, in millimetres.
    pub(crate) ours_rmse_mm: [f64; 4],
}

/// Goes on with a session: a trial of pulse pairs for each gap.
///
/// Pulses are 0.25 s of full inlet; the outlet is open in the gap and for 1 s
/// after a pair, then both valves are shut for 0.5 s.
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
    let samples = |seconds: f64| (seconds * RATE_HZ).round() as usize;
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
        rate_hz: RATE_HZ,
        inlet,
        outlet,
        excitation: 1.0,
        set_length_mm: None,
        shunt: None,
        start_s: None,
    }
}

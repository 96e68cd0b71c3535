//! Small sessions simulated by the built-in rig.

use stretch_data::{Channel, SessionTrial, Split, Trial, TrialKind};
use stretch_sim::{Chain, DEFAULT_STEP_S, EffectSet, Openings, Recorded, RigParams, Start};

use crate::support::Noise;

pub(crate) const DT_S: f64 = 0.01;

fn openings(trial: usize, noise: &mut Noise) -> (Vec<f64>, Vec<f64>) {
    let (mut inlet, mut outlet) = (vec![0.0; 50], vec![0.0; 50]);
    if trial == 0 {
        inlet.extend([0.25; 600]);
        outlet.extend([0.0; 600]);
        return (inlet, outlet);
    }
    while inlet.len() < 1800 {
        let length = (20.0 + 100.0 * noise.unit()) as usize;
        let opening = [0.125, 0.25, 0.5, 1.0][(4.0 * noise.unit()) as usize % 4];
        let choice = noise.unit();
        let (i, o) = match choice {
            c if c < 0.42 => (opening, 0.0),
            c if c < 0.84 => (0.0, opening),
            _ => (0.0, 0.0),
        };
        inlet.extend(std::iter::repeat_n(i, length));
        outlet.extend(std::iter::repeat_n(o, length));
    }
    inlet.truncate(1800);
    outlet.truncate(1800);
    (inlet, outlet)
}

/// A session of four trials, each of which begins in the state that the trial before left; the last one is a test
/// trial.
pub(crate) fn session(
    params: &RigParams,
    effects: &EffectSet,
    pressure: bool,
    seed: u64,
) -> Vec<SessionTrial> {
    session_from(|_| Start::Carried { rest_s: 14.0 }, params, effects, pressure, seed)
}

/// The same, with the state in which each trial begins.
pub(crate) fn session_from(
    start: fn(usize) -> Start,
    params: &RigParams,
    effects: &EffectSet,
    pressure: bool,
    seed: u64,
) -> Vec<SessionTrial> {
    let chain = Chain::new(params, effects, DT_S, DEFAULT_STEP_S).expect("a rig");
    let mut memory = chain.memory();
    let mut noise = Noise(seed);
    let mut start_s = 0.0;
    (0..4)
        .map(|trial| {
            let (inlet, outlet) = openings(trial, &mut noise);
            let n = inlet.len();
            let [mut p, mut l, mut v] = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            let recorded = Recorded { pressure_kpa: &mut p, length_mm: &mut l, bridge_v: &mut v };
            let valves = Openings { inlet: &inlet, outlet: &outlet };
            chain.run(&mut memory, start(trial), start_s, valves, 0.1, recorded).expect("a trial");
            p.iter_mut().for_each(|x| *x += 1.2 * noise.gauss());
            l.iter_mut().for_each(|x| *x += 0.05 * noise.gauss());
            v.iter_mut().for_each(|x| *x += 0.002 * noise.gauss());
            let begun_s = start_s;
            start_s += n as f64 * DT_S + 15.0;
            let channel = |name: &str, values| Channel { name: name.into(), values };
            let mut channels = vec![
                channel("inlet", inlet),
                channel("outlet", outlet),
                channel("length_mm", l),
                channel("bridge_v", v),
            ];
            if pressure {
                channels.push(channel("pressure_kpa", p));
            }
            let time_s = (0..n).map(|i| DT_S * i as f64).collect();
            SessionTrial {
                trial: Trial { name: format!("trial_{trial}.csv"), time_s, channels },
                kind: TrialKind::Arbitrary,
                start_s: begun_s,
                split: if trial == 3 { Split::Test } else { Split::Fit },
                notes: Vec::new(),
            }
        })
        .collect()
}

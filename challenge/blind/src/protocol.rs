//! The seventeen trials of a session, and their commanded valve openings.

use serde::{Deserialize, Serialize};

use crate::random::RandomGenerator;

/// Samples per second.
pub(crate) const RATE_HZ: usize = 100;
/// Pause between trials, s.
pub(crate) const PAUSE_S: f64 = 15.0;

/// The use of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Split {
    Fit,
    Test,
}

/// The commands of one trial.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Script {
    pub(crate) file: String,
    pub(crate) kind: &'static str,
    pub(crate) opening: Option<f64>,
    pub(crate) start_s: f64,
    pub(crate) split: Split,
    /// Pause before the trial, s.
    pub(crate) pause_s: f64,
    /// Whether the trial starts settled at the supply pressure; otherwise it starts at the
    /// atmosphere.
    pub(crate) from_full: bool,
    /// Inlet and outlet opening of every sample, 0..1.
    pub(crate) openings: Vec<(f64, f64)>,
}

const RAMPS: [(f64, &str); 6] =
    [(0.0025, "0_25"), (0.125, "12_5"), (0.25, "25"), (0.5, "50"), (0.75, "75"), (1.0, "100")];

/// Returns the trials of a session: six inflations and six deflations, then two further trials for
/// fitting and three for testing.
pub(crate) fn session(random: &mut RandomGenerator) -> Vec<Script> {
    let mut scripts = Vec::new();
    let mut start_s = 0.0;
    let mut add = |file: String, kind, opening, split, from_full, openings: Vec<(f64, f64)>| {
        let duration_s = openings.len() as f64 / RATE_HZ as f64;
        scripts.push(Script {
            file,
            kind,
            opening,
            start_s,
            split,
            pause_s: PAUSE_S,
            from_full,
            openings,
        });
        start_s += duration_s + PAUSE_S;
    };
    for (opening, label) in RAMPS {
        let file = format!("inflation_{label}.csv");
        add(file, "inflation", Some(opening), Split::Fit, false, ramp((opening, 0.0)));
    }
    for (opening, label) in RAMPS {
        let file = format!("deflation_{label}.csv");
        add(file, "deflation", Some(opening), Split::Fit, true, ramp((0.0, opening)));
    }
    add("arbitrary_1.csv".into(), "arbitrary", None, Split::Fit, false, arbitrary(random));
    add("pulses_1.csv".into(), "pulses", None, Split::Fit, false, pulses(random));
    add("arbitrary_2.csv".into(), "arbitrary", None, Split::Test, false, arbitrary(random));
    add("arbitrary_3.csv".into(), "arbitrary", None, Split::Test, false, arbitrary(random));
    add("pulses_2.csv".into(), "pulses", None, Split::Test, false, pulses(random));
    scripts
}

/// Returns the same session with other pauses.
pub(crate) fn with_pauses(mut scripts: Vec<Script>, mut pause: impl FnMut() -> f64) -> Vec<Script> {
    let mut start_s = 0.0;
    for (i, script) in scripts.iter_mut().enumerate() {
        if i > 0 {
            script.pause_s = pause();
            start_s += script.pause_s;
        }
        // Start times are rounded to 0.01 s, like the pauses.
        script.start_s = (start_s * 100.0).round() / 100.0;
        start_s += script.openings.len() as f64 / RATE_HZ as f64;
    }
    scripts
}

/// One second of rest, then a constant opening until 15 s.
fn ramp(opening: (f64, f64)) -> Vec<(f64, f64)> {
    (0..15 * RATE_HZ).map(|i| if i < RATE_HZ { (0.0, 0.0) } else { opening }).collect()
}

fn hold(openings: &mut Vec<(f64, f64)>, seconds: f64, opening: (f64, f64)) {
    let samples = (seconds * RATE_HZ as f64).round() as usize;
    openings.extend(std::iter::repeat_n(opening, samples));
}

/// One minute of random segments: inflate, deflate or hold.
fn arbitrary(random: &mut RandomGenerator) -> Vec<(f64, f64)> {
    let mut openings = Vec::new();
    hold(&mut openings, 1.0, (0.0, 0.0));
    while openings.len() < 60 * RATE_HZ {
        let seconds = random.between(0.15, 1.5);
        let opening = random.pick(&[0.125, 0.25, 0.5, 0.75, 1.0]);
        let choice = random.unit();
        let segment = match choice {
            c if c < 0.42 => (opening, 0.0),
            c if c < 0.84 => (0.0, opening),
            _ => (0.0, 0.0),
        };
        hold(&mut openings, seconds, segment);
    }
    openings.truncate(60 * RATE_HZ);
    openings
}

/// One minute of pairs of pulses. The gap between the two pulses of a pair falls by 18 % with each
/// pair, and then starts over.
fn pulses(random: &mut RandomGenerator) -> Vec<(f64, f64)> {
    let vent = (0.0, random.pick(&[0.5, 0.75, 1.0]));
    let rest_s = random.between(0.3, 1.0);
    let mut openings = Vec::new();
    hold(&mut openings, 1.0, (0.0, 0.0));
    let mut gap_s = 1.4;
    while openings.len() < 60 * RATE_HZ {
        hold(&mut openings, 0.25, (1.0, 0.0));
        hold(&mut openings, gap_s, vent);
        hold(&mut openings, 0.25, (1.0, 0.0));
        hold(&mut openings, 1.0, vent);
        hold(&mut openings, rest_s, (0.0, 0.0));
        gap_s = if gap_s * 0.82 < 0.15 { 1.4 } else { gap_s * 0.82 };
    }
    openings.truncate(60 * RATE_HZ);
    openings
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_session_has_seventeen_trials_and_480_s() {
        let scripts = session(&mut RandomGenerator::new(1, 1));
        assert_eq!(scripts.len(), 17);
        assert_eq!(scripts.iter().map(|s| s.openings.len()).sum::<usize>(), 480 * RATE_HZ);
        assert_eq!(scripts.iter().filter(|s| s.split == Split::Test).count(), 3);
        assert_eq!(scripts[13].start_s, 435.0);
        for script in &scripts {
            assert!(script.openings[..RATE_HZ].iter().all(|&u| u == (0.0, 0.0)));
            // The two valves are never open at the same time.
            assert!(script.openings.iter().all(|&(i, o)| i * o == 0.0));
        }
    }

    #[test]
    fn longer_pauses_shift_the_starts() {
        let paper = session(&mut RandomGenerator::new(1, 1));
        let spread = with_pauses(paper.clone(), || 20.0);
        assert_eq!(spread[0], paper[0]);
        assert_eq!(spread[13].start_s, paper[13].start_s + 13.0 * 5.0);
    }
}

//! Any small log of a gauge alone or of a whole rig: `diagnose` refuses, is stopped, or answers.
//!
//! The work is bounded as a user bounds it: the diagnosis asks whether it shall stop, and after so many times it shall.
#![no_main]

use std::sync::atomic::{AtomicUsize, Ordering};

use libfuzzer_sys::fuzz_target;
use stretch_data::SessionTrial;
use stretch_fuzz::trial;
use stretch_gap::{Options, Simulator, diagnose};
use stretch_problem::{GaugeSetup, GaugeSimulator, RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, Rig};

/// Times that it may ask.
const ASKED: usize = 40;

fuzz_target!(|bytes: &[u8]| {
    let Some((which, stream)) = bytes.split_first() else { return };
    let catalogue = Catalogue::default();
    let columns = [
        ("length_mm", 150.0, 180.0),
        ("bridge_v", 1.24, 2.1),
        ("inlet", 0.0, 1.0),
        ("outlet", 0.0, 1.0),
        ("pressure_kpa", 0.0, 400.0),
    ];
    let width = if which & 1 == 0 { 2 } else { 4 + usize::from(which >> 1 & 1) };
    // few bytes are a long log: what they say, again and again
    let often = 1 + usize::from(which >> 2 & 15);
    let trials = [SessionTrial::new(trial(&stream.repeat(often), &columns[..width], 1500))];
    let mut options =
        Options { depth: std::num::NonZeroUsize::MIN, threads: 1, ..Options::default() };
    options.seed = u64::from(*which);
    let asked = AtomicUsize::new(0);
    let stop = || asked.fetch_add(1, Ordering::Relaxed) > ASKED;
    let run = |simulator: &dyn Simulator| drop(diagnose(simulator, &options, &|_| {}, &stop));
    if width == 2 {
        let (reference, signal) = ("length_mm", "bridge_v");
        let setup =
            GaugeSetup { trials: &trials, reference, signal, rig: None, catalogue: &catalogue };
        if let Ok(gauge) = GaugeSimulator::new(&setup) {
            run(&gauge);
        }
        return;
    }
    let made = RigSession::new(&trials).and_then(|session| {
        RigSimulator::new(RigSetup { session, rig: Rig::default(), catalogue: &catalogue })
    });
    if let Ok(rig) = made {
        run(&rig);
    }
});

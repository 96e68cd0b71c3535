//! Any text as a rig file: no panic; a rig that is accepted runs, a tenth of a second of it.
#![no_main]

use libfuzzer_sys::fuzz_target;
use stretch_data::RigFile;
use stretch_sim::{GaugeRig, Rig, RunSettings, Session, TrialPlan};

fuzz_target!(|text: &str| {
    let Ok(file) = RigFile::parse("fuzz", text) else { return };
    let _ = GaugeRig::from_file(&file);
    let _ = RunSettings::from_file(&file);
    let Ok(rig) = Rig::from_file(&file) else { return };
    assert!(Rig::from_file(&rig.to_file(None)).is_ok());
    if let Ok(mut session) = Session::new(&rig, &RunSettings::default()) {
        let mut plan = TrialPlan::inflation(1.0);
        plan.inlet.truncate(10);
        plan.outlet.truncate(10);
        if let Ok((_, trial)) = session.run(&plan) {
            assert!(trial.check().is_ok());
        }
    }
});

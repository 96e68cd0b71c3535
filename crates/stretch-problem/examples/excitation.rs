//! How often slack and saturation are parted with and without one trial at 0.7 of the excitation.
//!
//! Twenty simulated sessions, ten of each, of the catalogue's own forms; each is diagnosed as it stands and with the further trial.
//!
//! `cargo run --release -p stretch-problem --example excitation`

#[path = "../tests/support/mod.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod support;

use stretch_data::{Channel, SessionTrial};
use stretch_gap::{Diagnosis, Options, diagnose};
use stretch_problem::{RigSession, RigSetup, RigSimulator};
use stretch_sim::{Catalogue, EffectSet, Key, Rig};
use support::{effects::effect, rigs::own_rig, session::session};

/// Share of the excitation in the further trial.
const LOW: f64 = 0.7;
/// Sessions of each effect.
const EACH: u64 = 10;

fn diagnosed(trials: &[SessionTrial]) -> Result<Diagnosis, Box<dyn std::error::Error>> {
    let catalogue = Catalogue::default();
    let setup =
        RigSetup { session: RigSession::new(trials)?, rig: Rig::default(), catalogue: &catalogue };
    let options = Options { depth: 2, ..Options::default() };
    Ok(diagnose(&RigSimulator::new(setup)?, &options, &|_| (), &|| false)?.0)
}

/// The session, and the same with a further trial to fit at [`LOW`] of the excitation.
fn sessions(effects: &EffectSet, seed: u64) -> [Vec<SessionTrial>; 2] {
    let plain = session(&own_rig(), effects, true, seed);
    let mut params = own_rig();
    params[Key::VExc] *= LOW;
    let mut low = session(&params, effects, true, seed + 1000).remove(1);
    let channel = Channel { name: "excitation_share".into(), values: vec![LOW; low.trial.len()] };
    low.trial.channels.push(channel);
    low.trial.name = "arbitrary_low.csv".into();
    low.start_s = plain[3].start_s;
    let mut more = plain.clone();
    // Tested on last, a trial and a pause later.
    more[3].start_s += 40.0;
    more.insert(3, low);
    [plain, more]
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Right alone, right or tied, wrong.
    let mut counts = [[0_usize; 3]; 2];
    for case in 0..2 * EACH {
        let strength = 0.3 + 0.07 * (case / 2) as f64;
        let (name, effects) = match case % 2 {
            0 => ("sleeve_slack", effect("sleeve_slack", &[("e_s", 0.03 + 0.07 * strength)])),
            _ => {
                let rail = 2.33 - 0.3 * strength;
                ("amplifier_saturation", effect("amplifier_saturation", &[("v_hi", rail)]))
            }
        };
        for (which, trials) in sessions(&effects, 20 + case).iter().enumerate() {
            let found = diagnosed(trials)?;
            let is = |names: &[String]| names.iter().any(|n| n == name);
            let kind = match (is(&found.named), is(&found.tied), found.tied.is_empty()) {
                (true, _, true) => 0,
                (true, ..) | (_, true, _) => 1,
                _ => 2,
            };
            counts[which][kind] += 1;
            println!("{name} {strength:.2} {which}: {:?} tied {:?}", found.named, found.tied);
        }
    }
    println!("| trials | right | tied | wrong |\n|---|---|---|---|");
    for (told, [right, tied, wrong]) in ["as they stand", "and one at 0.7"].iter().zip(counts) {
        println!("| {told} | {right} | {tied} | {wrong} |");
    }
    Ok(())
}

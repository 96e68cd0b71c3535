//! Every effect of the catalogue, simulated and diagnosed as a new user would.

use std::{fs, path::Path};

use crate::support::{
    Scratch,
    round_trip::{diagnosed, is_agreed, replayed},
    stretch,
};
use serde_json::Value;
use stretch_sim::{CATALOGUE, Effect};
use testkit::random::Random;

/// Returns the effect as an option, with a strength in the middle of the lower half of its range, a
/// single threshold, and typical shapes.
fn spelled(effect: &Effect) -> String {
    // At 50 Hz and phase 0, every sample at 100 Hz would coincide with a zero of the wave.
    let fixed = match effect.name {
        "mains_hum" => return "mains_hum:a=0.02,f=60,phase=1".into(),
        "amplifier_saturation" => return "amplifier_saturation:v_hi=2.1".into(),
        name => name,
    };
    let values = effect.parameters.iter().map(|p| format!("{}={}", p.name, p.typical));
    format!("{fixed}:{}", values.collect::<Vec<_>>().join(","))
}

/// Difference of scores, in nats, up to which two candidates fit equally well. The choice between
/// two ends of a saturation costs ln 2 of it.
const TIE: f64 = 1.0;

/// Whether a diagnosis ranks an effect first, or ties it with another that fits equally well: a
/// sleeve that goes slack and an amplifier that saturates may be ranked in either order.
fn is_first(diagnosis: &Value, effect: &Effect) -> bool {
    let all = diagnosis["candidates"].as_array().unwrap();
    let own = all.iter().filter(|c| c["effects"][0] == effect.name);
    let own = own.filter_map(|c| c["score"].as_f64()).fold(f64::NEG_INFINITY, f64::max);
    let is_tied = all[0]["score"].as_f64().is_some_and(|score| score - own <= TIE);
    diagnosis["named"][0] == effect.name || is_tied
}

/// Share of the closed gap up to which the remaining gap counts as a mismatch of the first
/// diagnosis. Play acts on the motion, which a diagnosis knows only up to noise, and the error is
/// visible where the motion reverses.
const MISMATCH: f64 = 0.005;
/// Root mean square distance of a noise-free replay from the measurement, relative to the noise.
/// The noise alone gives 1.
const REPLAYED: f64 = 1.15;

/// Removes the pressure column and the digests from every trial of a data set.
fn without_pressure(folder: &Path) {
    let index = folder.join("dataset.toml");
    let text = fs::read_to_string(&index).unwrap();
    let kept = text.lines().filter(|line| !line.starts_with("digest"));
    fs::write(index, kept.map(|line| format!("{line}\n")).collect::<String>()).unwrap();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "csv") {
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let at = head.iter().position(|column| *column == "pressure_kpa").unwrap();
        let line = |line: &str| {
            let cells = line.split(',').enumerate().filter(|(i, _)| *i != at);
            cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",") + "\n"
        };
        fs::write(&path, text.lines().map(line).collect::<String>()).unwrap();
    }
}

#[test]
#[ignore = "every effect of the catalogue, minutes; ./ci.sh runs it"]
fn is_named_and_agreed_with_once_it_is_written_into_the_rig_file() {
    let scratch = Scratch::new();
    let mut wrong = Vec::new();
    for effect in CATALOGUE {
        let (folder, fixed) = (scratch.path(effect.name), scratch.path("fixed.toml"));
        let given = spelled(effect);
        stretch().args(["simulate", "--effect", &given, "--out"]).arg(&folder).assert().success();
        for pressure in ["with", "without"] {
            if pressure == "without" {
                without_pressure(&folder);
            }
            let first = diagnosed(&scratch, &folder, None, Some(&fixed));
            let again = diagnosed(&scratch, &folder, Some(&fixed), None);
            // All trials in one session, because a trial may depend on the one before through
            // memory effects.
            let apart = replayed(&scratch, &fixed, &folder, &folder);
            let [before, left] = [&first, &again].map(|d| d["gap"]["retuned"].as_f64().unwrap());
            println!(
                "{given}, {pressure} pressure: {} at {}, then {} ({before:.3} -> {left:.3} times the noise's variance), replayed {}",
                first["named"],
                first["candidates"][0]["probability"],
                again["verdict"],
                apart.iter().map(|(c, x)| format!("{c} {x:.3}")).collect::<Vec<_>>().join(", ")
            );
            let is_mismatch = left <= MISMATCH * before;
            let is_replayed = apart.iter().all(|(_, noises)| *noises < REPLAYED);
            if pressure == "with" && !is_first(&first, effect) {
                wrong.push(format!("{given}: {}", first["sentence"]));
            }
            if !(is_agreed(&again) || is_mismatch) || !is_replayed {
                wrong.push(format!("{given}, {pressure} pressure: {}", again["sentence"]));
            }
        }
        fs::remove_dir_all(&folder).unwrap();
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Number of pairs of effects that are tested.
const SETS_OF_TWO: usize = 20;

/// Draws two different effects of the catalogue, each at its typical strength.
fn set_of_two(random: &mut Random) -> [&'static Effect; 2] {
    let mut drawn = || CATALOGUE[(random.unit() * CATALOGUE.len() as f64) as usize];
    loop {
        let pair = [drawn(), drawn()];
        if pair[0].name != pair[1].name {
            return pair;
        }
    }
}

#[test]
#[ignore = "twenty sets of two effects, minutes; ./ci.sh runs it"]
fn a_set_of_two_is_agreed_with_once_it_is_written_into_the_rig_file() {
    let scratch = Scratch::new();
    let mut random = Random::new(26);
    let mut wrong = Vec::new();
    for _ in 0..SETS_OF_TWO {
        let pair = set_of_two(&mut random).map(spelled);
        let (folder, fixed) = (scratch.path("pair"), scratch.path("fixed.toml"));
        let mut command = stretch();
        command.args(["simulate", "--out"]).arg(&folder);
        for given in &pair {
            command.args(["--effect", given]);
        }
        command.assert().success();
        let first = diagnosed(&scratch, &folder, None, Some(&fixed));
        let again = diagnosed(&scratch, &folder, Some(&fixed), None);
        let [before, left] = [&first, &again].map(|d| d["gap"]["retuned"].as_f64().unwrap());
        println!(
            "{}: {} then {} {} (gap {before:.3} -> {left:.3})",
            pair.join(" "),
            first["named"],
            again["verdict"],
            again["named"]
        );
        if !(is_agreed(&again) || left <= MISMATCH * before) {
            wrong.push(format!("{}: {}", pair.join(" "), again["sentence"]));
        }
        fs::remove_dir_all(&folder).unwrap();
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

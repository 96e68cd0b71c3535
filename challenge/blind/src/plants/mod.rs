//! Makes open sets, on which other methods can be tested: folders of cases of a plant, with sealed
//! labels, from a seed.
//!
//! `servo` and `thermal` define two plants with two stages each. `plant` integrates them, with operators in front of
//! and behind the stages. `draw` makes a case. `label` has the families of forms and the labels.

mod draw;
mod label;
mod plant;
mod servo;
mod thermal;

use std::{collections::BTreeMap, fmt::Write as _, fs, path::Path};

use rayon::prelude::*;

pub use self::label::{Form, FormFamily, Level, OpenLabel, OpenTruth, sealed_beside};
use self::{
    draw::{Drawn, FIT_TRIALS, draw},
    plant::PlantSpec,
    servo::SERVO,
    thermal::THERMAL,
};
use crate::{
    effect::{Kind, worded},
    error::BlindError,
    make::{make, write},
    plan::Plan,
    seal,
    truth::{CaseKind, Truth},
};

worded! {
    /// The plant of a set.
    PlantName {
        /// Valve, muscle and gauge: the rig of the project.
        Rig "rig",
        /// A motor with a gearbox and a load.
        Servo "servo",
        /// A heated block with a probe.
        Thermal "thermal",
    }
}

/// Files of the nominal simulators that are copied into a set.
const SIMULATORS: [(&str, &str); 4] = [
    ("worker.py", include_str!("../../../python/worker.py")),
    ("plant.py", include_str!("../../../python/plant.py")),
    ("servo.py", include_str!("../../../python/servo.py")),
    ("thermal.py", include_str!("../../../python/thermal.py")),
];

/// Makes `cases` cases of a plant in the new folder `set`, with the labels in the folder `sealed`.
/// Returns the SHA-256 of the labels. The caller may rename both folders later.
///
/// Levels alternate, so that a fifth of the cases has each level. `private` is a family of forms
/// and noise in addition to the published ones. The rig has five families and does not use it.
///
/// # Errors
/// A folder that is not empty, a file that cannot be written, a private family for the rig.
///
/// ```
/// use stretch_blind::{PlantName, make_set, sealed_beside};
/// let dir = tempfile::tempdir()?;
/// let set = dir.path().join("set");
/// let hash = make_set(PlantName::Servo, (&set, &sealed_beside(&set)), 5, 7, None)?;
/// assert_eq!(hash.len(), 64);
/// assert!(set.join("case-004/problem.toml").is_file());
/// assert!(dir.path().join("set-sealed/truth.json").is_file());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn make_set(
    plant: PlantName,
    (set, sealed): (&Path, &Path),
    cases: usize,
    seed: u64,
    private: Option<FormFamily>,
) -> Result<String, BlindError> {
    for path in [set, sealed] {
        if path.read_dir().is_ok_and(|mut inside| inside.next().is_some()) {
            return Err(BlindError::Occupied { path: path.to_path_buf() });
        }
    }
    let spec = match plant {
        PlantName::Servo => &SERVO,
        PlantName::Thermal => &THERMAL,
        PlantName::Rig if private.is_some() => {
            let reason = "the rig's forms have families of its own: leave it out";
            return Err(BlindError::field("private", reason));
        }
        PlantName::Rig => return finish((set, sealed), &make_rig(set, cases, seed)?),
    };
    for (name, text) in SIMULATORS {
        write(&set.join("simulator").join(name), text)?;
    }
    let families: Vec<FormFamily> = FormFamily::published().into_iter().chain(private).collect();
    let labels: Result<BTreeMap<_, _>, BlindError> = (0..cases)
        .into_par_iter()
        .map(|number| {
            let name = format!("case-{number:03}");
            let case = draw(spec, seed, number, &families);
            write_case(spec, &set.join(&name), &name, &case)?;
            Ok((name, case.label))
        })
        .collect();
    let place = |stage: usize| spec.stages[stage].name.to_owned();
    let candidates = spec.candidates.iter().map(|c| (c.name.to_owned(), place(c.stage))).collect();
    let plant = spec.name.to_owned();
    finish((set, sealed), &OpenTruth { schema: 1, plant, seed, candidates, cases: labels? })
}

/// Seals the labels, and writes `set.toml` with the plant, the hash and the names, which a method
/// may know.
fn finish((set, sealed): (&Path, &Path), truth: &OpenTruth) -> Result<String, BlindError> {
    let hash = seal::close(set, &sealed.join("truth.json"), "truth.json", truth)?;
    let mut text = format!("schema = 1\nplant = {:?}\nset = \"{hash}\"\n", truth.plant);
    let _ = writeln!(text, "cases = {:?}", truth.cases.keys().collect::<Vec<_>>());
    for (name, place) in &truth.candidates {
        let _ = write!(text, "\n[[candidate]]\nname = {name:?}\nplace = {place:?}\n");
    }
    write(&set.join("set.toml"), &text)?;
    Ok(hash)
}

fn write_case(
    plant: &PlantSpec,
    folder: &Path,
    name: &str,
    case: &Drawn,
) -> Result<(), BlindError> {
    let mut text = problem(plant, name);
    for (trial, (drive, outputs)) in case.drives.iter().zip(&case.outputs).enumerate() {
        let [first, second] = [0, 1].map(|s| plant.stages[s].output);
        let mut csv = format!("time_s,{},{first},{second}\n", plant.input);
        let rows = drive.input.iter().zip(&outputs[0]).zip(&outputs[1]);
        for (i, ((u, a), b)) in rows.enumerate() {
            let time = plant.dt_s * i as f64;
            let _ = writeln!(csv, "{time:.2},{u:.6},{a:.5},{b:.5}");
        }
        write(&folder.join(format!("trial_{trial}.csv")), &csv)?;
        let split = if trial < FIT_TRIALS { "fit" } else { "test" };
        let _ = write!(text, "\n[[trial]]\nfile = \"trial_{trial}.csv\"\nsplit = \"{split}\"\n");
    }
    write(&folder.join("problem.toml"), &text)
}

fn problem(plant: &PlantSpec, name: &str) -> String {
    let wrap: Vec<&str> =
        plant.candidates.iter().map(|c| c.name).filter(|name| name.contains('.')).collect();
    let mut text = format!(
        "name = {name:?}\ntime_unit = \"s\"\nwrap = {wrap:?}\n\n[simulator]\ncommand = [\"python3\", \"../simulator/worker.py\", {:?}]\n\n\
         [[input]]\ncolumn = {:?}\nunit = {:?}\nnoise = 0.0\n",
        plant.name, plant.input, plant.input_unit
    );
    let mut driver = plant.input;
    for stage in &plant.stages {
        let _ = write!(
            text,
            "\n[[stage]]\nname = {:?}\noutput = {:?}\nunit = {:?}\ninputs = [{driver:?}]\nnoise = {:?}\n",
            stage.name, stage.output, stage.unit, stage.noise
        );
        driver = stage.output;
    }
    for p in plant.parameters {
        let _ = write!(
            text,
            "\n[[parameter]]\nname = {:?}\nunit = {:?}\nvalue = {:?}\ntolerance = \"{} %\"\nstages = [{:?}]\n",
            p.name,
            p.unit,
            p.value,
            100.0 * p.tolerance,
            plant.stages[p.stage].name
        );
    }
    format!("{text}\n{}", plant.effects)
}

/// Excess below which a single effect has the level `faint`.
const FAINT: f64 = 1.0;

/// Makes cases of the rig in the layout of an open set, with the generator and the forms of the sealed
/// check.
fn make_rig(set: &Path, cases: usize, seed: u64) -> Result<OpenTruth, BlindError> {
    let each = cases / 5;
    let plan = Plan {
        single: cases - 3 * each,
        null: each,
        compound: each,
        out_of_catalogue: each,
        dominant: 0,
        struck: 0,
        excess: (0.1, 100.0),
        ..Plan::of(0)
    };
    make(set, seed, &plan, &|_| ())?;
    let (labels, _) = Truth::open(set)?;
    // remove the labels from the set; they are written to the neighbouring folder
    let inside = set.join("sealed");
    fs::remove_dir_all(&inside).map_err(BlindError::io(&inside))?;
    let mut opened = BTreeMap::new();
    for (name, label) in labels.cases {
        let problem =
            format!("name = {name:?}\n\n[simulator]\nbuiltin = \"rig\"\ndata_set = \".\"\n");
        write(&set.join(&name).join("problem.toml"), &problem)?;
        let level = match label.kind {
            CaseKind::Null => Level::Nothing,
            CaseKind::OutOfCatalogue => Level::Foreign,
            CaseKind::Single if label.excess < FAINT => Level::Faint,
            CaseKind::Single => Level::Strong,
            _ => Level::Two,
        };
        let truth = OpenLabel {
            level,
            effects: label.effects,
            places: label.stages.iter().map(|s| s.name().to_owned()).collect(),
            excess: label.excess,
            oracle_closed: if level == Level::Nothing { 0.0 } else { 1.0 },
            family: label.family.name().to_owned(),
            strengths: label.acting.iter().map(|a| a.strength).collect(),
            forms: Vec::new(),
            parameters: label.parameters,
        };
        opened.insert(name, truth);
    }
    let known = Kind::catalogued().iter().map(|kind| kind.spec());
    let candidates = known.map(|s| (s.name.to_owned(), s.stage.name().to_owned())).collect();
    Ok(OpenTruth { schema: 1, plant: "rig".to_owned(), seed, candidates, cases: opened })
}

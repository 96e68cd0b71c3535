//! Writes a first problem file for a folder of recordings. Comments in the file say which entries are guessed.

use std::path::{Path, PathBuf};

use stretch_data::{
    Quantity, SessionTrial, Trial, ends, in_digits, significant, toml_comment, unit, unit_of,
};
use stretch_gap::Noise;
use stretch_recording::{ReadOptions, Recording};

use crate::{bench::columns::Columns, error::ProblemError};

/// Usual names of the column of time.
const TIMES: [&str; 10] =
    ["time_s", "time_ms", "time_us", "time_ns", "time", "t_s", "t", "timestamp", "Time", "stamp_s"];
/// Parts of the names that commands usually have.
const COMMANDS: [&str; 12] = [
    "cmd", "command", "ref", "target", "goal", "setpoint", "action", "input", "duty", "pwm",
    "desired", "demand",
];
/// File extensions of recordings.
const RECORDINGS: [&str; 11] =
    ["csv", "tsv", "txt", "gz", "npy", "npz", "mat", "h5", "hdf5", "mcap", "parquet"];
/// Greatest number of columns that are listed one by one.
const LISTED: usize = 40;

/// The text of a first `problem.toml` for a folder of recordings.
///
/// # Errors
/// There is no recording in the folder that can be read.
///
/// ```
/// let folder = std::env::temp_dir().join(format!("stretch-init-{}", std::process::id()));
/// std::fs::create_dir_all(&folder)?;
/// let rows: String = (0..200).map(|i| format!("{},{},{}\n", 0.01 * i as f64, i / 50, 0.5 * i as f64)).collect();
/// for name in ["a.csv", "b.csv"] {
///     std::fs::write(folder.join(name), format!("time_s,command_V,angle_deg\n{rows}"))?;
/// }
/// let text = stretch_problem::first_problem(&folder)?;
/// let file = stretch_problem::ProblemSpec::parse("problem.toml", &text)?;
/// assert_eq!(file.stages[0].inputs, ["command_V"]);
/// assert_eq!(file.stages[0].output, "angle_deg");
/// assert_eq!(file.files[1].split, stretch_data::Split::Test);
/// # std::fs::remove_dir_all(&folder)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn first_problem(folder: impl AsRef<Path>) -> Result<String, ProblemError> {
    let folder = folder.as_ref();
    let shown = folder.display().to_string();
    let (trials, time, left) = recordings(folder)?;
    let Some((_, first)) = trials.first() else {
        let found = match left.first() {
            Some(why) => format!("no recording in it could be read; the error of the first: {why}"),
            None => "there is no recording in it".to_owned(),
        };
        let hint = "put recordings with named columns and a time column there";
        return Err(ProblemError::value(shown, found, hint));
    };
    Ok(text(folder, &trials, first, &time, &left))
}

type Found = (Vec<(String, Trial)>, String, Vec<String>);

/// Recordings that can be read, their column of time, and why the other recordings cannot be read.
fn recordings(folder: &Path) -> Result<Found, ProblemError> {
    let fail = |e: std::io::Error| {
        ProblemError::value(
            folder.display().to_string(),
            e.to_string(),
            "give a folder of recordings",
        )
    };
    let entries = std::fs::read_dir(folder).map_err(fail)?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|e| e.path()).collect();
    let is_table = |p: &PathBuf| {
        let end = p.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
        p.is_file() && RECORDINGS.contains(&end.as_str())
    };
    files.retain(is_table);
    files.sort();
    let (mut trials, mut left, mut time) = (Vec::new(), Vec::new(), None::<String>);
    for path in files {
        let names: Vec<String> =
            time.clone().map_or_else(|| TIMES.map(str::to_owned).to_vec(), |t| vec![t]);
        let mut why = None;
        let read = names.into_iter().find_map(|name| {
            match Recording::read(&path, &ReadOptions::new().time(&name)) {
                Ok(recording) => Some((recording.trial, name)),
                Err(error) => {
                    why.get_or_insert(error);
                    None
                }
            }
        });
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match (read, why) {
            (Some((trial, column)), _) if !trial.channels.is_empty() => {
                time = Some(column);
                trials.push((name, trial));
            }
            (_, Some(why)) => left.push(why.to_string()),
            _ => left.push(format!("{name}: it has no column except its time")),
        }
    }
    Ok((trials, time.unwrap_or_else(|| "time_s".into()), left))
}

/// A column of the recordings, and whether it looks like a command.
struct Known {
    name: String,
    range: [f64; 2],
    is_called: bool,
    is_held: bool,
}

impl Known {
    /// Whether the column repeats most of its samples, or has a name like a command.
    fn is_command(&self) -> bool {
        self.is_called || self.is_held
    }
}

fn known(trials: &[(String, Trial)], first: &Trial) -> Vec<Known> {
    let in_all = |name: &str| trials.iter().all(|(_, t)| t.channel(name).is_some());
    let names = first.channels.iter().map(|c| c.name.clone()).filter(|name| in_all(name));
    names
        .map(|name| {
            let all = || trials.iter().filter_map(|(_, t)| t.channel(&name));
            let held: usize = all().map(|v| v.windows(2).filter(|w| w[0] == w[1]).count()).sum();
            let samples: usize = all().map(<[f64]>::len).sum();
            let is_called = is_called(&name);
            let is_held = 2 * held > samples;
            Known { range: ends(all().flatten()).into(), is_called, is_held, name }
        })
        .collect()
}

/// Whether a name is like that of a command. `action` is also the end of other words: contraction, reaction.
fn is_called(name: &str) -> bool {
    let low = name.to_lowercase();
    let begins = |at: usize| !low[..at].ends_with(char::is_alphabetic);
    let has = |word: &&str| low.match_indices(*word).any(|(at, _)| *word != "action" || begins(at));
    COMMANDS.iter().any(has) || low.starts_with("u_")
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

fn text(
    folder: &Path,
    trials: &[(String, Trial)],
    first: &Trial,
    time: &str,
    left: &[String],
) -> String {
    let columns = known(trials, first);
    let name = folder.canonicalize().ok();
    let name = name.as_deref().and_then(Path::file_name).map(|n| n.to_string_lossy().into_owned());
    let mut out = "# A first problem from the recordings in this folder. Comments say which entries were guessed: correct them.\n"
        .to_owned();
    out += &format!("name = {}\n", quoted(name.as_deref().unwrap_or("problem")));
    if time != "time_s" {
        out += &format!("time = {}\n", quoted(time));
    }
    for why in left {
        out += &toml_comment(&format!("left out: {why}"));
    }
    out += "\n# Wrappers that are looked for around every stage: all, or a list as [\"input.delay\", \"output.backlash\"].\n";
    out += "wrap = \"all\"\n";
    out += "\n# The simulator: a worker, which answers requests on its standard input, or python = \"module:object\", or builtin = \"rig\" or \"gauge\".\n";
    out += "[simulator]\ncommand = [\"python3\", \"sim.py\"]  # guessed: write your own command\n";
    out += "\n# Columns, with the least and the greatest value:\n";
    for c in columns.iter().take(LISTED) {
        let kind = if c.is_command() { ", constant at times or named like a command" } else { "" };
        let unit = match unit(&c.name) {
            Some(_) => unit_of(&c.name),
            None => "its name states no unit".to_owned(),
        };
        out += &toml_comment(&format!(
            "  {} ({unit}): {} to {}{kind}",
            c.name, c.range[0], c.range[1]
        ));
    }
    out += &stage(&columns, trials);
    out += "\n# Parameters of the simulator, each with its tolerance: one standard deviation.\n";
    out += "# [[parameter]]\n# name = \"gain\"\n# unit = \"1\"\n# value = 1.0\n# tolerance = \"10 %\"  # or a number in its unit\n";
    out += "\n# Effects that the simulator has itself, each with the value at which the effect does nothing.\n";
    out += "# [[effect]]\n# name = \"dof_frictionloss\"\n# unit = \"Nm\"\n# range = [0, 2]\n# off = 0\n";
    out + &trials_of(trials)
}

/// The text in place of a stage if no column looks measured.
const NO_OUTPUT: &str = "
# No output is proposed: every column that changes is named like a command. Name the one that was measured:
# [[stage]]
# name = \"plant\"
# output = \"COLUMN\"
# inputs = [\"COLUMN\"]
";

fn stage(columns: &[Known], trials: &[(String, Trial)]) -> String {
    let moves = |c: &&Known| c.range[1] > c.range[0];
    let moving = || columns.iter().filter(moves);
    // A coarse encoder also repeats its values. A column with a name like a command, and an estimate, is never an
    // output.
    let may_be = |c: &&Known| !c.is_called && !c.name.starts_with("estimate");
    let output = moving().rfind(|c| may_be(c) && !c.is_held).or(moving().rfind(|c| may_be(c)));
    let Some(own) = output.map(|c| c.name.as_str()) else {
        return NO_OUTPUT.to_owned();
    };
    let commands = moving().filter(|c| c.is_command() && c.name != own);
    let mut commands: Vec<&str> = commands.map(|c| c.name.as_str()).collect();
    if commands.is_empty() {
        // A measured force drives the output, unless the output is a force too. A single other column drives it as well.
        let is_force = |name: &&str| Quantity::of(name, "").is_some_and(Quantity::is_force);
        let others = moving().map(|c| c.name.as_str()).filter(|name| *name != own);
        let others: Vec<&str> = others.filter(|name| !name.starts_with("estimate")).collect();
        commands = match others[..] {
            [only] => vec![only],
            _ => others.into_iter().filter(|name| is_force(name) && !is_force(&own)).collect(),
        };
    }
    let inputs: Vec<String> = commands.iter().map(|name| quoted(name)).collect();
    let mut out = "\n# Guessed: the last column that is not a command is the output, and the commands drive the stage.\n"
        .to_owned();
    out += &format!("[[stage]]\nname = \"plant\"\noutput = {}\n", quoted(own));
    if unit(own).is_none() {
        out += "unit = \"\"  # the name states no unit\n";
    }
    out += &format!("inputs = [{}]\n", inputs.join(", "));
    out += &match noise(own, &commands, trials) {
        Some(noise) => format!(
            "noise = {}  # one standard deviation, measured: {}\n",
            significant(noise.sd(), 3),
            noise.source()
        ),
        None => "# noise = 0.01     # one standard deviation, if the noise is known; otherwise it is estimated from the recordings\n".to_owned(),
    };
    let guessed = rubbing(own, &commands, moving().filter(|c| !c.is_called).map(|c| &*c.name));
    out + &match guessed {
        Some((key, column)) => {
            format!("{key} = {}  # guessed: motion at which friction acts\n", quoted(column))
        }
        None => {
            "# velocity = \"COLUMN\"  # or position = \"COLUMN\": motion at which friction acts\n"
                .to_owned()
        }
    }
}

/// The column that gives the motion of the parts with friction, and its key (`velocity` or `position`). It is the
/// output if that is a position, an angle or a speed, otherwise another measured column of one of these quantities.
/// `None` if commands are known and none of them can be a force or a torque.
fn rubbing<'a>(
    output: &'a str,
    commands: &[&str],
    measured: impl DoubleEndedIterator<Item = &'a str>,
) -> Option<(&'static str, &'a str)> {
    let of = |column: &str| Quantity::of(column, "");
    let may_push = |c: &&str| of(c).is_none_or(Quantity::is_force);
    if !commands.is_empty() && !commands.iter().any(may_push) {
        return None;
    }
    let mut all = std::iter::once(output).chain(measured.rev());
    all.find_map(|column| match of(column)? {
        Quantity::Speed => Some(("velocity", column)),
        quantity => quantity.is_position().then_some(("position", column)),
    })
}

/// The noise of an output while its commands are constant, in all recordings except the test
/// recordings.
fn noise(output: &str, commands: &[&str], trials: &[(String, Trial)]) -> Option<Noise> {
    let fitted = trials.iter().zip(is_tested(trials)).filter(|(_, is_tested)| !is_tested);
    let fitted: Vec<_> = fitted.map(|((_, t), _)| SessionTrial::new(t.clone())).collect();
    let names = [output].iter().chain(commands).map(|name| (*name).to_owned()).collect();
    let columns = Columns::even(&fitted, names, 1).ok()?;
    let commands: Vec<&[f64]> = commands.iter().map(|c| columns.all(c)).collect();
    Noise::of_rests(columns.all(output), &commands, &columns.ranges, columns.dt_s)
}

/// Whether each recording is kept for testing: the last quarter, the shorter of two, none of one.
fn is_tested(trials: &[(String, Trial)]) -> Vec<bool> {
    match trials {
        [_] => vec![false],
        [(_, a), (_, b)] => {
            let is_first = a.duration_s() < b.duration_s();
            vec![is_first, !is_first]
        }
        trials => (0..trials.len()).map(|i| i + trials.len().div_ceil(4) >= trials.len()).collect(),
    }
}

fn trials_of(trials: &[(String, Trial)]) -> String {
    let is_tested = is_tested(trials);
    let all = trials.len();
    let mut out = match is_tested.iter().filter(|is_tested| **is_tested).count() {
        0 => "\n# There is one trial: its last quarter is held back for the test.\n".to_owned(),
        1 if all == 2 => {
            "\n# Guessed: the shorter of 2 trials is used only for the test, once at the end.\n"
                .to_owned()
        }
        tested => format!(
            "\n# Guessed: the last {tested} of {all} trials are used only for the test, once at the end.\n"
        ),
    };
    for ((name, trial), is_tested) in trials.iter().zip(is_tested) {
        let split = if is_tested { "test" } else { "fit" };
        let rate = trial
            .rate_hz()
            .map_or(String::new(), |hz| format!(", {} samples a second", in_digits(hz, 6)));
        out +=
            &format!("\n[[trial]]\nfile = {}  # {:.2} s{rate}\n", quoted(name), trial.duration_s());
        out += &format!("split = {split:?}\n");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn column(name: &str, is_held: bool) -> Known {
        Known { name: name.into(), range: [0.0, 1.0], is_called: is_called(name), is_held }
    }

    #[test]
    fn the_shorter_of_two_recordings_is_the_test() {
        let trial = |seconds: f64| {
            let trial =
                Trial { name: String::new(), time_s: vec![0.0, seconds], channels: Vec::new() };
            (String::new(), trial)
        };
        assert_eq!(is_tested(&[trial(5.0), trial(9.0)]), [true, false]);
        assert_eq!(is_tested(&[5.0; 2].map(trial)), [false, true]);
        assert_eq!(is_tested(&[5.0; 5].map(trial)), [false, false, false, true, true]);
        assert_eq!(is_tested(&[trial(5.0)]), [false]);
    }

    #[test]
    fn a_command_is_never_proposed_as_the_output() {
        let trial = |names: &[&str]| {
            let channels = names.iter().map(|name| stretch_data::Channel {
                name: (*name).to_owned(),
                values: vec![0.0, 1.0],
            });
            Trial { name: "a".into(), time_s: vec![0.0, 0.01], channels: channels.collect() }
        };
        let of = |columns: &[Known]| {
            let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
            stage(columns, &[("a".into(), trial(&names))])
        };
        // The command column comes after the measured column, and the encoder is so coarse that it
        // repeats its values.
        let coarse = of(&[column("angle_deg", true), column("command_V", false)]);
        assert!(coarse.contains("output = \"angle_deg\"\n"), "{coarse}");
        assert!(coarse.contains("inputs = [\"command_V\"]"), "{coarse}");
        // Friction acts at the output if that is a position or a speed, otherwise at another
        // measured column.
        for (columns, line) in [
            (["torque_nm", "q_rad"], "\nposition = \"q_rad\"  #"),
            (["u", "heading"], "\nposition = \"heading\"  #"),
            (["force_n", "speed_m_per_s"], "\nvelocity = \"speed_m_per_s\"  #"),
            (["duty_percent", "angle_deg"], "\n# velocity = \"COLUMN\""),
            (["torque_nm", "temperature"], "\n# velocity = \"COLUMN\""),
        ] {
            let text = of(&[column(columns[0], true), column(columns[1], false)]);
            assert!(text.contains(line), "{text}");
        }
        for (command, output) in [("action_0", "reaction_force_n"), ("torqueCmd", "contraction_mm")]
        {
            let text = of(&[column(command, false), column(output, false)]);
            assert!(text.contains(&format!("output = \"{output}\"\n")), "{text}");
            assert!(text.contains(&format!("inputs = [\"{command}\"]")), "{text}");
        }
        let measured = of(&[column("torque_nm", false), column("angle_rad", false)]);
        assert!(measured.contains("inputs = [\"torque_nm\"]"), "{measured}");
        assert!(measured.contains("\nposition = \"angle_rad\"  #"), "{measured}");
        // A sensor log with one other column, which is an input; an estimate is none.
        let log =
            of(&[column("gauge_mv", false), column("load_g", false), column("estimate_g", false)]);
        assert!(
            log.contains("output = \"load_g\"\n") && log.contains("inputs = [\"gauge_mv\"]"),
            "{log}"
        );
        let none = of(&[column("target_deg", false), column("goal_deg", true)]);
        assert!(!none.contains("\noutput =") && none.contains("No output is proposed"), "{none}");
    }
}

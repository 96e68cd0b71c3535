//! `stretch simulate`: writes a data set from the simulated rig.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use clap::builder::BoolishValueParser;
use stretch_data::files::{FileError, is_standard_output, write_folder};
use stretch_data::{DataError, DataSet, RigFile, TrialEntry};
use stretch_recording::{ReadOptions, Recording};
use stretch_sim::{Rig, RunSettings, Session, SimError, TrialPlan, default_rig_text, paper_preset};

use super::{
    reading::read_recording,
    shared::{detail, give_stdout, of_files, or_force, progress, say_as_is, tell},
};

/// Simulate trials of the rig and write them as a data set
///
///   stretch simulate --protocol paper --effect gauge_hysteresis:h=0.2,s=0.012 --out bench
///
/// Without --rig the stock rig is simulated, which --print-rig prints; `stretch effects`
/// lists what can be added to it. The folder gets the trials, dataset.toml, and
/// rig.toml with every parameter, effect and the seed, from which the run can be
/// repeated bit by bit on any machine:
///
///   stretch simulate --protocol paper --rig bench/rig.toml --out again
///
/// --protocol next.csv replays a recorded or recommended trial: its valve openings,
/// excitation_share, set_length_mm and shunt_share. A column with any other command is
/// refused, with its name. A single trial begins a new session, without memory of
/// earlier trials; a folder is replayed as one session.
///
/// dataset.toml does not name rig.toml as its rig, because a diagnosis starts from the
/// simulator without the effects (nominal.toml if it is not the stock rig).
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// Rig file, or `paper`: a rig with effects as large as in the paper [default: the stock rig]
    #[arg(long, value_name = "rig.toml|paper")]
    rig: Option<PathBuf>,
    /// Valve commands: paper (17 trials), arbitrary or pulses (a minute each), or a trial or data set to replay
    ///
    /// paper: six inflations, six deflations, arbitrary, pulses, and three test trials. arbitrary: one minute of random segments.
    /// pulses: one minute of pulse pairs.
    #[arg(long, default_value = "paper", value_name = "NAME|trial.csv")]
    protocol: String,
    /// Add an effect, as NAME:PARAMETER=VALUE,...
    #[arg(long = "effect", value_name = "NAME:P=X", value_parser = parse_effect)]
    effects: Vec<EffectArg>,
    /// Noise and converter rounding [default: the rig file's, or on]
    #[arg(long, value_name = "on|off", hide_possible_values = true, value_parser = BoolishValueParser::new())]
    noise: Option<bool>,
    /// Seed of noise and random commands [default: the rig file's, or 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=RunSettings::MOST_SEED))]
    seed: Option<u64>,
    /// Folder for the data set; - for standard output, if a single trial is simulated
    #[arg(long, value_name = "DIR", required_unless_present = "print_rig")]
    out: Option<PathBuf>,
    /// Replace an existing data set; other files in its folder are kept
    #[arg(long)]
    force: bool,
    /// Print the stock rig as a rig file, with units and meanings, and simulate nothing
    #[arg(long, exclusive = true)]
    print_rig: bool,
}

/// An effect as given on the command line.
#[derive(Debug, Clone, PartialEq)]
struct EffectArg {
    name: String,
    values: Vec<(String, f64)>,
}

fn parse_effect(text: &str) -> Result<EffectArg, String> {
    let (name, rest) = text.split_once(':').unwrap_or((text, ""));
    let values = rest
        .split(',')
        .filter(|part| !part.trim().is_empty())
        .map(|part| {
            let pair = part.split_once('=');
            let number = pair.and_then(|(_, value)| value.trim().parse::<f64>().ok());
            match (pair, number) {
                (Some((name, _)), Some(value)) => Ok((name.trim().to_owned(), value)),
                _ => Err(format!("\"{part}\" is not PARAMETER=NUMBER; write NAME:P=X,Q=Y")),
            }
        })
        .collect::<Result<Vec<_>, String>>()?;
    let arg = EffectArg { name: name.trim().to_owned(), values };
    // Unknown names and values out of range are reported before the simulation.
    arg.add_to(&mut Rig::default()).map_err(|e| e.to_string())?;
    Ok(arg)
}

impl EffectArg {
    fn add_to(&self, rig: &mut Rig) -> Result<(), SimError> {
        let values: Vec<(&str, f64)> =
            self.values.iter().map(|(name, value)| (name.as_str(), *value)).collect();
        rig.effects.insert(&self.name, &values)
    }
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let Some(out) = args.out.as_deref().filter(|_| !args.print_rig) else {
        return say_as_is(default_rig_text().trim_end());
    };
    let (mut rig, written) = match &args.rig {
        Some(path) if path.as_os_str() == "paper" => (paper_preset()?, None),
        Some(path) => {
            let file = RigFile::read(path)?;
            let name = || path.display().to_string();
            (
                Rig::from_file(&file).with_context(name)?,
                RunSettings::from_file(&file).with_context(name)?,
            )
        }
        None => (Rig::default(), None),
    };
    for effect in &args.effects {
        effect.add_to(&mut rig)?;
    }
    let mut settings = written.unwrap_or_default();
    settings.seed = args.seed.unwrap_or(settings.seed);
    settings.noise = args.noise.unwrap_or(settings.noise);
    give_stdout([Some(out)])?;
    let plans = plans(&args.protocol, &rig, settings.seed)?;
    if is_standard_output(out) {
        return alone(out, &rig, &settings, &plans);
    }
    let written = write(out, args.force, &rig, &settings, &plans);
    written.map_err(|error| match error.downcast_ref::<DataError>() {
        Some(DataError::File(_)) => error,
        _ if error.is::<FileError>() => or_force(error),
        _ => of_files(error, args.rig.as_slice()),
    })?;

    let seconds: f64 = plans.iter().map(|p| p.inlet.len() as f64 / p.rate_hz).sum();
    let effects: Vec<&str> = rig.effects.iter().map(|e| e.name()).collect();
    let (trials, seed) = (plans.len(), settings.seed);
    let effects = if effects.is_empty() { "no effect".to_owned() } else { effects.join(", ") };
    tell(format!(
        "wrote {}: {trials} trials, {seconds:.0} s, {effects}, seed {seed}",
        out.display()
    ))
}

/// Writes a single trial to standard output.
fn alone(out: &Path, rig: &Rig, settings: &RunSettings, plans: &[TrialPlan]) -> anyhow::Result<()> {
    let [plan] = plans else {
        bail!(
            "-: these are {} trials, and only one can go to standard output; give --protocol arbitrary, --protocol pulses \
             or the name of a trial",
            plans.len()
        );
    };
    let (_, trial) = Session::new(rig, settings)?.run(plan)?;
    trial.check().context("the simulation gave values that a trial file cannot contain")?;
    trial.write(out)?;
    Ok(())
}

fn plans(protocol: &str, rig: &Rig, seed: u64) -> anyhow::Result<Vec<TrialPlan>> {
    let path = match protocol {
        "paper" => return Ok(TrialPlan::paper(seed)),
        "arbitrary" => return Ok(vec![TrialPlan::arbitrary(1, seed)]),
        "pulses" => return Ok(vec![TrialPlan::pulses(1, seed)]),
        // A trial, or a folder with a data set.
        path => Path::new(path),
    };
    let named = |path: &Path| path.display().to_string();
    ensure!(
        path.exists() || path.as_os_str() == "-",
        "--protocol {}: it is not paper, arbitrary or pulses, and there is no such trial or data set",
        path.display()
    );
    if !path.is_dir() {
        let trial = read_recording(path, &ReadOptions::new())?;
        let plan = TrialPlan::from_trial(&trial, &rig.params).with_context(|| named(path))?;
        return Ok(vec![plan]);
    }
    let set = DataSet::read(path)?;
    let one = |entry: &TrialEntry| {
        let file = path.join(&entry.file);
        let trial = Recording::of_entry(entry, path, &ReadOptions::new())?.trial;
        let plan = TrialPlan::from_trial(&trial, &rig.params).with_context(|| named(&file))?;
        let (kind, opening, split) = (entry.kind, entry.opening, entry.split);
        anyhow::Ok(TrialPlan { kind, opening, split, start_s: Some(entry.start_s), ..plan })
    };
    set.trials.iter().map(one).collect()
}

/// Simulates the plans and writes the data set, completely or not at all.
pub(super) fn write(
    out: &Path,
    force: bool,
    rig: &Rig,
    settings: &RunSettings,
    plans: &[TrialPlan],
) -> anyhow::Result<()> {
    let name = out.file_name().map_or("simulated".into(), |n| n.to_string_lossy().into_owned());
    let nominal = Rig { effects: Default::default(), ..rig.clone() };
    let is_stock = nominal == Rig::default();
    let mut set = DataSet {
        name,
        rate_hz: plans[0].rate_hz,
        rig: (!is_stock).then(|| "nominal.toml".to_owned()),
        trials: Vec::new(),
    };
    for own in ["dataset.toml", "rig.toml", "nominal.toml"] {
        ensure!(
            plans.iter().all(|p| p.file != own),
            "a trial cannot have the name {own}; rename it"
        );
    }
    let bar = progress("simulating", plans.len() as u64);
    detail(format!("simulating {} trials, seed {}", plans.len(), settings.seed));
    write_folder(out, force, |folder| {
        let mut session = Session::new(rig, settings)?;
        for plan in plans {
            let (entry, trial) = session.run(plan)?;
            trial.check().context("the simulation gave values that a trial file cannot contain")?;
            trial.write(folder.join(&entry.file))?;
            set.trials.push(entry);
            bar.inc(1);
        }
        rig.to_file(Some(settings)).write(folder.join("rig.toml"))?;
        if !is_stock {
            nominal.to_file(None).write(folder.join("nominal.toml"))?;
        }
        set.take_digests(folder)?;
        set.write(folder)?;
        anyhow::Ok(())
    })?;
    bar.finish_and_clear();
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::parse_effect;

    #[test]
    fn effects_are_understood() {
        let effect = parse_effect("gauge_hysteresis:h=0.2,s=0.012").unwrap();
        assert_eq!(effect.name, "gauge_hysteresis");
        assert_eq!(effect.values, [("h".to_owned(), 0.2), ("s".to_owned(), 0.012)]);
        // Optional parameters (forms) are accepted, too, because a diagnosis reports them.
        let effect = parse_effect("gauge_hysteresis:h=0.2,s=0.012,spread=0.4").unwrap();
        assert_eq!(effect.values[2], ("spread".to_owned(), 0.4));
        for (wrong, says) in [
            ("gauge_hysterisis:h=0.2", "did you mean `gauge_hysteresis`?"),
            ("gauge_hysteresis:k=0.2", "no parameter `k`"),
            ("gauge_hysteresis:h=2", "outside 0 .. 0.6"),
            ("gauge_hysteresis:h=nan", "outside 0 .. 0.6"),
            ("gauge_hysteresis", "lacks the parameter `h`"),
            ("gauge_hysteresis:h", "is not PARAMETER=NUMBER"),
        ] {
            let error = parse_effect(wrong).unwrap_err();
            assert!(error.contains(says), "{wrong}: {error}");
        }
    }
}

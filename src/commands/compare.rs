//! `stretch compare`: compares two recordings of the same quantity, without a simulator.

use std::path::PathBuf;

use anyhow::Context;
use stretch_data::files::Outputs;
use stretch_gap::Options;
use stretch_problem::{Compared, Pair};
use stretch_recording::TimeColumn;
use stretch_report::{Subject, diagnosis_page, times};

use super::{
    diagnose::{print, told_on},
    json::Json,
    reading::read_recording,
    shared::{say, say_first, spinner, stage_text, tell},
};
use crate::{
    display::is_quiet,
    table::{number, table, unbroken},
};

/// Compare two recordings of the same quantity: delay, clock drift, gain, offset, sign, unit
///
///   stretch compare encoder.csv mocap.csv --report compared.html
///
/// The second recording is compared with the first, in the time in which both were recorded. If their
/// clocks differ, they are aligned by cross-correlation. Columns with the same name are compared; other
/// columns are chosen, also of one file:
///
///   stretch compare encoder.csv mocap.csv --signal angle_deg=knee_deg
///   stretch compare log.csv log.csv --signal left_v=right_v
///
/// What gain, offset and clock do not explain is diagnosed as the gap of a simulator: the first
/// recording is the simulator, the second the rig. The diagnosis names effects such as a low-pass,
/// saturation or hysteresis, and where the recordings differ by level, rate, frequency and time.
#[derive(clap::Args)]
#[command(verbatim_doc_comment)]
pub(crate) struct Args {
    /// First recording, or - for standard input
    #[arg(value_name = "A.csv")]
    first: PathBuf,
    /// Second recording
    #[arg(value_name = "B.csv")]
    second: PathBuf,
    /// Column to compare, or A=B; several are separated by commas [default: all with the same name]
    #[arg(long, value_name = "A=B", value_delimiter = ',')]
    signal: Vec<String>,
    /// Time column of both; COL:ms if in ms; 100hz if there is none
    #[arg(long, value_name = "COL", default_value = "time_s")]
    time: TimeColumn,
    #[command(flatten)]
    json: Json,
    /// Write a report that opens in any browser
    #[arg(long, value_name = "d.html")]
    report: Option<PathBuf>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    args.json.share_stdout([args.report.as_deref()])?;
    let bar = spinner();
    let options = args.time.options();
    let [a, b] = [&args.first, &args.second].map(|path| read_recording(path, &options));
    let pair = Pair::new(&a?, &b?, &args.signal)?;
    let problem = pair.problem()?;
    let options = Options { responses: args.report.is_some(), ..Options::default() };
    let examined = problem
        .examine(&options, false, &told_on(&bar), &|| false)
        .with_context(|| format!("{} and {}", args.first.display(), args.second.display()))?;
    bar.finish_and_clear();
    let compared = pair.compared(&examined);
    let mut answer = examined.to_json();
    answer["compared"] = serde_json::to_value(&compared)?;
    let mut outputs = Outputs::default();
    if let Some(path) = &args.report {
        stage_text(&mut outputs, path, &diagnosis_page(&Subject::of(&problem, &examined)))?;
    }
    args.json.conclude(outputs, &answer, || {
        compared.iter().try_for_each(|one| say_first(&one.sentence))?;
        if !is_quiet() {
            compared.iter().try_for_each(|one| say(numbers(one)))?;
            say(ROLES)?;
            print(&examined)?;
        }
        args.report.iter().try_for_each(|path| tell(format!("wrote {}", path.display())))
    })
}

/// What the words of a diagnosis mean here.
const ROLES: &str = "
In the diagnosis, the simulator is the first recording with this gain, offset and clock; the rig is the second.
";

/// The numbers of one column, and what is left by octaves.
fn numbers(one: &Compared) -> String {
    let rows = [
        ("gain", "", one.gain),
        ("offset", one.unit.as_str(), one.offset),
        ("delay", "s", one.delay_s),
        ("clock rate", "s/s", one.clock_rate),
    ];
    let rows = rows.map(|(name, unit, of)| {
        let [low, high] = of.interval.map(number);
        vec![name.to_owned(), number(of.value), unit.to_owned(), format!("{low} .. {high}")]
    });
    let mut out = format!("\n{}", table(&[&one.b, "Value", "Unit", "95 % interval"], rows));
    if !one.octaves.is_empty() {
        let rows = one.octaves.iter().map(|octave| {
            let [left, low, high] = [octave.left, octave.interval[0], octave.interval[1]]
                .map(|left| unbroken(&times(left * left - 1.0)));
            vec![octave.frequencies.clone(), left, format!("{low} .. {high}")]
        });
        out += &format!("\n\n{}", table(&["Octave", "Left, x noise", "95 % interval"], rows));
    }
    out
}

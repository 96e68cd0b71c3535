//! Facts about the recordings of a user's simulator.

use std::borrow::Cow;

use stretch_gap::{Column, Description, MotionSpec, RecordFacts, Recorded};

use super::source::RecordedSession;
use crate::bench::columns::Columns;

/// Range of the delays that skews of the catalogue represent, s.
const SKEW_S: [f64; 2] = [-0.2, 0.2];

/// Collects the facts about recordings.
pub(super) fn facts(
    about: &Description,
    session: &RecordedSession,
    columns: &Columns,
    sensor: Option<&(usize, String)>,
) -> RecordFacts {
    let motion = sensor.and_then(|(_, name)| session.columns.iter().find(|c| c.name == *name));
    RecordFacts {
        is_lost: columns.is_lost.clone(),
        motion: motion.map(|c| MotionSpec::new(c.values.clone(), &c.unit)),
        sensor: sensor.map(|(stage, _)| *stage),
        rows_used: Some(columns.rows_used()),
        signals: signals(session),
        columns: record_columns(about, session),
        ..RecordFacts::default()
    }
}

/// The inputs of the stages, each once. The output of another stage is measured, even if a coarse encoder holds it.
fn signals(session: &RecordedSession) -> Vec<Recorded> {
    let mut out: Vec<Recorded> = Vec::new();
    for name in session.stages.iter().flat_map(|s| &s.inputs) {
        let column = session.columns.iter().find(|c| c.name == *name);
        if let Some(column) = column.filter(|_| out.iter().all(|r| r.name != *name)) {
            out.push(Recorded {
                is_command: session.stages.iter().all(|s| s.output != *name)
                    && is_command(&column.values),
                ..Recorded::measured(name, &column.unit, column.values.clone())
            });
        }
    }
    out
}

/// The outputs of the stages, and every other column except commands, because a command may stay
/// constant while the rest moves.
fn record_columns(about: &Description, session: &RecordedSession) -> Vec<Column<'static>> {
    let stages = about.spec().stages.iter().enumerate();
    let output = |(stage, spec)| Column { skew_s: SKEW_S, ..Column::output(stage, spec) };
    let mut out: Vec<Column<'static>> = stages.map(output).collect();
    for c in &session.columns {
        if out.iter().any(|o| *o.name == c.name) || is_command(&c.values) {
            continue;
        }
        out.push(Column {
            name: Cow::Owned(c.name.clone()),
            unit: Cow::Owned(c.unit.clone()),
            values: Cow::Owned(c.values.clone()),
            output_of: None,
            read_by: Vec::new(),
            is_command: false,
            skew_s: SKEW_S,
            hint: Cow::Borrowed("what commands or measures it"),
        });
    }
    out
}

/// Whether a column is held from sample to sample, as commands are: at least a tenth of its samples
/// equal the sample before.
fn is_command(values: &[f64]) -> bool {
    let held = values.windows(2).filter(|w| w[0] == w[1]).count();
    10 * held >= values.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::black_box::source::{SessionColumn, SessionStage};

    #[test]
    fn a_coarse_output_of_another_stage_is_no_command() {
        let stage = |input: &str, output: &str| SessionStage {
            name: output.into(),
            output: output.into(),
            inputs: vec![input.into()],
        };
        let coarse = |name: &str| SessionColumn {
            name: name.into(),
            unit: "deg".into(),
            values: (0..100).map(|i| f64::from(i / 4)).collect(),
        };
        let session = RecordedSession {
            dt_s: 0.01,
            trials: Vec::new(),
            stages: vec![stage("command", "motor_deg"), stage("motor_deg", "load_deg")],
            parameters: Vec::new(),
            effects: Vec::new(),
            columns: ["command", "motor_deg", "load_deg"].map(coarse).into(),
        };
        let commands: Vec<bool> = signals(&session).iter().map(|s| s.is_command).collect();
        assert_eq!(commands, [true, false]);
    }
}

//! The messages of the worker protocol, in frames.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde_json::{Value, json};

use super::frame::WorkerFrame;
use crate::black_box::{
    source::{Ask, RecordedSession, SourceError},
    states::State,
};

/// The version of the protocol.
pub(super) const VERSION: u64 = 1;

// Keys are written in alphabetical order, so that a worker without a JSON parser finds each key at a fixed place.

/// The first message of a worker: its abilities.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(default)]
pub(super) struct Hello {
    /// Version of the protocol that the worker speaks.
    pub(super) version: u64,
    /// Number of models that the worker wants in one request.
    pub(super) batch: usize,
    /// Whether the worker takes altered inputs.
    pub(super) inputs: bool,
    /// Whether the worker answers all stages at once.
    pub(super) all: bool,
    /// Whether one model may have altered inputs of several stages.
    pub(super) several: bool,
    /// Parameters that the worker knows; all parameters if the list is missing.
    pub(super) parameters: Option<Vec<String>>,
    /// Effects that the worker knows; all effects if the list is missing.
    pub(super) effects: Option<Vec<String>>,
    /// Units in which the worker takes and gives columns.
    pub(super) units: BTreeMap<String, String>,
    /// States that the worker can hold or drain.
    pub(super) states: Vec<State>,
}

/// A sentence about what is wrong with an answer.
pub(super) type Wrong = String;

/// Checks that a frame is of the wanted kind.
pub(super) fn kind(frame: &WorkerFrame, wanted: &str) -> Result<(), Wrong> {
    let text = |key: &str| frame.header.get(key).and_then(Value::as_str);
    match text("kind") {
        Some(kind) if kind == wanted => Ok(()),
        Some("error") => Err(format!("it reports: {}", text("message").unwrap_or("no message"))),
        Some(other) => Err(format!("it answers with the kind {other:?} instead of {wanted:?}")),
        None => Err(format!("its answer has no key \"kind\"; it must be {wanted:?}")),
    }
}

pub(super) fn hello() -> Vec<u8> {
    WorkerFrame::bytes(&json!({ "kind": "hello", "version": VERSION }), &[])
}

pub(super) fn bye() -> Vec<u8> {
    WorkerFrame::bytes(&json!({ "kind": "bye" }), &[])
}

/// Reads the first message of a worker and checks it against the session.
pub(super) fn read_hello(frame: &WorkerFrame, session: &RecordedSession) -> Result<Hello, Wrong> {
    kind(frame, "hello")?;
    let hello: Hello = serde_json::from_value(Value::Object(frame.header.clone()))
        .map_err(|e| format!("its hello is invalid: {e}"))?;
    if hello.version != VERSION {
        return Err(format!(
            "it speaks version {} of the protocol, but this program speaks only version {VERSION}: change the worker to send the messages of \
             that version, which the page on the worker protocol lists",
            hello.version
        ));
    }
    for (what, known, used) in [
        ("parameter", &hello.parameters, &session.parameters),
        ("effect", &hello.effects, &session.effects),
    ] {
        let Some(known) = known else { continue };
        let is_of_state = |name: &str| {
            let mut states = hello.states.iter();
            what == "effect" && states.any(|s| name.starts_with(&format!("state.{}.", s.name)))
        };
        let is_known = |name: &String| known.contains(name) || is_of_state(name);
        if let Some(name) = used.iter().find(|name| !is_known(name)) {
            return Err(format!("it has no {what} {name}; it has {}", known.join(", ")));
        }
    }
    for column in &session.columns {
        let other = hello.units.get(&column.name).filter(|u| **u != column.unit);
        if let Some(unit) = other.filter(|_| !column.unit.is_empty()) {
            return Err(format!(
                "it has column {} in {unit}, but the problem has it in {}; convert it in the simulator, or correct the unit of the stage or input",
                column.name, column.unit
            ));
        }
    }
    Ok(Hello { batch: hello.batch.max(1), ..hello })
}

/// The message that hands the session to a worker.
pub(super) fn session(session: &RecordedSession) -> Vec<u8> {
    let body: Vec<f64> = session.columns.iter().flat_map(|c| c.values.iter().copied()).collect();
    WorkerFrame::bytes(&session_header(session), &body)
}

/// The header of the message `session`: the session as a simulator receives it once, without the values of the columns.
pub fn session_header(session: &RecordedSession) -> Value {
    // This cannot fail, because every key is a string.
    let mut header = serde_json::to_value(session).unwrap_or_default();
    header["kind"] = "session".into();
    header
}

/// Reads the message `session`; `None` if its header or its body is incomplete.
pub fn read_session(frame: &WorkerFrame) -> Option<RecordedSession> {
    let header = Value::Object(frame.header.clone());
    let mut session: RecordedSession = serde_json::from_value(header).ok()?;
    let mut end = 0_usize;
    for trial in &mut session.trials {
        let from = end;
        end = end.checked_add(trial.samples.len())?;
        trial.samples = from..end;
    }
    let mut rest = frame.body.as_slice();
    for column in &mut session.columns {
        let (values, behind) = rest.split_at_checked(end)?;
        column.values = values.to_vec();
        rest = behind;
    }
    Some(session)
}

/// Reads the answer to the session; its `notes`, a list of sentences, may be left out.
pub(super) fn read_ready(frame: &WorkerFrame) -> Result<Vec<String>, Wrong> {
    kind(frame, "ready")?;
    let notes = frame.header.get("notes").and_then(Value::as_array).into_iter().flatten();
    Ok(notes.filter_map(|note| note.as_str().map(str::to_owned)).collect())
}

/// The message that requests runs of models. A model with altered columns of other stages lists
/// their places, `[stage, input]`, under `others`.
pub(super) fn simulate(asks: &[Ask<'_>]) -> Vec<u8> {
    let one = |ask: &Ask<'_>| {
        let mut model =
            json!({ "stage": ask.stage, "trials": ask.trials, "inputs": ask.inputs.is_some() });
        if !ask.others.is_empty() {
            model["others"] = ask.others.iter().map(|o| json!([o.stage, o.input])).collect();
        }
        model
    };
    let models: Vec<Value> = asks.iter().map(one).collect();
    let mut body = Vec::new();
    for ask in asks {
        body.extend_from_slice(ask.parameters);
        body.extend_from_slice(ask.effects);
        ask.inputs.iter().copied().flatten().for_each(|column| body.extend_from_slice(column));
        ask.others.iter().for_each(|other| body.extend_from_slice(other.values));
    }
    WorkerFrame::bytes(&json!({ "kind": "simulate", "models": models }), &body)
}

/// Reads the outputs, one for each model, with the lengths that the worker states.
pub(super) fn read_outputs(
    frame: &WorkerFrame,
    count: usize,
) -> Result<Vec<Result<Vec<f64>, SourceError>>, Wrong> {
    kind(frame, "outputs")?;
    let models = frame.header.get("models").and_then(Value::as_array);
    let models = models.ok_or("its answer has no list `models`")?;
    if models.len() != count {
        return Err(format!("it returned {} outputs for {count} models", models.len()));
    }
    let (mut out, mut rest) = (Vec::with_capacity(count), frame.body.as_slice());
    for model in models {
        if let Some(error) = model.get("error") {
            let text = error.as_str().map_or_else(|| error.to_string(), str::to_owned);
            out.push(Err(SourceError::Refused(text)));
            continue;
        }
        let samples = model.get("samples").and_then(Value::as_u64);
        let samples = samples.and_then(|n| usize::try_from(n).ok()).filter(|n| *n <= rest.len());
        let samples =
            samples.ok_or("an output states no number of samples, or more than the body holds")?;
        let (own, behind) = rest.split_at(samples);
        out.push(Ok(own.to_vec()));
        rest = behind;
    }
    match rest.is_empty() {
        true => Ok(out),
        false => Err(format!("{} numbers are left after the last output", rest.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::black_box::source::AlteredColumn;

    fn outputs(header: Value, body: &[f64]) -> Result<Vec<Result<Vec<f64>, SourceError>>, Wrong> {
        let (frame, _) = WorkerFrame::first(&WorkerFrame::bytes(&header, body)).unwrap().unwrap();
        read_outputs(&frame, 2)
    }

    #[test]
    fn altered_columns_of_other_stages_follow_those_of_the_stage_asked_for() {
        let (own, other) = ([vec![1.0, 2.0]], [3.0, 4.0]);
        let others = [AlteredColumn { stage: 2, input: 1, values: &other }];
        let ask = Ask {
            stage: 0,
            parameters: &[7.0],
            effects: &[8.0],
            inputs: Some(&own),
            others: &others,
            trials: 1,
        };
        let bytes = simulate(&[ask, Ask { others: &[], ..ask }]);
        let (frame, _) = WorkerFrame::first(&bytes).unwrap().unwrap();
        let models = json!([
            { "inputs": true, "others": [[2, 1]], "stage": 0, "trials": 1 },
            { "inputs": true, "stage": 0, "trials": 1 },
        ]);
        assert_eq!(frame.header["models"], models);
        assert_eq!(frame.body, [7.0, 8.0, 1.0, 2.0, 3.0, 4.0, 7.0, 8.0, 1.0, 2.0]);
    }

    #[test]
    fn outputs_are_taken_apart_and_wrong_ones_refused() {
        let two = json!([{ "samples": 2 }, { "error": "no convergence" }]);
        let good = outputs(json!({ "kind": "outputs", "models": two }), &[1.0, 2.0]).unwrap();
        assert_eq!(good[0], Ok(vec![1.0, 2.0]));
        assert_eq!(good[1], Err(SourceError::Refused("no convergence".into())));
        let left = outputs(json!({ "kind": "outputs", "models": two }), &[1.0, 2.0, 3.0]);
        assert!(left.unwrap_err().contains("1 numbers are left"));
        let few = outputs(json!({ "kind": "outputs", "models": two }), &[1.0]);
        assert!(few.unwrap_err().contains("or more than the body holds"));
        let one = outputs(json!({ "kind": "outputs", "models": [{ "samples": 0 }] }), &[]);
        assert_eq!(one.unwrap_err(), "it returned 1 outputs for 2 models");
        let said = outputs(json!({ "kind": "error", "message": "out of memory" }), &[]);
        assert_eq!(said.unwrap_err(), "it reports: out of memory");
    }
}

//! The worker's side of the protocol: receives request frames and sends response frames. The
//! protocol is described in `book/src/reference/worker.md`.

use std::io::{ErrorKind, Read, Write};

use serde::Deserialize;
use serde_json::{Value, json};
use stretch_problem::{
    AlteredColumn, Ask, RecordedSession, Source, SourceError,
    worker::{FrameError, PREFIX, Prefix, WorkerFrame, read_session},
};

/// Version of the protocol.
const VERSION: u64 = 1;

/// Why a worker ends before the other side requests it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServeError {
    /// Error of standard input or output.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The received bytes are no frame.
    #[error("{0}")]
    Frame(#[from] FrameError),
    /// A valid frame that was not expected.
    #[error("{0}")]
    Protocol(String),
    /// The simulator cannot be used, or has ended.
    #[error("{0}")]
    Simulator(String),
}

fn wrong(what: &str) -> ServeError {
    ServeError::Protocol(format!(
        "the {what} is not as expected; the program stretch and this worker must be of the same release"
    ))
}

/// Answers frames until the other side sends `bye` or closes the stream. `begin` makes the
/// simulator for a session.
///
/// Errors are sent to the other side before the worker ends.
///
/// # Errors
/// Frames that cannot be read or written, and simulators that do not start or have ended.
pub fn serve<S, E>(
    mut from: impl Read,
    mut to: impl Write,
    begin: impl Fn(&RecordedSession) -> Result<S, E>,
) -> Result<(), ServeError>
where
    S: Source,
    E: std::fmt::Display,
{
    let ended = answer(&mut from, &mut to, begin);
    if let Err(error @ (ServeError::Simulator(_) | ServeError::Protocol(_))) = &ended {
        let message = json!({ "kind": "error", "message": error.to_string() });
        to.write_all(&WorkerFrame::bytes(&message, &[]))?;
        to.flush()?;
    }
    ended
}

fn answer<S, E>(
    from: &mut impl Read,
    to: &mut impl Write,
    begin: impl Fn(&RecordedSession) -> Result<S, E>,
) -> Result<(), ServeError>
where
    S: Source,
    E: std::fmt::Display,
{
    let mut open: Option<(RecordedSession, S)> = None;
    while let Some(frame) = receive(from)? {
        let bytes = match frame.header.get("kind").and_then(Value::as_str) {
            Some("hello") => {
                let hello = json!({ "all": true, "batch": 1, "inputs": true, "kind": "hello", "several": true, "version": VERSION });
                WorkerFrame::bytes(&hello, &[])
            }
            Some("session") => {
                let session = read_session(&frame).ok_or_else(|| wrong("session"))?;
                let source = begin(&session).map_err(|e| ServeError::Simulator(e.to_string()))?;
                let notes = source.notes();
                open = Some((session, source));
                WorkerFrame::bytes(&json!({ "kind": "ready", "notes": notes }), &[])
            }
            Some("simulate") => {
                let (session, source) = open.as_ref().ok_or_else(|| wrong("order of frames"))?;
                simulate(&frame, session, source)?
            }
            Some("bye") => return Ok(()),
            other => {
                let kind = other.unwrap_or("none");
                return Err(ServeError::Protocol(format!("frames of kind {kind} are not known")));
            }
        };
        to.write_all(&bytes)?;
        to.flush()?;
    }
    Ok(())
}

/// Reads the next frame. Returns `None` if the other side has closed the stream.
fn receive(from: &mut impl Read) -> Result<Option<WorkerFrame>, ServeError> {
    let mut prefix = [0; PREFIX];
    match from.read_exact(&mut prefix) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(None),
        read => read?,
    }
    let Prefix { header, body } = Prefix::parse(&prefix)?;
    // The lengths in the prefix may be wrong, so memory is allocated only for bytes that are
    // actually read.
    let mut part = |bytes: usize| {
        let mut out = Vec::new();
        let read = from.take(bytes as u64).read_to_end(&mut out)?;
        if read < bytes { Err(wrong("end of a frame")) } else { Ok(out) }
    };
    let (header, body) = (part(header)?, part(body)?);
    Ok(Some(WorkerFrame::parse(&header, &body)?))
}

/// A model of a `simulate` frame, without its values.
#[derive(Deserialize)]
struct Model {
    stage: usize,
    trials: usize,
    /// Whether the inputs of its stage are altered.
    inputs: bool,
    /// Stage and input of each altered column of other stages.
    #[serde(default)]
    others: Vec<(usize, usize)>,
}

/// A request to simulate, with its altered inputs if there are any.
struct Owned<'a> {
    stage: usize,
    parameters: &'a [f64],
    effects: &'a [f64],
    inputs: Option<Vec<Vec<f64>>>,
    others: Vec<AlteredColumn<'a>>,
    trials: usize,
}

fn read_asks<'a>(frame: &'a WorkerFrame, session: &RecordedSession) -> Option<Vec<Owned<'a>>> {
    let mut rest = frame.body.as_slice();
    let mut take = |count: usize| {
        let (own, behind) = rest.split_at_checked(count)?;
        rest = behind;
        Some(own)
    };
    let models = Vec::<Model>::deserialize(frame.header.get("models")?).ok()?;
    let one = |Model { stage, trials, inputs, others }: Model| {
        if trials > session.trials.len() {
            return None;
        }
        let samples = session.samples(trials);
        let parameters = take(session.parameters.len())?;
        let effects = take(session.effects.len())?;
        let count = session.stages.get(stage)?.inputs.len();
        let inputs = match inputs {
            true => Some(
                (0..count).map(|_| take(samples).map(<[f64]>::to_vec)).collect::<Option<_>>()?,
            ),
            false => None,
        };
        let other = |(stage, input): (usize, usize)| {
            session.stages.get(stage)?.inputs.get(input)?;
            Some(AlteredColumn { stage, input, values: take(samples)? })
        };
        let others = others.into_iter().map(other).collect::<Option<_>>()?;
        Some(Owned { stage, parameters, effects, inputs, others, trials })
    };
    models.into_iter().map(one).collect()
}

fn simulate(
    frame: &WorkerFrame,
    session: &RecordedSession,
    source: &impl Source,
) -> Result<Vec<u8>, ServeError> {
    let asks = read_asks(frame, session).ok_or_else(|| wrong("models"))?;
    let ask = |own: &Owned<'_>| -> Result<Vec<f64>, SourceError> {
        let Owned { stage, parameters, effects, ref inputs, ref others, trials } = *own;
        let asked = Ask { stage, parameters, effects, inputs: inputs.as_deref(), others, trials };
        let mut answers = source.simulate_many(&[asked]);
        answers.pop().unwrap_or_else(|| Err(SourceError::Gone("there is no answer".into())))
    };
    let (mut models, mut body) = (Vec::with_capacity(asks.len()), Vec::new());
    for own in &asks {
        models.push(match ask(own) {
            Ok(values) => {
                body.extend_from_slice(&values);
                json!({ "samples": values.len() })
            }
            Err(SourceError::Gone(why)) => return Err(ServeError::Simulator(why)),
            Err(refused) => json!({ "error": refused.to_string() }),
        });
    }
    Ok(WorkerFrame::bytes(&json!({ "kind": "outputs", "models": models }), &body))
}

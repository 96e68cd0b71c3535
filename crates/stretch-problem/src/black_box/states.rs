//! States that a simulator lets be held or drained: what no operator outside of it can do.

use serde::Deserialize;

use super::spec::{Argument, OwnEffect, ProblemSpec};
use crate::error::ProblemError;

/// A state of a simulator that may spill, stop or leak, and the range in which it moves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct State {
    /// Name of the state.
    pub name: String,
    /// Unit of the state.
    #[serde(default)]
    pub unit: String,
    /// Least value that the state takes in the recorded session.
    pub least: f64,
    /// Greatest value that the state takes there.
    pub greatest: f64,
}

/// What begins the names of effects on states.
const PREFIX: &str = "state.";
/// Leaks that are looked for: a time constant between so many sample times and so many sessions.
const LEAKS: [f64; 2] = [10.0, 10.0];

impl ProblemSpec {
    /// The problem with effects on declared states in addition to its own, as far as `wrap` asks for them: `all`, `state.all`, or names such as
    /// `state.level.spill`. The patterns are taken out of `wrap`. Each state has three effects, which the simulator makes:
    ///
    /// | effect | its value v, after every step of the simulator | off at |
    /// | --- | --- | --- |
    /// | `state.NAME.spill` | the state cannot rise above v: x = min(x, v) | `greatest` |
    /// | `state.NAME.floor` | it cannot fall below v: x = max(x, v) | `least` |
    /// | `state.NAME.leak` | it loses v of itself a second: x = x exp(-v dt) | 0 |
    ///
    /// Effects that the problem has already are left as they are: a fix holds their values.
    ///
    /// # Errors
    /// A pattern that matches no declared state, a state whose range is empty.
    pub fn with_states(mut self, states: &[State]) -> Result<Self, ProblemError> {
        let (asked, wrap): (Vec<String>, Vec<String>) =
            std::mem::take(&mut self.wrap).into_iter().partition(|name| name.starts_with(PREFIX));
        let takes_all = wrap.iter().chain(&asked).any(|name| name == "all" || name == "state.all");
        self.wrap = wrap;
        let session_s = self.trials.iter().map(|t| t.trial.duration_s()).sum::<f64>();
        let rate_hz = self.trials.iter().find_map(|t| t.trial.rate_hz()).unwrap_or(100.0);
        let mut known = vec!["state.all".to_owned()];
        for state in states {
            if !(state.least.is_finite() && state.greatest > state.least) {
                let found = format!("its range, {} to {}, is empty", state.least, state.greatest);
                let hint = "declare the least and the greatest value that it takes";
                return Err(ProblemError::value(format!("state {}", state.name), found, hint));
            }
            for (what, argument) in arguments(state, session_s, rate_hz) {
                let name = format!("{PREFIX}{}.{what}", state.name);
                known.push(name.clone());
                let is_asked = takes_all || asked.contains(&name);
                if is_asked && self.effects.iter().all(|own| own.name != name) {
                    let arguments = vec![argument];
                    self.effects.push(OwnEffect { name, arguments, ..OwnEffect::default() });
                }
            }
        }
        match asked.iter().find(|name| !known.contains(name)) {
            Some(name) => {
                let known = known.iter().map(String::as_str);
                Err(ProblemError::unknown("wrap", "effect on a state", name, known))
            }
            None => Ok(self),
        }
    }
}

/// The effects of a state, each with its one argument.
fn arguments(state: &State, session_s: f64, rate_hz: f64) -> [(&'static str, Argument); 3] {
    let level = |off: f64| Argument {
        unit: state.unit.clone(),
        range: [state.least, state.greatest],
        off: Some(off),
        ..Argument::default()
    };
    let leak = Argument {
        unit: "1/s".into(),
        range: [1.0 / (LEAKS[1] * session_s.max(1.0 / rate_hz)), rate_hz / LEAKS[0]],
        off: Some(0.0),
        is_log: true,
        ..Argument::default()
    };
    [("spill", level(state.greatest)), ("floor", level(state.least)), ("leak", leak)]
}

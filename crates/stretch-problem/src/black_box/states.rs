//! Effects that limit or drain a state inside a simulator. The simulator applies them itself,
//! because no operator outside of it can.

use serde::Deserialize;

use super::spec::{Argument, OwnEffect, ProblemSpec};
use crate::error::ProblemError;

/// A state of a simulator that may spill (at an upper limit), stop (at a lower limit) or leak, and
/// the range in which it moves.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct State {
    /// Name of the state.
    pub name: String,
    /// Unit of the state.
    #[serde(default)]
    pub unit: String,
    /// Smallest value that the state takes in the recorded session.
    pub least: f64,
    /// Greatest value that the state takes in the recorded session.
    pub greatest: f64,
}

/// Prefix of the names of effects on states.
const PREFIX: &str = "state.";
/// Range of the time constant of a leak. The least value is given in sample times, the greatest in session lengths.
const LEAKS: [f64; 2] = [10.0, 10.0];

impl ProblemSpec {
    /// The problem with the effects on declared states that `wrap` requests by `all`, `state.all`,
    /// or names such as `state.level.spill`. Names that begin with `state.` are removed from
    /// `wrap`. Each state has three effects, which the simulator applies:
    ///
    /// | effect | its value v, after every step of the simulator | off at |
    /// | --- | --- | --- |
    /// | `state.NAME.spill` | the state cannot rise above v: x = min(x, v) | `greatest` |
    /// | `state.NAME.floor` | it cannot fall below v: x = max(x, v) | `least` |
    /// | `state.NAME.leak` | it decays at a rate v, 1/s: x = x exp(-v dt) | 0 |
    ///
    /// Effects that the problem already has stay unchanged, because a fix may hold their values.
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

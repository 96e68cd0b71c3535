//! The catalogue in a gauge alone: ranges in units of e and of the signal's span, and where to look.

use stretch_gap::EffectSpec;
use stretch_sim::{Effect, EffectParameter, Gauge, Stage};

use crate::rig::catalogue::{Extent, Place, entries};

/// Two recorders may be started by two hands: so far a skew is looked for, s.
const SKEW_S: f64 = 1.0;
/// A drift takes at most this share of the signal's span away over the session.
const DRIFT: f64 = 0.5;
/// The same of a gauge that warms up.
const HEATING: f64 = 0.15;
/// A curve bends by at most this share of the span (at half of the range, where e + 1 is 1.5, by half as much again):
/// beyond, it would not rise any more.
const BEND: f64 = 0.5;

/// A gauge that is no foil gives way by at most this share of a step,
const RELAXATION: f64 = 0.6;
/// with time constants of up to, s.
const SLOWEST_S: f64 = 20.0;

/// What the search needs to know of the measurement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scope {
    /// From the first to the last sample, s.
    pub(super) session_s: f64,
    /// Time by which the signal seems to trail the reference, s.
    pub(super) lag_s: f64,
    pub(super) has_pressure: bool,
}

/// The catalogue's unit of a parameter in units of e or of the signal's span.
fn unit(p: &EffectParameter) -> f64 {
    // Knees know of the gauge's unit by themselves.
    if p.name == "knee" { 1.0 } else { Gauge::range(p).1 / p.max }
}

/// Effects that can act in a gauge alone.
pub(super) fn catalogue(
    without: &[String],
    scope: Scope,
) -> (Vec<EffectSpec>, Vec<&'static dyn Effect>) {
    let (mut specs, rows) = entries(
        without,
        &Place {
            accepts: &|effect: &dyn Effect| Gauge::accepts(effect, scope.has_pressure),
            touches: &|_: Stage| vec![0],
            unit: &unit,
            extent: Extent { volts: (0.0, 1.0), strain: 0.0 },
        },
    );
    for spec in &mut specs {
        adapt(spec, scope);
    }
    (specs, rows)
}

/// Widens what belongs to the stock rig, and looks there.
fn adapt(spec: &mut EffectSpec, scope: Scope) {
    let range = match spec.name.as_str() {
        "channel_skew" => SKEW_S,
        "thermal_drift" => DRIFT / scope.session_s.max(1.0),
        "self_heating" => HEATING,
        "gauge_nonlinearity" => BEND,
        "gauge_relaxation" => RELAXATION,
        _ => return,
    };
    (spec.parameters[0].min, spec.parameters[0].max) = (-range, range);
    match spec.name.as_str() {
        "channel_skew" => {
            // Two clocks part, but they do not tremble: a skew that may follow the record explains what it likes.
            let wobble = spec.parameters.iter().position(|p| p.name == "wobble");
            if let Some(at) = wobble {
                spec.parameters[at].is_fitted = false;
                spec.starts.retain(|start| start[at] == 0.0);
            }
            let more = [scope.lag_s, 0.9 * scope.lag_s, -0.15, 0.2].map(|s| vec![s, 0.0, 0.0]);
            spec.starts.extend(more);
        }
        "gauge_relaxation" => {
            spec.parameters[1].max = SLOWEST_S;
            let slow = spec.starts.last().map(|s| [&[s[0], 10.0], &s[2..]].concat());
            spec.starts.extend(slow);
        }
        _ => spec.starts.iter_mut().for_each(|start| start[0] = 0.2 * range),
    }
}

/// Time by which `y` trails `x`, s: where they correlate best, of all within [`SKEW_S`].
pub(super) fn lag(x: &[f64], y: &[f64], dt_s: f64) -> f64 {
    let reach = ((SKEW_S / dt_s) as usize).min(x.len() / 4);
    if reach == 0 {
        return 0.0;
    }
    let centre = |v: &[f64]| {
        let mean = v.iter().sum::<f64>() / v.len() as f64;
        v.iter().map(|v| v - mean).collect::<Vec<f64>>()
    };
    let middle = centre(&y[reach..y.len() - reach]);
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let size = |shift: usize| {
        let there = centre(&x[shift..shift + middle.len()]);
        let power = dot(&there, &there).max(f64::MIN_POSITIVE);
        dot(&there, &middle).powi(2) / power
    };
    let best = (0..=2 * reach).max_by(|a, b| size(*a).total_cmp(&size(*b))).unwrap_or(reach);
    (reach as f64 - best as f64) * dt_s
}

//! Parameters of named defects: initial values and ranges for a fit, and the model (`DiagnosedMap`) that the parameters
//! give.

use stretch_core::{DiagnosedMap, Interval, Target as Polarity};
use stretch_effects::{
    Effect, EffectParameter, Extent, GAUGE, Grid, Live, Need, Place, Target, gauge_effect,
};

use crate::{CalibrateError, Cause, PRESSURE, prepare::Prepared};

/// One parameter of a defect.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Moved {
    pub(crate) effect: &'static Effect,
    parameter: &'static EffectParameter,
}

impl Moved {
    pub(crate) fn name(&self) -> String {
        format!("{} {}", self.effect.name, self.parameter.name)
    }

    /// Converts a value to the coordinate that a fit changes: the logarithm if the parameter spans decades, otherwise
    /// the value itself.
    fn coordinate(&self, value: f64) -> f64 {
        let value = value.clamp(self.parameter.min, self.parameter.max);
        if self.parameter.is_log() { value.ln() } else { value }
    }

    pub(crate) fn value(&self, coordinate: f64) -> f64 {
        let value = if self.parameter.is_log() { coordinate.exp() } else { coordinate };
        value.clamp(self.parameter.min, self.parameter.max)
    }

    fn range(&self) -> f64 {
        self.parameter.max - self.parameter.min
    }

    /// Returns the step of the difference quotient, in the coordinate.
    pub(crate) fn step(&self) -> f64 {
        if self.parameter.is_log() { 0.01 } else { 0.002 * self.range() }
    }

    /// Returns the expected distance of the coordinate from its initial value. It is smaller for parameters of the
    /// effect's form (such as the width of a knee) than for the other parameters.
    fn likely(&self) -> f64 {
        match (self.parameter.is_log(), self.parameter.is_form()) {
            (true, true) => 0.3,
            (true, false) => 1.0,
            (false, true) => 0.1 * self.range(),
            (false, false) => 0.3 * self.range(),
        }
    }

    /// Limits a coordinate to the parameter's range.
    pub(crate) fn held(&self, coordinate: f64) -> f64 {
        self.coordinate(self.value(coordinate))
    }

    /// Converts a standard error of the coordinate into a standard error of the value.
    pub(crate) fn error(&self, value: f64, of_coordinate: f64) -> f64 {
        if self.parameter.is_log() { value * of_coordinate } else { of_coordinate }
    }
}

/// The defects that a diagnosis named, with the coordinates of their parameters.
#[derive(Debug, Clone)]
pub(crate) struct Defects {
    named: Vec<(&'static Effect, Live)>,
    /// Parameters of all defects, in the order of the defects.
    pub(crate) moved: Vec<Moved>,
    pub(crate) at: Vec<f64>,
    target: Target,
}

impl Defects {
    /// Returns the defects that a diagnosis named, with the values that it found.
    pub(crate) fn of(prepared: &Prepared) -> Result<Self, CalibrateError> {
        let causes = &prepared.options.causes;
        if causes.is_empty() {
            let problem = "--model diagnosed needs the effects of the gauge or its reference: run stretch diagnose first and give its result with --from, \
                 or fit --model observer";
            return Err(CalibrateError::Refused(problem.to_owned()));
        }
        let falls = matches!(prepared.target, Polarity::Contraction { .. });
        let pressures = prepared.series.iter().flat_map(|s| s.pressure.iter().copied());
        let pressure = pressures.fold(0.0, |most: f64, p| most.max(p.abs()));
        let target = Target { falls, pressure };
        let mut all = Self { named: Vec::new(), moved: Vec::new(), at: Vec::new(), target };
        for cause in causes {
            all.add(cause)?;
        }
        let needs =
            |effect: &&(&Effect, Live)| effect.0.needs == Some(Need::Pressure) && pressure == 0.0;
        if let Some((effect, _)) = all.named.iter().find(needs) {
            return Err(CalibrateError::Refused(format!(
                "{} needs the pressure, and {} has no column {PRESSURE}; record it, or leave the effect out",
                effect.name, prepared.first_trial
            )));
        }
        Ok(all)
    }

    fn add(&mut self, cause: &Cause) -> Result<(), CalibrateError> {
        let known = gauge_effect(&cause.effect).and_then(|e| Some((e, e.live?)));
        let Some((effect, live)) = known else {
            let known = GAUGE.iter().filter(|e| e.live.is_some()).map(|e| e.name);
            let known = known.collect::<Vec<_>>().join(", ");
            return Err(CalibrateError::Refused(format!(
                "{} is not an effect of the gauge or its reference; a calibration can use {known}",
                cause.effect
            )));
        };
        if self.named.iter().any(|(e, _)| e.name == effect.name) {
            return Ok(());
        }
        self.named.push((effect, live));
        for parameter in live.parameters {
            let moved = Moved { effect, parameter };
            let value = cause.value(&parameter.name).unwrap_or(parameter.typical);
            self.at.push(moved.coordinate(value));
            self.moved.push(moved);
        }
        Ok(())
    }

    /// Returns whether any of the defects makes the resting signal drift.
    pub(crate) fn drifts(&self) -> bool {
        self.named.iter().any(|(_, live)| live.drifts)
    }

    /// Returns the same defects at other coordinates, each limited to its range.
    pub(crate) fn moved_to(&self, at: Vec<f64>) -> Self {
        let at = self.moved.iter().zip(at).map(|(parameter, x)| parameter.held(x)).collect();
        Self { at, ..self.clone() }
    }

    /// Returns for each parameter the distance from the initial coordinate and the weight of that distance, which is
    /// one over the square of the expected distance.
    pub(crate) fn strayed(&self, from: &Self) -> Vec<(f64, f64)> {
        let all = self.moved.iter().zip(&self.at).zip(&from.at);
        all.map(|((parameter, x), from)| (x - from, parameter.likely().powi(-2))).collect()
    }

    /// Returns every effect with the values of its parameters.
    fn values(&self) -> impl Iterator<Item = (&'static Effect, Live, Vec<f64>)> {
        let mut pairs = self.moved.iter().zip(&self.at);
        self.named.iter().map(move |(effect, live)| {
            let own = pairs.by_ref().take(live.parameters.len());
            (*effect, *live, own.map(|(parameter, x)| parameter.value(*x)).collect())
        })
    }

    /// Returns the map of the defects, with placeholders for the curve and the filter.
    pub(crate) fn map(&self) -> DiagnosedMap {
        let open = Interval { min: 0.0, max: 1.0 };
        let mut map = DiagnosedMap {
            // A stream that starts at one end of the range is assumed to have come from the other end.
            initial_hysteresis: [-1.0, 1.0],
            drive_domain: open,
            noise: 1.0,
            agility: 1.0,
            steady_s: 1.0,
            spread: 1.0,
            estimate_domain: open,
            ..DiagnosedMap::default()
        };
        for (_, live, values) in self.values() {
            (live.set)(&values, &self.target, &mut map);
        }
        map
    }

    /// Removes the reference's own defects from targets that were recorded every `period_s`.
    pub(crate) fn undo(&self, period_s: f64, targets: &mut [f64]) {
        let Ok(grid) = Grid::samples(period_s) else { return };
        for (effect, _, values) in self.values().filter(|(.., values)| !values.is_empty()) {
            if let Some((kind, Place::Length)) = effect.at() {
                let rest = effect.parameters.iter().skip(values.len()).map(|p| p.typical);
                let values: Vec<f64> = values.into_iter().chain(rest).collect();
                (kind.operator)(&values, &Extent::between(0.0, 1.0), &grid).undo(targets);
            }
        }
    }
}

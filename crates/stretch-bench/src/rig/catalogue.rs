//! The catalogue as the diagnosis sees it: which outputs an effect touches, and where to look for it.

use stretch_gap::{EffectParameterSpec, EffectSpec};
use stretch_sim::{CATALOGUE, Effect, EffectParameter, RigParams, Scale, Stage};

use super::{
    forms::{NAMES, form_of},
    session::{Inputs, Session},
};
use crate::error::BenchError;

/// Pairs that are hard to tell apart.
const TWINS: [(&str, &str); 9] = [
    ("sleeve_slack", "amplifier_saturation"),
    ("pot_nonlinearity", "gauge_nonlinearity"),
    ("amplifier_lowpass", "channel_skew"),
    ("amplifier_lowpass", "gauge_relaxation"),
    ("sleeve_slip", "gauge_hysteresis"),
    ("muscle_hysteresis", "muscle_creep"),
    ("valve_delay", "crossbeam_inertia"),
    ("pressure_crosstalk", "gauge_nonlinearity"),
    ("pot_backlash", "sleeve_slip"),
];

/// Share of the samples beyond either end of the voltage: noise.
const OUTERMOST: f64 = 0.002;

/// What the screens need to know of the measurement.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Extent {
    /// Least and greatest measured bridge voltage but for noise, V.
    pub(crate) volts: (f64, f64),
    /// Least nominal gauge strain.
    pub(crate) strain: f64,
}

impl Extent {
    pub(super) fn of(params: &RigParams, inputs: &Inputs, session: &Session) -> Self {
        let mut volts: Vec<f64> = session
            .trials
            .iter()
            .filter(|t| !t.is_test)
            .flat_map(|t| &t.bridge_v)
            .copied()
            .collect();
        volts.sort_by(f64::total_cmp);
        let at = |q: f64| volts[(q * (volts.len() - 1) as f64) as usize];
        let strain = stretch_sim::Bridge::new(params).strain(inputs.stroke.0);
        Self { volts: (at(OUTERMOST), at(1.0 - OUTERMOST)), strain }
    }
}

/// Where effects act.
pub(crate) struct Place<'a> {
    /// Whether an effect can act there at all.
    pub(crate) accepts: &'a dyn Fn(&dyn Effect) -> bool,
    /// Stages whose output an effect of a stage changes.
    pub(crate) touches: &'a dyn Fn(Stage) -> Vec<usize>,
    /// The catalogue's unit of a parameter in the unit that it has there.
    pub(crate) unit: &'a dyn Fn(&EffectParameter) -> f64,
    pub(crate) extent: Extent,
}

/// Refuses names that nobody knows.
pub(crate) fn check_names(names: &[String]) -> Result<(), BenchError> {
    match names.iter().find(|name| stretch_sim::effect_named(name).is_none()) {
        None => Ok(()),
        Some(name) => {
            let known = CATALOGUE.iter().map(|e| e.name());
            let nearest = stretch_data::nearest(name, known).map(str::to_owned);
            Err(BenchError::UnknownEffect { name: name.clone(), nearest })
        }
    }
}

/// Every effect of the catalogue that a place accepts, but those left out.
pub(crate) fn entries(
    without: &[String],
    place: &Place<'_>,
) -> (Vec<EffectSpec>, Vec<&'static dyn Effect>) {
    CATALOGUE
        .iter()
        .filter(|e| (place.accepts)(**e) && !without.iter().any(|name| name == e.name()))
        .map(|e| {
            let effect = form_of(*e);
            (entry(effect, place), effect)
        })
        .unzip()
}

fn entry(effect: &'static dyn Effect, place: &Place<'_>) -> EffectSpec {
    let name = effect.name();
    let other = |&(a, b): &(&str, &str)| match name {
        _ if name == a => Some(b.to_owned()),
        _ if name == b => Some(a.to_owned()),
        _ => None,
    };
    let is_hum = name == "mains_hum";
    // The phase of a hum is found in the record.
    let own = || effect.parameters().iter().filter(|p| !(is_hum && p.name == "phase"));
    let units: Vec<f64> = own().map(place.unit).collect();
    let parameters = own()
        .zip(&units)
        .map(|(p, unit)| EffectParameterSpec {
            name: p.name.into(),
            unit: if *unit == 1.0 { p.unit } else { "1" }.into(),
            min: p.min * unit,
            max: p.max * unit,
            off: p.off.map(|off| off * unit),
            is_log: p.scale == Scale::Log,
            is_fitted: !(is_hum && p.name == "f"),
            form: NAMES.contains(&p.name).then_some(p.typical * unit),
        })
        .collect();
    let mut starts = with_forms(starts(name, place.extent), effect);
    for start in &mut starts {
        start.iter_mut().zip(&units).for_each(|(x, unit)| *x *= unit);
    }
    EffectSpec {
        name: name.into(),
        stage: effect.stage().name().into(),
        touches: (place.touches)(effect.stage()),
        parameters,
        starts,
        is_between_trials: matches!(name, "thermal_drift" | "gauge_softening" | "self_heating"),
        twins: TWINS.iter().filter_map(other).collect(),
    }
}

/// Starts with the usual value of every form that they leave out.
fn with_forms(starts: Vec<Vec<f64>>, effect: &dyn Effect) -> Vec<Vec<f64>> {
    let forms = effect.parameters().iter().filter(|p| NAMES.contains(&p.name)).map(|p| p.typical);
    let forms: Vec<f64> = forms.collect();
    let usual = |mut start: Vec<f64>| {
        start.extend(&forms);
        start
    };
    let mut all: Vec<Vec<f64>> = starts.into_iter().map(usual).collect();
    if effect.name() == "valve_deadband" {
        all.extend([0.02, 0.06].map(|u| vec![u, 1.0, 0.01, 1.0]));
        all.extend([0.01, 0.03].map(|u| vec![u, 1.0, 0.01, 1.9]));
        all.extend([0.005, 0.015].map(|u| vec![u, 0.5, 0.5, 1.0]));
    }
    if effect.name() == "channel_skew" {
        all.extend([-1e-4, 1e-4].map(|rate| vec![0.002, rate, 0.0]));
        all.push(vec![0.01, 0.0, 0.2]);
    }
    if effect.name() == "pressure_crosstalk" {
        // In proportion to the pressure it looks much like another pre-stretch: what is left shows once it bends.
        all.extend([-0.4, 0.4].map(|bend| vec![0.003, bend]));
    }
    if matches!(effect.name(), "sleeve_slack" | "amplifier_saturation") {
        // A knee as sharp as they come: from a soft one a fit does not find there.
        let sharp = |start: &Vec<f64>| {
            let mut start = start.clone();
            if let Some(knee) = start.last_mut() {
                *knee *= 0.15;
            }
            start
        };
        let sharper: Vec<Vec<f64>> = all.iter().map(sharp).collect();
        all.extend(sharper);
    }
    all
}

/// Points at which an effect is screened.
fn starts(name: &str, extent: Extent) -> Vec<Vec<f64>> {
    let one = |values: &[f64]| values.iter().map(|v| vec![*v]).collect::<Vec<_>>();
    let two = |first: f64, seconds: &[f64]| seconds.iter().map(|s| vec![first, *s]).collect();
    let (low, high) = extent.volts;
    match name {
        "supply_sag" => one(&[3e7, 1.5e8]),
        "valve_delay" => one(&[0.004, 0.015, 0.05]),
        "valve_deadband" => one(&[0.001, 0.01, 0.04]),
        "leak" => one(&[1e-11]),
        "chamber_volume" => one(&[0.1, 1.0]),
        "muscle_hysteresis" => two(0.1, &[0.007, 0.02, 0.05]),
        "muscle_creep" => two(0.05, &[0.6, 2.0, 6.0, 20.0]),
        "crossbeam_inertia" => one(&[0.003, 0.01, 0.03]),
        "sleeve_slack" => {
            one(&[0.001, 0.004, 0.01, 0.03, 0.07].map(|above| (extent.strain + above).max(-0.049)))
        }
        "sleeve_slip" => one(&[0.0005, 0.002, 0.01]),
        "pressure_crosstalk" => one(&[0.003]),
        "gauge_hysteresis" => two(0.1, &[0.006, 0.016, 0.045]),
        "gauge_relaxation" => two(0.05, &[0.03, 0.1, 0.35, 1.2, 3.5]),
        "gauge_softening" => two(0.03, &[0.5, 2.5, 12.0]),
        "gauge_nonlinearity" => one(&[0.005]),
        "thermal_drift" => one(&[2e-5]),
        "self_heating" => two(0.003, &[1.5, 5.0, 15.0, 45.0]),
        "amplifier_saturation" => {
            let mut points: Vec<Vec<f64>> = [0.004, 0.015, 0.05, 0.15, 0.4]
                .iter()
                .map(|d| vec![0.5, (high - d).max(1.25)])
                .collect();
            points.extend(
                [0.004, 0.015, 0.05, 0.15, 0.4].iter().map(|d| vec![(low + d).max(0.51), 3.3]),
            );
            points
        }
        "amplifier_lowpass" => one(&[0.004, 0.02, 0.08]),
        "mains_hum" => {
            [50.0, 60.0].iter().flat_map(|f| [0.002, 0.02].map(|a| vec![a, *f])).collect()
        }
        "channel_skew" => one(&[-0.02, -0.004, 0.004, 0.02, 0.08]),
        "pot_nonlinearity" => one(&[0.2]),
        "pot_backlash" => one(&[0.05, 0.2, 0.8]),
        _ => Vec::new(),
    }
}

//! The catalogue of a user's own problem: effects that are looked for, and effects that act in every run.

use stretch_data::EffectEntry;
use stretch_effects::{EffectParameter, Role, Side};
use stretch_gap::EffectSpec;

use super::spec::{OwnEffect, ProblemSpec, StageEntry};
use crate::{
    error::ProblemError,
    wrap::{Among, Placed, Site, placed},
};

/// The action behind an effect of the catalogue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Acting {
    /// An effect of the user's own: the index of its first argument among the arguments of all own effects.
    Own(usize),
    /// A wrapper, by its index.
    Wrapper(usize),
    /// The clock of the recorder: one effect of this kind for all outputs, applied to each output by its own wrapper.
    Recorder(&'static str),
}

/// An effect that is looked for.
pub(crate) type Entry = (Acting, EffectSpec);

/// Kinds of wrapper that the recorder's clock applies to all outputs at once, and the name of each
/// as an effect of the recorder.
const RECORDERS: [(&str, &str); 2] =
    [("skew", "record.skew"), ("clock_drift", "record.clock_drift")];

/// Whether a name is that of an effect of the recorder's clock.
fn is_recorder(name: &str) -> bool {
    RECORDERS.iter().any(|(_, recorder)| *recorder == name)
}

/// Wrappers around the stages.
pub(crate) struct Around {
    /// All wrappers, in the order in which they act.
    pub(crate) wrappers: Vec<Placed>,
    /// Wrappers that act in every run, with their values.
    pub(crate) standing: Vec<(usize, Vec<f64>)>,
    /// By wrapper, whether it is looked for.
    is_open: Vec<bool>,
    /// Names of effects of the recorder's clock that already have values.
    known_clocks: Vec<String>,
}

impl Around {
    /// The wrappers that a problem looks for, and the wrappers that it already has.
    ///
    /// # Errors
    /// Names that are unknown, values that are missing.
    pub(crate) fn of(
        spec: &ProblemSpec,
        sites: &[Site],
        among: &Among<'_>,
        notes: &mut Vec<String>,
    ) -> Result<Self, ProblemError> {
        let asked: Vec<String> = spec.wrap.iter().map(|name| outputs_of(name)).collect();
        let known = spec.wrapped.iter().map(|w| outputs_of(&w.name));
        let all: Vec<String> = asked.iter().cloned().chain(known).collect();
        let wrappers = placed(sites, among, &all, notes)?;
        let mut is_open: Vec<bool> =
            wrappers.iter().map(|w| asked.iter().any(|name| w.is_called(name))).collect();
        let mut standing = Vec::new();
        for known in &spec.wrapped {
            let name = outputs_of(&known.name);
            for (at, wrapper) in wrappers.iter().enumerate().filter(|(_, w)| w.is_called(&name)) {
                is_open[at] &= is_recorder(&known.name);
                standing.push((at, values_of(wrapper, known)?));
            }
        }
        let known = spec.wrapped.iter().map(|w| w.name.clone());
        let known_clocks = known.filter(|name| is_recorder(name)).collect();
        Ok(Self { wrappers, standing, is_open, known_clocks })
    }

    /// The wrappers that are looked for, as effects.
    pub(crate) fn looked_for(&self, stages: &[StageEntry]) -> Vec<Entry> {
        let open = || self.wrappers.iter().enumerate().filter(|(at, _)| self.is_open[*at]);
        let among: Vec<Placed> = open().map(|(_, w)| w.clone()).collect();
        let spec = |w: &Placed| EffectSpec {
            reads: w.other().and_then(|column| read_by(stages, w.site.stage, column)),
            ..w.spec(&among, &stages[w.site.stage].name)
        };
        let mut out: Vec<Entry> = open().map(|(at, w)| (Acting::Wrapper(at), spec(w))).collect();
        let is_open = |name: &str| self.known_clocks.iter().all(|known| known != name);
        for (kind, name) in RECORDERS.into_iter().filter(|(_, name)| is_open(name)) {
            let Some(clock) = recorder((kind, name), &among, &out) else { continue };
            let own = out.iter_mut().filter(|(_, own)| clock.twins.contains(&own.name));
            own.for_each(|(_, own)| own.twins.push(name.to_owned()));
            out.push((Acting::Recorder(kind), clock));
        }
        out
    }

    /// Removes effects from a catalogue. A name may also be the kind or the place of a wrapper.
    ///
    /// # Errors
    /// A name that matches no effect of the catalogue.
    pub(crate) fn without(
        &self,
        catalogue: Vec<Entry>,
        names: &[String],
    ) -> Result<Vec<Entry>, ProblemError> {
        let is_called = |(acting, spec): &Entry, name: &str| {
            let wrapper = match acting {
                Acting::Wrapper(at) => Some(&self.wrappers[*at]),
                _ => None,
            };
            spec.name == name || wrapper.is_some_and(|w| w.kind.name == name || w.is_called(name))
        };
        for name in names {
            if !catalogue.iter().any(|entry| is_called(entry, name)) {
                let known = catalogue.iter().map(|(_, spec)| spec.name.as_str());
                return Err(ProblemError::unknown("without", "effect", name, known));
            }
        }
        let is_left = |entry: &Entry| !names.iter().any(|name| is_called(entry, name));
        Ok(catalogue.into_iter().filter(is_left).collect())
    }
}

/// The stage whose output is `column`; `None` if that stage is the reader, or if `column` is one of
/// the reader's inputs.
fn read_by(stages: &[StageEntry], reader: usize, column: &str) -> Option<usize> {
    let is_input = stages[reader].inputs.iter().any(|input| input == column);
    stages.iter().position(|s| s.output == column).filter(|s| *s != reader && !is_input)
}

/// The name of the wrappers that implement an effect: `output.KIND` for an effect of the recorder's
/// clock, otherwise the effect's own name.
fn outputs_of(name: &str) -> String {
    let recorder = RECORDERS.iter().find(|(_, recorder)| *recorder == name);
    recorder.map_or_else(|| name.to_owned(), |(kind, _)| format!("output.{kind}"))
}

/// Values of a wrapper that acts in every run, in the order of its parameters.
fn values_of(wrapper: &Placed, known: &EffectEntry) -> Result<Vec<f64>, ProblemError> {
    let owner = || format!("[[wrapped]] {}", known.name);
    let parameters = &wrapper.parameters;
    let names = || parameters.iter().map(|p| &*p.name);
    if let Some(name) = known.parameters.keys().find(|name| names().all(|n| n != name.as_str())) {
        return Err(ProblemError::unknown(owner(), "parameter", name, names()));
    }
    let value = |p: &EffectParameter| {
        known.parameters.get(&*p.name).copied().or(p.usual_form()).ok_or_else(|| {
            let found = format!("it has no {}", p.name);
            ProblemError::value(owner(), found, format!("write {} = VALUE", p.name))
        })
    };
    parameters.iter().map(value).collect()
}

/// Returns the wrappers of one kind that act on outputs, each with its index.
pub(crate) fn behind_outputs<'a>(
    kind: &'a str,
    wrappers: &'a [Placed],
) -> impl Iterator<Item = (usize, &'a Placed)> {
    let all = wrappers.iter().enumerate();
    all.filter(move |(_, w)| w.kind.name == kind && w.site.side == Side::Output)
}

/// The effect of the recorder's clock that acts on all outputs at once; `None` unless several
/// outputs have a wrapper of this kind. A shift of all outputs comes from the recorder, a shift of
/// a single output from its sensor.
fn recorder(
    (kind, name): (&str, &str),
    wrappers: &[Placed],
    catalogue: &[Entry],
) -> Option<EffectSpec> {
    let of = |w: &Placed| catalogue.iter().map(|(_, spec)| spec).find(|spec| spec.name == w.name);
    let own: Vec<&EffectSpec> = behind_outputs(kind, wrappers).filter_map(|(_, w)| of(w)).collect();
    let first = own.first().filter(|_| own.len() > 1)?;
    Some(EffectSpec {
        name: name.to_owned(),
        touches: own.iter().flat_map(|spec| spec.touches.clone()).collect(),
        twins: own.iter().map(|spec| spec.name.clone()).collect(),
        ..(*first).clone()
    })
}

/// Returns the user's own effects that are looked for, and the values of the arguments of all own
/// effects in a run without these effects.
pub(crate) fn own_effects(
    effects: &[OwnEffect],
    stages: &[StageEntry],
) -> Result<(Vec<Entry>, Vec<f64>), ProblemError> {
    let (mut specs, mut off) = (Vec::new(), Vec::new());
    for effect in effects {
        let all: Vec<usize> = (0..stages.len())
            .filter(|s| effect.stages.is_empty() || effect.stages.contains(&stages[*s].name))
            .collect();
        if effect.arguments.is_empty() || effect.arguments.iter().all(|a| a.off.is_none()) {
            return Err(ProblemError::value(
                format!("effect {}", effect.name),
                "no argument states the value at which the effect does nothing",
                "give off = VALUE",
            ));
        }
        let first = off.len();
        let mut parameters = Vec::new();
        for a in &effect.arguments {
            let name = if a.name.is_empty() { &effect.name } else { &a.name };
            let [min, max] = a.range;
            // a logarithmic search never reaches 0, so an off value of 0 may be outside the range
            let is_off = |off: f64| (min..=max).contains(&off) || a.is_log && off == 0.0;
            // an empty range is reported by the fit
            if let Some(off) = a.off.filter(|off| min < max && !is_off(*off)) {
                return Err(ProblemError::value(
                    format!("effect {name}"),
                    format!("off = {off} is outside of its range, {min} to {max}"),
                    "give a range that contains off, the value at which the effect does nothing",
                ));
            }
            let middle = if a.is_log { (min * max).sqrt() } else { 0.5 * (min + max) };
            off.push(a.value.or(a.off).unwrap_or(middle));
            let strength = EffectParameter::sized(name, &a.unit, min..=max);
            parameters.push(match a.off {
                Some(off) if a.is_log => strength.off_at(off).log(),
                Some(off) => strength.off_at(off),
                None if a.is_log => strength.with_role(Role::Shape).log(),
                None => strength.with_role(Role::Shape),
            });
        }
        let place = (all.first().copied().unwrap_or(0), stages[all[0]].name.as_str());
        let mut spec = EffectSpec::new(&effect.name, place, parameters);
        spec.touches = all;
        spec.twins.clone_from(&effect.twins);
        if !effect.is_standing() {
            specs.push((Acting::Own(first), spec));
        }
    }
    Ok((specs, off))
}

//! A gauge alone: any stretch sensor with a reference, without valves and muscle. It is simulated as a rig of one
//! stage.

use std::collections::BTreeMap;

use stretch_data::{Parameter, RigFile};
use stretch_effects::{
    Alone, Effect, EffectParameter, Extent, Grid, Need, RigStage, Search, Skew, Span, Start,
    Surroundings,
};

use crate::{
    SimError,
    effects::{ActiveEffect, EffectSet},
    error::nearest,
    params::Tolerance,
    stages::{Memory, Reference, Sites, check_length, pick},
};

/// The nominal gauge, with signal y and reference x: y = offset + gain e, e = (x - zero)/span.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeSpec {
    /// Reference at e = 0: its minimum over the fit trials.
    pub zero: f64,
    /// Range of the reference over the fit trials.
    pub span: f64,
    /// Signal at e = 0.
    pub offset: f64,
    /// Change of the signal over the range of the reference.
    pub gain: f64,
    /// Reference pressure P_ref of `pressure_crosstalk`, in the unit of the given pressure; `None` if no pressure was
    /// recorded.
    pub pressure_scale: Option<f64>,
}

/// A gauge alone, prepared to run. The effects of `sensing` act on e instead of the strain, on 1 + (y - offset)/gain
/// instead of the resistance, and on (y - offset)/gain instead of the voltage. The effects of `reference` act on e as
/// it is measured, so they are undone before e drives the gauge. `amplifier_saturation` is not used;
/// `pressure_crosstalk` is used only with a pressure.
#[derive(Debug)]
pub struct Gauge {
    spec: GaugeSpec,
    grid: Grid,
    sites: Sites,
    skew: Option<Skew>,
    reference: Reference,
    needs_pressure: bool,
}

impl Gauge {
    /// Whether an effect can act in a gauge alone.
    pub fn accepts(effect: &Effect, has_pressure: bool) -> bool {
        matches!(effect.stage, RigStage::Sensing | RigStage::Reference)
            && match effect.needs {
                Some(Need::Pressure) => has_pressure,
                Some(Need::Amplifier) => false,
                None => true,
            }
    }

    /// Size of the catalogue's unit of a parameter, in units of e or of the span of y; 1 for a unit that does not
    /// measure the stroke.
    ///
    /// ```
    /// use stretch_sim::{Gauge, effect_named};
    /// let w = &effect_named("sleeve_slip").unwrap().parameters[0];
    /// assert_eq!((&*w.unit, Gauge::unit(w)), ("strain", 5.0));
    /// ```
    pub fn unit(parameter: &EffectParameter) -> f64 {
        let mut strokes = Surroundings::STROKES.iter();
        strokes.find(|(unit, _)| *unit == parameter.unit).map_or(1.0, |(_, stroke)| 1.0 / stroke)
    }

    /// Returns the ranges and the starts of the search for an effect in a gauge alone.
    pub fn search(effect: &Effect, alone: &Alone) -> Search {
        let units: Vec<f64> = effect.fitted().map(Self::unit).collect();
        let mut search = Search::of(effect, &Extent::between(0.0, 1.0)).times(&units);
        (effect.alone)(alone, &mut search);
        search
    }

    /// Prepares a gauge for recordings sampled every `dt_s`.
    ///
    /// # Errors
    /// A span or gain that is zero or not finite, a sample time that is not positive, an effect
    /// that cannot act here.
    pub fn new(spec: GaugeSpec, effects: &EffectSet, dt_s: f64) -> Result<Self, SimError> {
        for (name, value) in [("span of the reference", spec.span), ("gain", spec.gain.abs())] {
            if !(value.is_finite() && value > 0.0) {
                return Err(SimError::not_positive(name, value));
            }
        }
        let on = |e: &&ActiveEffect| !e.is_off();
        if let Some(e) = effects
            .iter()
            .filter(on)
            .find(|e| !Self::accepts(e.effect(), spec.pressure_scale.is_some()))
        {
            let needs = e.effect().needs.map_or("valves and a muscle", Need::words);
            return Err(SimError::not_here(e.name(), needs));
        }
        let grid = Grid::samples(dt_s)?;
        let around = Self::surroundings(&spec, &grid);
        let sites = Sites::new(effects.acting_in(RigStage::Sensing), &around);
        let reference = Reference::around(&around, effects, &grid);
        Ok(Self {
            spec,
            skew: sites.skew(&grid),
            sites,
            reference,
            needs_pressure: effects
                .acting_in(RigStage::Sensing)
                .any(|e| e.effect().needs.is_some()),
            grid,
        })
    }

    /// The surroundings of an effect in a gauge alone.
    pub fn surroundings<'a>(spec: &GaugeSpec, grid: &'a Grid) -> Surroundings<'a> {
        Surroundings::of_gauge(spec.pressure_scale, grid)
    }

    /// Creates a memory for this gauge.
    pub fn memory(&self) -> Memory {
        Memory::with_cells(self.sites.record.end())
    }

    /// Signal y at every sample, from the measured (smoothed) reference at the same samples. The
    /// pressure may be empty unless an effect needs it.
    ///
    /// # Errors
    /// Slices of different lengths, or a missing pressure that an effect needs.
    pub fn run(
        &self,
        memory: &mut Memory,
        start: Start,
        start_s: f64,
        reference: &[f64],
        pressure: &[f64],
        signal: &mut [f64],
    ) -> Result<(), SimError> {
        check_length("reference", signal.len(), reference.len())?;
        if !pressure.is_empty() || self.needs_pressure {
            check_length("pressure", signal.len(), pressure.len())?;
        }
        if signal.is_empty() {
            return Ok(());
        }
        let start = memory.start(start);
        let mut strain = std::mem::take(&mut memory.nodes);
        strain.clear();
        strain.extend(reference.iter().map(|x| (x - self.spec.zero) / self.spec.span));
        self.reference.undo(&mut strain);
        let sites = &self.sites;
        let whole = Span { start_s, pressure_kpa: pressure, ..Span::whole(&self.grid) };
        let first = Span { pressure_kpa: pressure.get(..1).unwrap_or(&[]), ..whole };
        let cells = &mut memory.cells;
        let e = [sites.strain.begin(&first, start, strain[0], cells)];
        sites.resistance.begin_at(start, e[0], cells);
        let mut r = [1.0 + e[0]];
        sites.resistance.run(&Span { strain: &e, ..first }, cells, &mut r);
        sites.volts.begin(&first, start, r[0] - 1.0, cells);

        sites.strain.run(&whole, cells, &mut strain);
        for (y, e) in signal.iter_mut().zip(&strain) {
            *y = 1.0 + e;
        }
        sites.resistance.run(&Span { strain: &strain, ..whole }, cells, signal);
        for y in signal.iter_mut() {
            *y -= 1.0;
        }
        sites.volts.run(&whole, cells, signal);
        if let Some(skew) = &self.skew {
            strain.copy_from_slice(signal);
            pick(&self.grid, Some(skew), &strain, signal);
        }
        sites.record.begin(&whole, Start::Settled, signal[0], cells);
        sites.record.run(&whole, cells, signal);
        for y in signal.iter_mut() {
            *y = self.spec.offset + self.spec.gain * *y;
        }
        memory.nodes = strain;
        Ok(())
    }
}

/// Value of `kind` for a gauge alone.
const KIND: &str = "gauge";

/// The only table of the file.
const TABLE: &str = "sensing";

/// Required parameters; `pressure_scale` is optional.
const REQUIRED: [&str; 4] = ["zero", "span", "offset", "gain"];

/// The nominal gauge alone: its numbers, the tolerances of offset and gain, and its effects.
#[derive(Debug, Clone, PartialEq)]
pub struct GaugeRig {
    /// Numbers.
    pub spec: GaugeSpec,
    /// Tolerance of the offset.
    pub offset: Tolerance,
    /// Tolerance of the gain.
    pub gain: Tolerance,
    /// Effects that are on.
    pub effects: EffectSet,
}

impl GaugeRig {
    /// Returns the gauge that a file of `kind = "gauge"` describes. Offset and gain are exact
    /// unless they have a tolerance, like every parameter of a rig file. A gauge has no stock
    /// values, so every number is required.
    ///
    /// ```
    /// use stretch_data::RigFile;
    /// use stretch_sim::{GaugeRig, Tolerance};
    /// let text = r#"
    /// kind = "gauge"
    /// [[effect]]
    /// name = "channel_skew"
    /// skew_s = 0.05
    /// [sensing]
    /// zero = { value = 2.0 }
    /// span = { value = 88.0 }
    /// offset = { value = 0.01 }
    /// gain = { value = 0.2, tolerance = 0.05 }
    /// "#;
    /// let gauge = GaugeRig::from_file(&RigFile::parse("rig.toml", text)?)?;
    /// assert_eq!((gauge.spec.span, gauge.effects.iter().count()), (88.0, 1));
    /// assert_eq!((gauge.offset, gauge.gain), (Tolerance::Exact, Tolerance::Relative(0.05)));
    /// assert_eq!(GaugeRig::from_file(&gauge.to_file())?, gauge);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Another kind, an unknown table, parameter or effect, a missing parameter, or an unusable
    /// span or gain.
    pub fn from_file(file: &RigFile) -> Result<Self, SimError> {
        let unknown = SimError::unknown_parameter;
        let kind = file.kind.as_deref().unwrap_or("rig");
        if kind != KIND {
            return Err(SimError::kind(kind, "of a gauge alone, with kind = \"gauge\""));
        }
        if let Some(table) = file.stages.keys().find(|table| *table != TABLE) {
            return Err(SimError::unknown_table("a gauge alone", table, Some(TABLE.to_owned())));
        }
        let empty = BTreeMap::new();
        let table = file.stages.get(TABLE).unwrap_or(&empty);
        let known = || REQUIRED.into_iter().chain(["pressure_scale"]);
        if let Some(name) = table.keys().find(|name| known().all(|k| k != name.as_str())) {
            return Err(unknown(TABLE, name, nearest(name, known())));
        }
        let value = |name: &str| {
            let value = table.get(name).map(|parameter| parameter.value);
            value.ok_or_else(|| SimError::missing_parameter(TABLE, name))
        };
        let spec = GaugeSpec {
            zero: value("zero")?,
            span: value("span")?,
            offset: value("offset")?,
            gain: value("gain")?,
            pressure_scale: value("pressure_scale").ok(),
        };
        let mut effects = EffectSet::new();
        for entry in &file.effects {
            effects.insert_in(entry, Gauge::unit)?;
        }
        // refuses a gauge that cannot run now, not at the first trial
        Gauge::new(spec, &effects, 0.01)?;
        let tolerance = |name: &str| table.get(name).map_or(Tolerance::Exact, Tolerance::of);
        Ok(Self { spec, offset: tolerance("offset"), gain: tolerance("gain"), effects })
    }

    /// The gauge as a file.
    pub fn to_file(&self) -> RigFile {
        let GaugeSpec { zero, span, offset, gain, pressure_scale } = self.spec;
        let exact = Tolerance::Exact;
        let mut table: BTreeMap<String, Parameter> = [
            ("zero", exact.of_value(zero)),
            ("span", exact.of_value(span)),
            ("offset", self.offset.of_value(offset)),
            ("gain", self.gain.of_value(gain)),
        ]
        .map(|(name, parameter)| (name.to_owned(), parameter))
        .into();
        if let Some(scale) = pressure_scale {
            table.insert("pressure_scale".to_owned(), exact.of_value(scale));
        }
        RigFile {
            kind: Some(KIND.to_owned()),
            effects: self.effects.to_entries(),
            stages: BTreeMap::from([(TABLE.to_owned(), table)]),
        }
    }
}

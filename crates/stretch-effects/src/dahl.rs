//! Friction that builds up over a distance, independent of the speed.

use alloc::{boxed::Box, format, vec, vec::Vec};

use stretch_core::arithmetic::play;

use crate::{
    extent::Extent,
    friction::FRICTION,
    kind::{Beside, Kind, Signals},
    operator::{Operator, Span, Start},
    parameter::EffectParameter,
    sketch::Sketch,
};

/// Friction of a contact that builds up with the distance moved: y = x + f u. The state u lies between -1 and 1 and
/// follows z, the position behind a play (backlash) of half-width w. The [`Span`] passes the position in the field of
/// the strain:
///
/// ```text
/// du = dz/s (1 - u sign(dz)) where u and dz have one sign, else dz/s (1 - back u sign(dz)),     z = play(position, w)
/// ```
///
/// Each move is solved exactly. A `back` of 1 gives Dahl's model, 0 that of Bouc and Wen. With a load the force is f u
/// |load|/`load_size`, with the `load` of the span. The memory is u and z.
///
/// Source: Dahl 1968, "A solid friction model", The Aerospace Corporation TOR-0158(3107-18)-1.
///
/// ```
/// use stretch_effects::{Dahl, Grid, Operator, Span, Start};
/// let brake = Dahl { f: 20.0, s: 1.0, back: 1.0, w: 0.0, load_size: None };
/// let (mut cells, mut force) = ([0.0; 2], [0.0; 3]);
/// brake.begin(Start::Settled, 0.0, &mut cells);
/// let grid = Grid::samples(0.01)?;
/// brake.run(&Span { strain: &[0.0, 1.0, 41.0], ..Span::whole(&grid) }, &mut cells, &mut force);
/// // After the way s it has 1 - 1/e of its force, after a long way all.
/// assert!((force[1] - 20.0 * (1.0 - (-1.0_f64).exp())).abs() < 1e-12 && force[0] == 0.0);
/// assert!((force[2] - 20.0).abs() < 1e-12);
/// # Ok::<(), stretch_effects::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dahl {
    /// Force after a long move, in the unit of the signal.
    pub f: f64,
    /// Presliding length: distance over which the force rises from 0 to 1 - 1/e of `f`, in the unit of the position,
    /// above 0.
    pub s: f64,
    /// Steepness after a reversal, from 0 to 1: at full opposing force the slope is (1 + back)/s, against 1/s at rest.
    pub back: f64,
    /// Half-width of the play between the position and the contact, in the unit of the position.
    pub w: f64,
    /// Load at which the force is `f`; `None` if the force does not depend on a load.
    pub load_size: Option<f64>,
}

impl Dahl {
    /// Returns the state u after a move.
    fn moved(&self, u: f64, dz: f64) -> f64 {
        let mut way = dz.abs() / self.s;
        let mut along = if dz < 0.0 { -u } else { u };
        if along < 0.0 {
            let back = self.back;
            // Distance until the force is zero.
            let home = if back > 0.0 { libm::log1p(-back * along) / back } else { -along };
            if way < home {
                along = match back > 0.0 {
                    true => 1.0 / back - (1.0 / back - along) * libm::exp(-back * way),
                    false => along + way,
                };
                return if dz < 0.0 { -along } else { along };
            }
            (way, along) = (way - home, 0.0);
        }
        along = 1.0 - (1.0 - along) * libm::exp(-way);
        if dz < 0.0 { -along } else { along }
    }
}

impl Operator for Dahl {
    fn cells(&self) -> usize {
        2
    }

    fn begin(&self, start: Start, first: f64, cells: &mut [f64]) {
        match start {
            Start::Settled => cells.copy_from_slice(&[0.0, first]),
            Start::Hysteresis(share) => cells.copy_from_slice(&[share.clamp(-1.0, 1.0), first]),
            Start::Carried { .. } => {
                let z = play(cells[1], first, self.w);
                cells.copy_from_slice(&[self.moved(cells[0], z - cells[1]), z]);
            }
        }
    }

    fn run(&self, span: &Span<'_>, cells: &mut [f64], signal: &mut [f64]) {
        let [mut u, mut z] = [cells[0], cells[1]];
        let mut loads = span.load.iter();
        for (x, position) in signal.iter_mut().zip(span.strain) {
            let to = play(z, *position, self.w);
            u = self.moved(u, to - z);
            z = to;
            let load = loads.next();
            let share = match (self.load_size, load) {
                (Some(size), Some(load)) => load.abs() / size,
                _ => 1.0,
            };
            *x += self.f * share * u;
        }
        cells.copy_from_slice(&[u, z]);
    }
}

/// Friction that depends on the position.
pub static DAHL_FRICTION: Kind = Kind {
    name: "dahl_friction",
    title: "friction that builds up over a distance",
    words: "its friction depends on position: the force builds up over a presliding length (Dahl)",
    equation: "y = x + f u behind the stage, x - f u in front of it; du = dp/s (1 - u sign(dp)), p the position",
    beside: Beside::Position,
    parameters: |e, unit| [force(e, unit), shape(e), back()].into(),
    starts: Some(|e| starts(e, |f, s| vec![f, s, 1.0])),
    operator: |v, _, _| Box::new(alone(v)),
    sketch: Some(|v, _, signals| alone(v).sketch(signals)),
    twins: &["coulomb_friction", "play_friction", "load_dahl_friction"],
    ..FRICTION
};

/// Friction that depends on the position and is proportional to another channel.
pub static LOAD_DAHL_FRICTION: Kind = Kind {
    name: "load_dahl_friction",
    title: "friction over a distance, scaled by a load",
    words: "its friction depends on position, in proportion to another channel (a load, a voltage)",
    equation: "y = x + f u |load|/max|load| behind the stage, x - the same in front of it; du = dp/s (1 - u sign(dp)), p the position",
    beside: Beside::PositionAndLoad,
    parameters: |e, unit| [force(e, unit), shape(e), back()].into(),
    starts: Some(|e| starts(e, |f, s| vec![f, s, 1.0])),
    operator: |v, e, _| Box::new(loaded(v, e)),
    sketch: Some(|v, e, signals| loaded(v, e).sketch(signals)),
    twins: &["dahl_friction", "load_friction"],
    ..FRICTION
};

/// Friction behind a play.
pub static PLAY_FRICTION: Kind = Kind {
    name: "play_friction",
    title: "friction behind a play",
    words: "its friction depends on position, behind a gap: play and friction in series",
    equation: "y = x + f u behind the stage, x - f u in front of it; du = dz/s (1 - u sign(dz)), z = play(p, w), p the position",
    beside: Beside::Position,
    parameters: |e, unit| {
        let size = e.beside[1] - e.beside[0];
        let w = EffectParameter::shaped("w", "position", 1e-3 * size..=0.5 * size);
        [force(e, unit), w, shape(e), back()].into()
    },
    starts: Some(|e| {
        let size = e.beside[1] - e.beside[0];
        let gaps = [0.02, 0.1].map(|k| k * size);
        let each = gaps.iter().flat_map(|w| starts(e, |f, s| vec![f, *w, s, 1.0]));
        each.collect()
    }),
    operator: |v, _, _| Box::new(behind_play(v)),
    sketch: Some(|v, _, signals| behind_play(v).sketch(signals)),
    twins: &["dahl_friction", "coulomb_friction"],
    ..FRICTION
};

fn force(e: &Extent, unit: &str) -> EffectParameter {
    EffectParameter::sized("f", unit, 0.0..=0.5 * e.span())
}

/// Returns the parameter of the presliding length.
fn shape(e: &Extent) -> EffectParameter {
    let size = (e.beside[1] - e.beside[0]).max(f64::MIN_POSITIVE);
    EffectParameter::shaped("s", "position", 1e-3 * size..=0.5 * size)
}

fn back() -> EffectParameter {
    EffectParameter::formed("back", "1", 0.0..=1.0, 1.0)
}

fn starts(e: &Extent, with: impl Fn(f64, f64) -> Vec<f64>) -> Vec<Vec<f64>> {
    let size = e.beside[1] - e.beside[0];
    let forces = [0.03, 0.2].map(|k| k * e.span());
    let each = forces.iter().flat_map(|f| [0.005, 0.05, 0.25].map(|k| with(*f, k * size)));
    each.collect()
}

fn alone(v: &[f64]) -> Dahl {
    Dahl { f: v[0], s: v[1], back: v[2], w: 0.0, load_size: None }
}

fn loaded(v: &[f64], e: &Extent) -> Dahl {
    Dahl { load_size: Some(e.load_size()), ..alone(v) }
}

fn behind_play(v: &[f64]) -> Dahl {
    Dahl { f: v[0], w: v[1], s: v[2], back: v[3], load_size: None }
}

impl Dahl {
    fn sketch(&self, signals: &Signals) -> Sketch {
        let position = signals.beside.clone().named("p");
        let gap = match self.w {
            0.0 => "let z = p",
            _ => "let z = max(p - W, min(p + W, s.z))",
        };
        let share = if self.load_size.is_some() { " * abs(load) / LOAD" } else { "" };
        let (home, turned) = match self.back {
            0.0 => ("-along", "along + way"),
            _ => {
                ("log1p(-BACK * along) / BACK", "1 / BACK - (1 / BACK - along) * exp(-BACK * way)")
            }
        };
        let body = format!(
            "{gap}
            let dz = z - s.z
            var way = abs(dz) / S
            var along = s.u
            if dz < 0
            along = -s.u
            end
            if along < 0
            let home = {home}
            if way < home
            along = {turned}
            way = 0
            else
            way = way - home
            along = 0
            end
            end
            if along >= 0
            along = 1 - (1 - along) * exp(-way)
            end
            s.u = along
            if dz < 0
            s.u = -along
            end
            s.z = z
            var y = x + F * s.u{share}"
        );
        let unit = position.unit.clone();
        let mut sketch = Sketch::of(signals.x.clone(), body).beside(position);
        sketch = sketch.with_all(&[("F", self.f, &*signals.x.unit), ("S", self.s, &*unit)]);
        if self.back != 0.0 {
            sketch = sketch.with("BACK", self.back, "1");
        }
        if self.w != 0.0 {
            sketch = sketch.with("W", self.w, &unit);
        }
        if let Some(size) = self.load_size {
            sketch = sketch.beside(signals.load.clone()).with("LOAD", size, &signals.load.unit);
        }
        sketch.cells(["u"], "1", "0").cells(["z"], unit, "p")
    }
}

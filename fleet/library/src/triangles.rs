//! Partial fits of many groups at once.

use std::{mem, sync::Arc};

use datafusion::{
    arrow::array::{Array, BooleanArray, Float64Array},
    arrow::buffer::NullBuffer,
    common::{Result, exec_datafusion_err},
    logical_expr::EmitTo,
};
use stretch_core::Degree;
use stretch_fit::{Factor, FitError, SurfaceAccumulator};

use crate::{
    about::About,
    span::Span,
    state::{Partial, StateError, Stored, read, write, write_refusal},
};

/// Rows of a group and branch that are collected before they are folded together.
pub(crate) const ROWS: usize = 128;

/// The largest accepted number, because powers of larger ones overflow `f64`.
const MOST: f64 = 1e15;

/// Rows that wait: rates, signals, references.
type Waiting = [[f64; ROWS]; 3];

/// Partial fits, flat: a side is a branch of a group, and place `group * sides + side` holds it.
///
/// A group costs a triangle and, once it receives rows, `3 ROWS` numbers a side: 7.4 kB for poly13,
/// 14 kB for the widest surface. All groups share the block that folds.
#[derive(Debug)]
pub(crate) struct Triangles<const TERMS: usize> {
    degree: Degree,
    sides: usize,
    empty: Factor<f64, TERMS>,
    block: Box<SurfaceAccumulator<f64, TERMS, ROWS>>,
    factors: Vec<Factor<f64, TERMS>>,
    spans: Vec<Span>,
    waiting: Vec<Waiting>,
    filled: Vec<u8>,
    left_out: Vec<u64>,
    /// Metadata of the columns: of these rows, and of merged states.
    own: Arc<str>,
    about: Vec<Arc<str>>,
    refused: Vec<Option<Box<str>>>,
}

/// What a group came to.
pub(crate) type Outcome<const TERMS: usize> = std::result::Result<Partial<TERMS>, Box<str>>;

impl<const TERMS: usize> Triangles<TERMS> {
    /// Of no group, for a line (one side) or a surface a branch (two).
    pub(crate) fn new(degree: Degree, sides: usize, about: &About) -> Result<Self, FitError> {
        let block = Box::new(SurfaceAccumulator::new(degree)?);
        Ok(Self {
            degree,
            sides,
            empty: block.factor(),
            block,
            factors: Vec::new(),
            spans: Vec::new(),
            waiting: Vec::new(),
            filled: Vec::new(),
            left_out: Vec::new(),
            own: about.text(),
            about: Vec::new(),
            refused: Vec::new(),
        })
    }

    /// The same of no group.
    pub(crate) fn of_no_group(&self) -> Self {
        Self {
            block: self.block.clone(),
            own: self.own.clone(),
            factors: Vec::new(),
            spans: Vec::new(),
            waiting: Vec::new(),
            filled: Vec::new(),
            left_out: Vec::new(),
            about: Vec::new(),
            refused: Vec::new(),
            ..*self
        }
    }

    pub(crate) fn degree(&self) -> Degree {
        self.degree
    }

    /// Room for so many groups.
    fn grow(&mut self, groups: usize) {
        let places = groups * self.sides;
        if self.factors.len() < places {
            self.factors.resize(places, self.empty);
            self.spans.resize(places, Span::EMPTY);
            self.filled.resize(places, 0);
            self.left_out.resize(groups, 0);
            self.about.resize_with(groups, || self.own.clone());
            self.refused.resize_with(groups, || None);
        }
    }

    /// Takes rows: `rate` of a surface, `signal` and `reference`. Values that are null, not finite
    /// or larger than [`MOST`] are left out and counted; rows that the filter drops do not count.
    pub(crate) fn rows(
        &mut self,
        [rate, signal, reference]: [&Float64Array; 3],
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) -> Result<()> {
        self.grow(total);
        self.waiting.resize(total * self.sides, [[0.0; ROWS]; 3]);
        let nulls = NullBuffer::union(rate.nulls(), signal.nulls());
        let nulls = NullBuffer::union(nulls.as_ref(), reference.nulls());
        let columns = [rate, signal, reference].map(|column| &column.values()[..groups.len()]);
        let sides = self.sides;
        let is_row = |row: usize| filter.is_none_or(|kept| kept.is_valid(row) && kept.value(row));
        // false for NaN, too
        let is_sound = |row: usize| {
            let [r, v, x] = columns.map(|values| values[row].abs() <= MOST);
            r & v & x & nulls.as_ref().is_none_or(|nulls| nulls.is_valid(row))
        };
        let place =
            |row: usize| groups[row] * sides + usize::from(sides == 2 && columns[0][row] < 0.0);
        let mut row = 0;
        while row < groups.len() {
            let mut end = row + 1;
            if is_row(row) && is_sound(row) {
                // rows of a trial are consecutive, and a branch lasts for many of them
                let own = place(row);
                while end < groups.len() && is_row(end) && is_sound(end) && place(end) == own {
                    end += 1;
                }
                self.take(own, columns.map(|values| &values[row..end]))?;
            } else if is_row(row) {
                let left_out = &mut self.left_out[groups[row]];
                *left_out = left_out.saturating_add(1);
            }
            row = end;
        }
        Ok(())
    }

    /// Takes a place's rows in.
    fn take(&mut self, place: usize, mut columns: [&[f64]; 3]) -> Result<()> {
        while !columns[0].is_empty() {
            let filled = usize::from(self.filled[place]);
            let some = columns[0].len().min(ROWS - filled);
            for (waiting, column) in self.waiting[place].iter_mut().zip(&mut columns) {
                let (now, later) = column.split_at(some);
                waiting[filled..filled + some].copy_from_slice(now);
                *column = later;
            }
            self.filled[place] += some as u8;
            if filled + some == ROWS {
                self.fold(place)?;
            }
        }
        Ok(())
    }

    /// Folds what waits at a place.
    fn fold(&mut self, place: usize) -> Result<()> {
        let filled = usize::from(mem::take(&mut self.filled[place]));
        if filled == 0 {
            return Ok(());
        }
        let rows = &self.waiting[place];
        for (column, values) in rows.iter().enumerate() {
            self.spans[place].widen(column, &values[..filled]);
        }
        let folded = |error| exec_datafusion_err!("rows of a fit: {error}");
        self.block.exchange(self.factors[place]).map_err(folded)?;
        let [rates, signals, references] = rows;
        let (rates, signals, references) =
            (&rates[..filled], &signals[..filled], &references[..filled]);
        self.block.push_columns(rates, signals, references).map_err(folded)?;
        self.factors[place] = self.block.exchange(self.empty).map_err(folded)?;
        Ok(())
    }

    /// Takes stored states, one per group index; a null is no state. An unusable state refuses its
    /// group with an error text.
    pub(crate) fn states<'a>(
        &mut self,
        states: impl Iterator<Item = Option<&'a [u8]>>,
        groups: &[usize],
        filter: Option<&BooleanArray>,
        total: usize,
    ) {
        self.grow(total);
        for (row, (state, &group)) in states.zip(groups).enumerate() {
            let dropped = filter.is_some_and(|kept| !(kept.is_valid(row) && kept.value(row)));
            let Some(state) = state.filter(|_| !dropped) else { continue };
            let known = &self.about[group];
            let merged = match read(state, self.sides as u8, self.degree, known) {
                Ok(Stored::Partial(partial)) => self.merge(group, &partial),
                Ok(Stored::Refusal(sentence)) => Err(StateError::Refused { sentence }),
                Err(error) => Err(error),
            };
            if let Err(error) = merged {
                let sentence = match error {
                    StateError::Refused { sentence } => sentence,
                    error => format!("a stored state cannot be merged: {error}"),
                };
                self.refused[group].get_or_insert(sentence.into());
            }
        }
    }

    fn merge(&mut self, group: usize, other: &Partial<TERMS>) -> Result<(), StateError> {
        let mine = group * self.sides..(group + 1) * self.sides;
        if *other.about != *self.about[group] {
            // the columns of a merge are states; the first one states its source columns
            let fresh = self.factors[mine.clone()].iter().all(|factor| factor.samples() == 0);
            if !fresh || self.left_out[group] > 0 {
                let (found, expected) = (other.about.to_string(), self.about[group].to_string());
                return Err(StateError::Columns { found, expected });
            }
            self.about[group] = other.about.clone();
        }
        self.left_out[group] = self.left_out[group].saturating_add(other.left_out);
        for (place, side) in mine.zip(&other.sides) {
            if let Some((factor, span)) = side {
                let kind = |_| StateError::Damaged { what: "its degree" };
                self.factors[place].merge(factor).map_err(kind)?;
                self.spans[place] = self.spans[place].joined(span);
            }
        }
        Ok(())
    }

    /// What the groups came to; they are gone then.
    pub(crate) fn outcomes(&mut self, emit: EmitTo) -> Result<Vec<Outcome<TERMS>>> {
        let groups = match emit {
            EmitTo::All => self.left_out.len(),
            EmitTo::First(groups) => groups,
        };
        for place in 0..groups * self.sides {
            self.fold(place)?;
        }
        let places = match emit {
            EmitTo::All => EmitTo::All,
            EmitTo::First(groups) => EmitTo::First(groups * self.sides),
        };
        let factors = places.take_needed(&mut self.factors);
        let spans = places.take_needed(&mut self.spans);
        places.take_needed(&mut self.filled);
        if !self.waiting.is_empty() {
            places.take_needed(&mut self.waiting);
        }
        let both: Vec<_> = factors.into_iter().zip(spans).collect();
        let groups = emit.take_needed(&mut self.left_out).into_iter();
        let about = emit.take_needed(&mut self.about);
        let refused = emit.take_needed(&mut self.refused);
        let outcomes = groups.zip(about).zip(refused).zip(both.chunks(self.sides));
        let outcome = |(((left_out, about), refused), sides): (_, &[(Factor<_, TERMS>, Span)])| {
            let full = |side: usize| sides.get(side).copied().filter(|side| side.0.samples() > 0);
            match refused {
                Some(sentence) => Err(sentence),
                None => Ok(Partial { left_out, about, sides: [full(0), full(1)] }),
            }
        };
        Ok(outcomes.map(outcome).collect())
    }

    /// The bytes of a group's outcome.
    pub(crate) fn write(&self, out: &mut Vec<u8>, outcome: &Outcome<TERMS>) {
        match outcome {
            Ok(partial) => write(out, self.sides as u8, self.degree, partial),
            Err(sentence) => write_refusal(out, sentence),
        }
    }

    /// Bytes held.
    pub(crate) fn size(&self) -> usize {
        fn of<T>(v: &Vec<T>) -> usize {
            v.capacity() * size_of::<T>()
        }
        let sentences = self.refused.iter().flatten().map(|s| s.len()).sum::<usize>();
        size_of::<Self>()
            + size_of::<SurfaceAccumulator<f64, TERMS, ROWS>>()
            + of(&self.factors)
            + of(&self.spans)
            + of(&self.waiting)
            + of(&self.filled)
            + of(&self.left_out)
            + of(&self.about)
            + of(&self.refused)
            + sentences
    }
}

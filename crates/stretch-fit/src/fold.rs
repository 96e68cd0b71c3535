//! Folding a block of rows into a triangular factor by Householder reflections.
//!
//! With `R` the factor so far and `B` the block, reflections built on
//! `[R; B]` zero `B` column by column (Golub and Van Loan, Matrix
//! Computations, 4th ed., section 5.2; the block-by-block form is the TSQR of
//! Demmel et al., doi:10.1137/080731992). No product `A^T A` is ever formed,
//! so the error grows with the condition number and not with its square.
//!
//! Blocks are stored by column, so every inner loop runs along the rows, whose
//! number is a constant: the compiler vectorises it.

// Lanes are walked by index: the form that the compiler vectorises.
#![allow(clippy::needless_range_loop)]

use stretch_core::Real;

/// Numbers that one pass of an inner loop handles side by side.
const LANES: usize = 4;

/// All lanes: halves first, as they lie in registers, or the compiler shuffles in the loops before.
#[inline(always)]
fn total<T: Real>(sums: [T; LANES]) -> T {
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// `v . a`, in lanes.
#[inline(always)]
fn dot<T: Real, const ROWS: usize>(v: &[T; ROWS], a: &[T; ROWS]) -> T {
    let mut sums = [T::zero(); LANES];
    let ((v, v_tail), (a, a_tail)) = (v.as_chunks::<LANES>(), a.as_chunks::<LANES>());
    for (v, a) in v.iter().zip(a) {
        for lane in 0..LANES {
            sums[lane] = sums[lane] + v[lane] * a[lane];
        }
    }
    let mut tail = T::zero();
    for (&v, &a) in v_tail.iter().zip(a_tail) {
        tail = tail + v * a;
    }
    total(sums) + tail
}

/// `a - s v` into each `a`, and `next . a` of the result: several columns at
/// once share the loads of `v` and `next`.
#[inline(always)]
fn reflect_then_dot<T: Real, const COLUMNS: usize, const ROWS: usize>(
    a: [&mut [T; ROWS]; COLUMNS],
    s: [T; COLUMNS],
    v: &[T; ROWS],
    next: &[T; ROWS],
) -> [T; COLUMNS] {
    let whole = ROWS - ROWS % LANES;
    let mut sums = [[T::zero(); LANES]; COLUMNS];
    for start in (0..whole).step_by(LANES) {
        for lane in 0..LANES {
            let row = start + lane;
            for column in 0..COLUMNS {
                let x = a[column][row] - s[column] * v[row];
                a[column][row] = x;
                sums[column][lane] = sums[column][lane] + next[row] * x;
            }
        }
    }
    let mut tails = [T::zero(); COLUMNS];
    for row in whole..ROWS {
        for column in 0..COLUMNS {
            let x = a[column][row] - s[column] * v[row];
            a[column][row] = x;
            tails[column] = tails[column] + next[row] * x;
        }
    }
    let mut dots = [T::zero(); COLUMNS];
    for ((dot, sums), tail) in dots.iter_mut().zip(sums).zip(tails) {
        *dot = total(sums) + tail;
    }
    dots
}

/// `a - s v` into `a`, and the sum of squares of the result.
#[inline(always)]
fn reflect_then_square<T: Real, const ROWS: usize>(a: &mut [T; ROWS], s: T, v: &[T; ROWS]) -> T {
    let mut sums = [T::zero(); LANES];
    let (a, a_tail) = a.as_chunks_mut::<LANES>();
    let (v, v_tail) = v.as_chunks::<LANES>();
    for (a, v) in a.iter_mut().zip(v) {
        for lane in 0..LANES {
            let x = a[lane] - s * v[lane];
            a[lane] = x;
            sums[lane] = sums[lane] + x * x;
        }
    }
    let mut tail = T::zero();
    for (a, &v) in a_tail.iter_mut().zip(v_tail) {
        *a = *a - s * v;
        tail = tail + *a * *a;
    }
    total(sums) + tail
}

/// One reflection `I - beta w w^T` with `w = (head, v)`: what it takes to
/// apply it, once the sum of squares below the diagonal is known.
struct Reflection<T> {
    head: T,
    beta: T,
}

impl<T: Real> Reflection<T> {
    /// The reflection that zeroes a column of sum of squares `below` under the
    /// diagonal entry `d`, which it replaces. A column too small to be squared
    /// without underflow is left alone: it is zero to this number type.
    #[inline(always)]
    fn zeroing(d: &mut T, below: T) -> Self {
        let square = *d * *d + below;
        let floor = T::min_positive_value() / (T::epsilon() * T::epsilon());
        if below == T::zero() || square < floor {
            return Self { head: T::zero(), beta: T::zero() };
        }
        let norm = square.sqrt();
        // a choice of a number, not of a way: the sign changes from fold to fold, and a wrong guess costs more than the arithmetic
        let signed = if *d > T::zero() { norm } else { -norm };
        let (head, beta) = (*d + signed, T::one() / (norm * (norm + d.abs())));
        *d = -signed;
        Self { head, beta }
    }

    /// What to subtract from a column, per unit of `w`; updates its top entry.
    #[inline(always)]
    fn apply(&self, top: &mut T, dot: T) -> T {
        let s = (self.head * *top + dot) * self.beta;
        *top = *top - s * self.head;
        s
    }
}

/// Folds `block` (one array a term) and `values` into `r` and `q`, so that
/// `[R q]` becomes the triangular factor of all rows together. Both are
/// overwritten. Returns the sum of squares that no coefficient can explain,
/// to be added to the residual sum of squares.
///
/// Entries at or below the diagonal beyond `terms` are not touched.
#[inline]
pub(crate) fn fold<T: Real, const TERMS: usize, const ROWS: usize>(
    terms: usize,
    r: &mut [[T; TERMS]; TERMS],
    q: &mut [T; TERMS],
    block: &mut [[T; ROWS]; TERMS],
    values: &mut [T; ROWS],
) -> T {
    let terms = terms.min(TERMS);
    // `dots[j]` holds v_k . column j, known one step ahead: the pass that
    // applies reflection k - 1 to column j also multiplies it by column k.
    let mut dots = [T::zero(); TERMS];
    let mut value_dot = T::zero();
    let mut below = T::zero();
    if let Some((first, rest)) = block[..terms].split_first() {
        below = dot(first, first);
        for (j, column) in rest.iter().enumerate() {
            dots[j + 1] = dot(first, column);
        }
        value_dot = dot(first, values);
    }
    let mut unexplained = if terms == 0 { dot(values, values) } else { T::zero() };
    for k in 0..terms {
        let row = &mut r[k];
        let reflection = Reflection::zeroing(&mut row[k], below);
        let (done, ahead) = block[..terms].split_at_mut(k + 1);
        let v = &done[k];
        let mut subtract = [T::zero(); TERMS];
        for j in k + 1..terms {
            subtract[j] = reflection.apply(&mut row[j], dots[j]);
        }
        let s_value = reflection.apply(&mut q[k], value_dot);
        if let Some((next, rest)) = ahead.split_first_mut() {
            below = reflect_then_square(next, subtract[k + 1], v);
            let mut j = k + 2;
            let mut pairs = rest.chunks_exact_mut(2);
            for pair in &mut pairs {
                if let [one, two] = pair {
                    let s = [subtract[j], subtract[j + 1]];
                    [dots[j], dots[j + 1]] = reflect_then_dot([one, two], s, v, next);
                    j += 2;
                }
            }
            if let [last] = pairs.into_remainder() {
                let s = [subtract[j], s_value];
                [dots[j], value_dot] = reflect_then_dot([last, values], s, v, next);
            } else {
                [value_dot] = reflect_then_dot([values], [s_value], v, next);
            }
        } else {
            unexplained = reflect_then_square(values, s_value, v);
        }
    }
    unexplained
}

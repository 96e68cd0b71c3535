//! Folding a block of rows into a triangular factor by Householder reflections.
//!
//! With `R` the factor so far and `B` the block, reflections built on
//! `[R; B]` zero `B` column by column (Golub and Van Loan, Matrix
//! Computations, 4th ed., section 5.2; the block-by-block form is the TSQR of
//! Demmel et al., doi:10.1137/080731992). No product `A^T A` is ever formed,
//! so the error grows with the condition number and not with its square.
//!
//! Blocks are stored by column. Every inner loop therefore runs along the rows, whose number is a compile-time
//! constant, and the compiler vectorises it.

// Loops over lanes use indices, because the compiler vectorises this form.
#![allow(clippy::needless_range_loop)]

use stretch_core::Real;

/// Number of SIMD lanes: numbers that one pass of an inner loop processes in parallel.
const LANES: usize = 4;

/// Returns the sum over the lanes. Lanes 0 and 2, and lanes 1 and 3, are added first, because of their places in the
/// registers. With another order the compiler adds shuffles to the preceding loops.
#[inline(always)]
fn total<T: Real>(sums: [T; LANES]) -> T {
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// Returns the dot product of `v` and `a`, summed in lanes.
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

/// Replaces each `a` by `a - s v`, and returns the dot product of `next` and each result. Processing several columns at
/// once shares the loads of `v` and `next`.
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

/// Replaces `a` by `a - s v`, and returns the sum of squares of the result.
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

/// A reflection `I - beta w w^T` with `w = (head, v)`, where `v` is the column below the diagonal.
struct Reflection<T> {
    head: T,
    beta: T,
}

impl<T: Real> Reflection<T> {
    /// Returns the reflection that zeroes a column below the diagonal entry `d`, and updates `d`. `below` is the
    /// column's sum of squares. If the squares of a column underflow, it counts as zero and is left unchanged.
    #[inline(always)]
    fn zeroing(d: &mut T, below: T) -> Self {
        let square = *d * *d + below;
        let floor = T::min_positive_value() / (T::epsilon() * T::epsilon());
        if below == T::zero() || square < floor {
            return Self { head: T::zero(), beta: T::zero() };
        }
        let norm = square.sqrt();
        // selected without a branch: the sign changes from fold to fold, and a mispredicted branch would cost more than
        // the arithmetic
        let signed = if *d > T::zero() { norm } else { -norm };
        let (head, beta) = (*d + signed, T::one() / (norm * (norm + d.abs())));
        *d = -signed;
        Self { head, beta }
    }

    /// Returns the factor s with which `s v` must be subtracted from a column, and updates the column's top entry.
    #[inline(always)]
    fn apply(&self, top: &mut T, dot: T) -> T {
        let s = (self.head * *top + dot) * self.beta;
        *top = *top - s * self.head;
        s
    }
}

/// Folds `block` (one array per term) and `values` into `r` and `q`, so that `[R q]` becomes the triangular factor of
/// all rows together. `block` and `values` are overwritten. Returns the sum of squares that no coefficients can
/// explain, which the caller adds to the residual sum of squares.
///
/// Entries of `r` below the diagonal or beyond `terms` are not changed.
#[inline]
pub(crate) fn fold<T: Real, const TERMS: usize, const ROWS: usize>(
    terms: usize,
    r: &mut [[T; TERMS]; TERMS],
    q: &mut [T; TERMS],
    block: &mut [[T; ROWS]; TERMS],
    values: &mut [T; ROWS],
) -> T {
    let terms = terms.min(TERMS);
    // `dots[j]` is the dot product of v_k and column j. It is computed one step ahead: the pass that applies reflection
    // k - 1 to column j also computes its dot product with column k.
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

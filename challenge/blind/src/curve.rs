//! Functions of one variable as tables, and smooth random functions.

use crate::random::RandomGenerator;

/// Number of intervals of a table. Between the knots, the true curve is defined as linear, so
/// interpolation adds no error.
const INTERVALS: usize = 240;

/// A function on 0..1, linear between knots; beyond the ends it continues with the last slope.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Curve(Vec<f64>);

impl Curve {
    /// Makes the table of a function on 0..1.
    pub(crate) fn table(f: impl Fn(f64) -> f64) -> Self {
        Self((0..=INTERVALS).map(|i| f(i as f64 / INTERVALS as f64)).collect())
    }

    /// Returns the integral of a positive function from 0 to x, divided by the integral from 0
    /// to 1. It rises from 0 to 1.
    pub(crate) fn risen(slope: impl Fn(f64) -> f64) -> Self {
        let mut sum = 0.0;
        let middle = |i: usize| slope((i as f64 + 0.5) / INTERVALS as f64).max(1e-9);
        let mut values = vec![0.0];
        for i in 0..INTERVALS {
            sum += middle(i);
            values.push(sum);
        }
        Self(values.into_iter().map(|v| v / sum).collect())
    }

    /// Returns the curve multiplied by a number.
    pub(crate) fn times(mut self, factor: f64) -> Self {
        self.0.iter_mut().for_each(|v| *v *= factor);
        self
    }

    /// Returns the largest absolute value.
    pub(crate) fn size(&self) -> f64 {
        self.0.iter().fold(0.0, |most, v| v.abs().max(most))
    }

    /// Mean over 0..1.
    pub(crate) fn mean(&self) -> f64 {
        let ends = 0.5 * (self.0[0] + self.0[INTERVALS]);
        (self.0.iter().sum::<f64>() - ends) / INTERVALS as f64
    }

    /// Integral from 0 to each knot.
    pub(crate) fn integral(&self) -> Self {
        let mut sum = 0.0;
        let steps = self.0.windows(2).map(|w| {
            sum += 0.5 * (w[0] + w[1]) / INTERVALS as f64;
            sum
        });
        Self(std::iter::once(0.0).chain(steps).collect())
    }

    fn cell(&self, x: f64) -> (f64, f64, f64) {
        let at = x * INTERVALS as f64;
        // The cast turns a negative number or NaN into 0, the first cell.
        let low = (at as usize).min(INTERVALS - 1);
        let (a, b) = (self.0[low], self.0[low + 1]);
        (a, b, at - low as f64)
    }

    /// Value at `x`.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let (a, b, share) = self.cell(x);
        a + (b - a) * share
    }

    /// Slope at `x`.
    pub(crate) fn slope(&self, x: f64) -> f64 {
        let (a, b, _) = self.cell(x);
        (b - a) * INTERVALS as f64
    }
}

/// A smooth random function on 0..1: a Catmull-Rom spline through knots with Gaussian values.
#[derive(Debug, Clone)]
pub(crate) struct Wiggle(Vec<f64>);

impl Wiggle {
    /// Draws the values at `knots` knots (at least 2) with the standard deviation `sd`.
    pub(crate) fn draw(knots: usize, sd: f64, random: &mut RandomGenerator) -> Self {
        Self((0..knots.max(2)).map(|_| sd * random.gauss()).collect())
    }

    /// Value at `x`.
    pub(crate) fn at(&self, x: f64) -> f64 {
        let last = self.0.len() - 1;
        let at = x.clamp(0.0, 1.0) * last as f64;
        let low = (at as usize).min(last - 1);
        let knot = |i: isize| self.0[(low as isize + i).clamp(0, last as isize) as usize];
        hermite([knot(-1), knot(0), knot(1), knot(2)], at - low as f64)
    }
}

/// Returns the Catmull-Rom cubic between the middle two of four equidistant values.
pub(crate) fn hermite([a, b, c, d]: [f64; 4], t: f64) -> f64 {
    b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
}

/// Draws positive weights that sum to 1. `sd` is the standard deviation of their logarithms.
pub(crate) fn weights(count: usize, sd: f64, random: &mut RandomGenerator) -> Vec<f64> {
    let raw: Vec<f64> = (0..count).map(|_| (sd * random.gauss()).exp()).collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|w| w / sum).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::{abs_diff_eq, assert_abs_diff_eq, assert_relative_eq, relative_eq};
    use testkit::tolerance::{BLIND_CURVE, BLIND_SLOPE, F64_ROUNDING};

    #[test]
    fn a_table_keeps_straight_lines_and_goes_on_beyond_its_ends() {
        let line = Curve::table(|x| 2.0 * x - 0.5);
        for x in [-0.3, 0.0, 0.123, 0.999, 1.0, 1.4] {
            assert!(abs_diff_eq!(line.at(x), 2.0 * x - 0.5, epsilon = BLIND_CURVE), "{x}");
            assert!(
                relative_eq!(line.slope(x), 2.0, epsilon = 0.0, max_relative = BLIND_SLOPE),
                "{x}"
            );
        }
        assert_abs_diff_eq!(line.mean(), 0.5, epsilon = BLIND_CURVE);
        // x^2 - x/2 at 1.
        assert_abs_diff_eq!(line.integral().at(1.0), 0.5, epsilon = BLIND_CURVE);
    }

    #[test]
    fn splines_pass_through_their_knots_and_weights_sum_to_one() {
        let mut random = RandomGenerator::new(1, 9);
        let wiggle = Wiggle::draw(5, 1.0, &mut random);
        for (i, knot) in wiggle.0.iter().enumerate() {
            assert_abs_diff_eq!(wiggle.at(0.25 * i as f64), *knot, epsilon = BLIND_CURVE);
        }
        let sum = weights(6, 1.0, &mut random).iter().sum::<f64>();
        assert_relative_eq!(sum, 1.0, epsilon = 0.0, max_relative = F64_ROUNDING);
    }
}

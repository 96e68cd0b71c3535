//! Choice of the order (degree) of a surface by an acceptance criterion.

use stretch_core::{Degree, MAX_DEGREE, Real};

use crate::{
    CrossValidation, Factor, FitError,
    cross_validation::{Pooled, judge, leave_out},
};

/// Largest number of orders in a table.
const MOST: usize = 5;

/// The fit of one order on all trials, and its error on trials left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderRow<T> {
    /// The order.
    pub degree: Degree,
    /// Number of terms.
    pub terms: usize,
    /// R^2 over all trials; `None` if all values are equal.
    pub r_squared: Option<T>,
    /// RMSE over all trials with `n - p` degrees of freedom; `None` if none is left.
    pub rmse: Option<T>,
    /// Leave-one-trial-out cross-validation; `Err` if there is only one trial, or if a term cannot be determined
    /// without some trial.
    pub cross_validation: Result<CrossValidation<T>, FitError>,
    /// Excess of the cross-validated mean squared error over that of the best order; `None` without cross-validation.
    pub excess: Option<Excess<T>>,
}

/// A difference of two orders' cross-validated mean squared errors, over trials.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Excess<T> {
    /// Mean over trials.
    pub mean: T,
    /// Standard error of that mean.
    pub standard_error: T,
}

/// An order with its row, or with the error of its fit.
pub type OrderEntry<T> = (Degree, Result<OrderRow<T>, FitError>);

/// A comparison of a chosen order with its next lower and next higher orders, or of several curves.
///
/// An order satisfies the acceptance criterion if its cross-validated mean squared error exceeds that of the best order
/// by at most one standard error. The excess and its standard error are computed from the differences on single trials.
/// A higher order is therefore recommended even for a small improvement if it improves every trial, but not if it
/// improves some trials and worsens others. This is the one-standard-error rule of Breiman et al., *Classification and
/// Regression Trees*, 1984, section 3.4.3, on paired differences.
///
/// ```
/// use stretch_core::Degree;
/// use stretch_fit::{OrderTable, Sample, SurfaceAccumulator};
///
/// // The truth is quadratic in the voltage; the error differs from trial to trial.
/// let trials = [1, 2, 3, 4].map(|trial| {
///     let covering = OrderTable::<f64>::covering(Degree::POLY13);
///     let mut sums = SurfaceAccumulator::<f64>::new(covering);
///     for k in 0..300 {
///         let (rate, volts) = (f64::from(k % 17) / 8.0 - 1.0, f64::from(k % 41) / 20.0 - 1.0);
///         let noise = 0.05 * f64::from(k * k * trial % 23 - 11) / 11.0;
///         let value = rate + volts + rate * volts + volts * volts + noise;
///         sums.push(Sample { rate, volts, value }).unwrap();
///     }
///     sums.factor()
/// });
/// let table = OrderTable::new(&trials, Degree::POLY13)?;
/// assert_eq!(table.rows().count(), 5);
/// assert_eq!(table.recommended(), Some(Degree::new(1, 2).unwrap()));
/// # Ok::<(), stretch_fit::FitError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderTable<T> {
    rows: [Option<OrderEntry<T>>; MOST],
}

impl<T: Real> OrderTable<T> {
    /// Returns `chosen` and its neighbours, by rising number of terms. The neighbours have one degree less or more in
    /// the voltage or in the rate. For poly13: poly03, poly12, poly13, poly14, poly23.
    pub fn neighbours(chosen: Degree) -> impl Iterator<Item = Degree> {
        let mut all = [
            Some(chosen),
            shifted(chosen, -1, 0),
            shifted(chosen, 0, -1),
            shifted(chosen, 0, 1),
            shifted(chosen, 1, 0),
        ];
        all.sort_unstable_by_key(|degree| degree.map(|d| (d.terms(), d.rate(), d.volts())));
        all.into_iter().flatten()
    }

    /// Returns the smallest degree that contains all orders of the table, so that one pass over the samples is enough:
    /// poly24 for poly13.
    pub fn covering(chosen: Degree) -> Degree {
        let up = |power: u8| (power + 1).min(MAX_DEGREE as u8);
        Degree::new(up(chosen.rate()), up(chosen.volts())).unwrap_or(chosen)
    }

    /// Compares `chosen` and its [`neighbours`](Self::neighbours), given one factor per trial. An order that
    /// the factors were not accumulated for gets an error instead of a row.
    ///
    /// # Errors
    /// [`FitError::TooFewSamples`] without any factor, [`FitError::MissingTerm`] if the degrees of the factors differ.
    pub fn new<const TERMS: usize>(
        trials: &[Factor<T, TERMS>],
        chosen: Degree,
    ) -> Result<Self, FitError> {
        Self::comparing(trials, chosen, Self::neighbours(chosen))
    }

    /// Compares curves over the voltage alone, of degree 1 to 5, given one factor per trial. A degree that the factors
    /// were not accumulated for gets an error instead of a row.
    ///
    /// # Errors
    /// The errors of [`new`](Self::new).
    ///
    /// ```
    /// use stretch_core::Degree;
    /// use stretch_fit::{OrderTable, Sample, SurfaceAccumulator};
    ///
    /// // a weight and a reading a trial; the sensor is quadratic
    /// let trial = |k: u32| {
    ///     let mut sums = SurfaceAccumulator::<f64>::new(Degree::new(0, 5).unwrap());
    ///     let (volts, noise) = (f64::from(k), 0.1 * (f64::from(7 * k * k % 11) - 5.0));
    ///     sums.push(Sample { rate: 0.0, volts, value: volts + 0.3 * volts * volts + noise }).unwrap();
    ///     sums.factor()
    /// };
    /// let trials: Vec<_> = (0..20).map(trial).collect();
    /// assert_eq!(OrderTable::curves(&trials)?.recommended(), Some(Degree::new(0, 2).unwrap()));
    /// # Ok::<(), stretch_fit::FitError>(())
    /// ```
    pub fn curves<const TERMS: usize>(trials: &[Factor<T, TERMS>]) -> Result<Self, FitError> {
        let degrees = (1..=MAX_DEGREE as u8).filter_map(|volts| Degree::new(0, volts).ok());
        Self::comparing(trials, Degree::LINE, degrees)
    }

    fn comparing<const TERMS: usize>(
        trials: &[Factor<T, TERMS>],
        chosen: Degree,
        degrees: impl Iterator<Item = Degree>,
    ) -> Result<Self, FitError> {
        let needed = chosen.terms() as u64;
        let (first, rest) =
            trials.split_first().ok_or(FitError::TooFewSamples { needed, got: 0 })?;
        let mut all = *first;
        rest.iter().try_for_each(|trial| all.merge(trial))?;
        let mut orders = [None; MOST];
        orders.iter_mut().zip(degrees).for_each(|(place, degree)| *place = Some(degree));
        let mut judged: [Pooled<T>; MOST] = Default::default();
        let mut differences = [[Difference::new(); MOST]; MOST];
        leave_out(trials, &mut |trial, others| {
            // the merged factor of the other trials is computed once and used for every order
            let held =
                orders.map(|degree| degree.map(|degree| judge(trials, trial, others, degree)));
            for (i, held_out) in held.iter().enumerate() {
                let Some(held_out) = held_out else { continue };
                judged[i].take(*held_out);
                for (j, best) in held.iter().enumerate() {
                    if let (Ok(a), Some(Ok(b))) = (held_out, best) {
                        differences[i][j].take(a.mean_square() - b.mean_square());
                    }
                }
            }
        })?;
        let mut rows = [None; MOST];
        for ((place, degree), judged) in rows.iter_mut().zip(orders).zip(judged) {
            *place = degree.map(|degree| (degree, row(&all, degree, judged.finish(degree))));
        }
        let mut table = Self { rows };
        let best = table.best().map(|row| row.degree);
        if let Some(best) = orders.iter().position(|&degree| degree == best) {
            for ((_, row), differences) in table.rows.iter_mut().flatten().zip(differences) {
                if let Ok(row) = row
                    && row.cross_validation.is_ok()
                {
                    row.excess = differences[best].excess();
                }
            }
        }
        Ok(table)
    }

    /// Returns each order with its row, or with the error of its fit, by rising number of terms.
    pub fn rows(&self) -> impl Iterator<Item = &OrderEntry<T>> {
        self.rows.iter().flatten()
    }

    fn fitted(&self) -> impl Iterator<Item = &OrderRow<T>> {
        self.rows().filter_map(|(_, row)| row.as_ref().ok())
    }

    /// Returns the order with the lowest cross-validated error, regardless of its number of terms.
    pub fn best(&self) -> Option<&OrderRow<T>> {
        let error = |row: &OrderRow<T>| row.cross_validation.map(|cv| cv.rmse).ok();
        self.fitted()
            .filter(|row| error(row).is_some())
            .reduce(|best, row| if error(row) < error(best) { row } else { best })
    }

    /// Returns the order with the fewest terms that satisfies the acceptance criterion (see `OrderTable`). `None` if
    /// there are not enough trials to leave one out, because a single trial gives no estimate of the error on other
    /// trials.
    pub fn recommended(&self) -> Option<Degree> {
        self.fitted()
            .find(|row| row.excess.is_some_and(|excess| excess.mean <= excess.standard_error))
            .map(|row| row.degree)
    }
}

fn shifted(degree: Degree, rate: i8, volts: i8) -> Option<Degree> {
    let rate = degree.rate().checked_add_signed(rate)?;
    let volts = degree.volts().checked_add_signed(volts)?;
    Degree::new(rate, volts).ok()
}

fn row<T: Real, const TERMS: usize>(
    all: &Factor<T, TERMS>,
    degree: Degree,
    cross_validation: Result<CrossValidation<T>, FitError>,
) -> Result<OrderRow<T>, FitError> {
    let fit = all.fit_degree(degree)?;
    Ok(OrderRow {
        degree,
        terms: degree.terms(),
        r_squared: fit.r_squared(),
        rmse: fit.rmse(),
        cross_validation,
        excess: None,
    })
}

/// Running statistics of the difference of two orders in held-out mean squared error: number of trials, mean, and sum
/// of squares about the mean (Welford 1962, doi:10.1080/00401706.1962.10490022).
#[derive(Clone, Copy)]
struct Difference<T> {
    count: T,
    mean: T,
    squares: T,
}

impl<T: Real> Difference<T> {
    fn new() -> Self {
        Self { count: T::zero(), mean: T::zero(), squares: T::zero() }
    }

    fn take(&mut self, difference: T) {
        self.count = self.count + T::one();
        let off = difference - self.mean;
        self.mean = self.mean + off / self.count;
        self.squares = self.squares + off * (difference - self.mean);
    }

    fn excess(self) -> Option<Excess<T>> {
        let Self { count, mean, squares } = self;
        let fewer = count - T::one();
        (fewer > T::zero())
            .then(|| Excess { mean, standard_error: (squares / (count * fewer)).sqrt() })
    }
}

//! Tolerances of the tests, each with its reason.

/// Relative: rounding of `f64` in a short chain of operations.
pub const F64_ROUNDING: f64 = 1e-14;

/// Relative: rounding of a value that another tool printed with at least twelve digits.
pub const PRINTED: f64 = 1e-12;

/// Absolute: Horner's scheme compared with a sum of terms. The difference is the rounding of 21
/// terms of size `3 * 2^5`.
pub const HORNER: f64 = 21.0 * 96.0 * 4.0 * f64::EPSILON;

/// For a normalised number, in units of the larger of 1 and (offset + span) / span: eight roundings
/// for the conversion in both directions.
pub const RANGE_ROUND_TRIP: f64 = 8.0 * f64::EPSILON;

/// In codes: a single rounding to nearest of an exact sum.
pub const LAST_ROUNDING: f64 = 0.5;

/// Relative to the reference's full scale: the receptor combines the normalisation with the
/// coefficients. Therefore it computes in another order than the formula in the paper, which makes
/// a difference of a few hundred roundings of terms up to `3 * 4^5` (21 terms of the polynomial
/// surfaces at four times the range).
pub const FOLDED: f64 = 1e-8;

/// Relative to the largest tap: Savitzky-Golay taps compared with exact rational arithmetic. There
/// are up to 11 steps of a three-term recurrence, then as many products.
pub const TAPS: f64 = 1e-12;

/// Relative to the largest value: taps or output of a tool that solves a
/// Vandermonde system, of condition up to 1e6 once its columns are scaled.
pub const SOLVED_TAPS: f64 = 1e-9;

/// Relative to slope and delay: an alpha-beta or recursive estimate of a rate. It is a difference
/// of values (up to 1e3 s^2 for a parabola, up to 1e2 for a ramp), times the sample rate of 100 Hz.
pub const RATE_FROM_DIFFERENCES: f64 = 1e-7;

/// Relative: the part of a transient that may remain when a live estimator reports that it has
/// warmed up.
pub const WARMED_UP: f64 = 0.01;

/// Relative: superposition of signals in a recursive filter that rounds at every step. With a
/// cutoff of 0.2 Hz at a sample rate of 100 Hz, its poles magnify rounding by up to (100/0.2)^2/40.
pub const SUPERPOSITION: f64 = 1e-11;

/// Relative: rounding of a gain that is computed by projection on 14 000 samples.
pub const PROJECTED_GAIN: f64 = 1e-9;

/// In units of the signal per second: the derivative of a local fit of degree 3 to values up to 10.
/// It divides by a window of 0.1 s and has taps up to 1e3 at the ends.
pub const LOCAL_RATE: f64 = 1e-8;

/// In units of the signal: values up to 10, fitted or interpolated with weights
/// whose magnitudes add up to less than a hundred.
pub const LOCAL_VALUE: f64 = 1e-11;

/// Relative to the largest output: 120 steps of a cascade of up to four recursive sections, in two
/// implementations that round every step differently. At a cutoff of fs/200 the sections forget
/// over 100 samples and magnify rounding of their poles by (fs/cutoff)^2, about 1e4.
pub const RECURSIVE_OUTPUT: f64 = 1e-9;

/// Relative: compared with a numerical integration by another tool that was asked for an accuracy
/// of 1e-12.
pub const QUADRATURE: f64 = 1e-9;

/// Relative: a delay at frequency zero. The other tool computed it from the phase at a small
/// frequency (1e-3 Hz, with cutoffs of at least 0.5 Hz); the error is of second order in the ratio
/// of the two frequencies.
pub const DELAY_FROM_PHASE: f64 = 1e-4;

/// Relative: three standard errors of a standard deviation that is measured on 40 000 correlated
/// outputs, equivalent to a few hundred independent ones.
pub const MEASURED_DEVIATION: f64 = 0.08;

/// Relative to the largest output: `f32` compared with `f64`, for a filter with a gain near one or
/// a Savitzky-Golay rate of at most 31 taps.
pub const F32_FILTER: f64 = 1e-4;

/// Relative: sums over 1200 samples. NumPy adds them pairwise, the crate with compensation of
/// rounding errors.
pub const METRICS_SUMS: f64 = 1e-11;

/// Relative: the maximum of a parabola through correlations that differ only from the fifth digit
/// on.
pub const METRICS_LAG: f64 = 1e-8;

/// In samples: the error of a lag by parabolic interpolation between samples, for two slow sines
/// over 400 samples. The contribution of the ends depends on the lag.
pub const METRICS_LAG_PARABOLA: f64 = 0.1;

/// Relative: a p-value P near 1e-240. There d(ln P)/d(ln t) is about -700, which magnifies a
/// rounding of t.
pub const METRICS_TINY_P: f64 = 1e-9;

/// Relative to max(1, |ln P|), for a p-value P: a few roundings of the terms of ln P.
pub const METRICS_LN_P: f64 = 2e-14;

/// Relative: a p-value down to 1e-300. Its natural logarithm, up to about 700, is rounded to 1e-13.
pub const METRICS_P: f64 = 1e-12;

/// Relative: a critical t compared with SciPy's. A rounding of P to 1e-14 changes a small t by at
/// most this.
pub const METRICS_CRITICAL: f64 = 1e-11;

/// Relative to max(1, value): statistical moments that are merged in another order.
pub const METRICS_MERGE: f64 = 1e-10;

/// Relative to max(1, value): signals of about 1e2 lose two digits if they are moved by 1e3 and
/// back, and a spread of 1 loses two more.
pub const METRICS_SHIFT: f64 = 1e-9;

/// Relative: statistics of errors in `f32`. Each error is rounded by 2^-24; the number of samples
/// has no influence.
pub const METRICS_F32: f64 = 5e-7;

/// Relative: an integral time from 40 000 samples of correlation 0.8. It is a sum of a hundred
/// squared autocorrelations, each with a random error of 4.6/40 000. The tolerance is three
/// standard errors.
pub const EFFECTIVE_SIZE: f64 = 0.1;

/// Relative, for a noise level, and absolute, for its slow share: estimates from a hundred windows
/// of 128 samples. The 125 powers of a window determine its variance to 1/11, a hundred windows to
/// 1/110. If the correlation time of a slow part is longer than a seventh of a window, only the
/// tail of its spectrum is visible, and it is known five times less accurately.
pub const NOISE_LEVEL: f64 = 0.1;

/// Relative: the two coefficients of equal columns in a singular system, which should each be half
/// of the common one. The system is solved with 1e-13 of its diagonal added; its condition of 1e13
/// magnifies roundings of 1e-16.
pub const TWINS: f64 = 1e-2;

/// Absolute: a gain of -0.9 over the range, found by a diagnosis that started at -0.82. Noise of
/// 2e-3 at 12 000 samples with a spread of 0.35 causes an error of 5e-5. The rest of the tolerance
/// is for the smoothed reference and the prior.
pub const GAIN_FOUND: f64 = 2e-3;

/// Seconds: a skew in time found by a diagnosis. The tolerance is a fifth of the sample time of 10
/// ms.
pub const SKEW_FOUND_S: f64 = 2e-3;

/// Seconds: a time constant of 30 ms found by a diagnosis. The tolerance is a fifth of the sample
/// time of 10 ms.
pub const POLE_FOUND_S: f64 = 2e-3;

/// Relative to nominal: the inlet's flow found by a diagnosis, although the rig's flow differs from
/// the nominal one by 0.2. The tolerance is about a sixth of this difference.
pub const FLOW_FOUND: f64 = 0.03;

/// Relative to nominal: the muscle's time constant of 30 ms found by a diagnosis, although that of
/// the rig differs by 0.3. The tolerance is a third of this difference: 3 ms, or a third of the
/// sample time.
pub const LAG_FOUND: f64 = 0.1;

/// Seconds: the time at which a recording resumes after a gap, on a grid of 10 ms with time stamps
/// up to 4 ms late and one lost sample. The tolerance is five samples.
pub const RESUMED_S: f64 = 0.05;

/// Excess (reduced chi-square minus one) of a correct model on 1800 test samples. The tolerance is
/// three standard errors, 3 sqrt(2/1800).
pub const GAP_NULL: f64 = 0.1;

/// Relative: the errors of two calibrations that are trained on the same 18 s with different noise.
pub const TRAINED_AGAIN: f64 = 0.1;

/// Relative: a mean square of 20 000 samples, or a standard deviation from the median of as many
/// second differences, each of three neighbouring samples. The tolerance is four standard errors.
pub const MEDIAN_SPREAD: f64 = 0.04;

/// Excess (reduced chi-square minus one) of a slice of 2500 samples whose mean square is 9. The
/// tolerance is five standard errors of 9 sqrt(2/2500).
pub const SLICE_EXCESS: f64 = 1.3;

/// Relative norm of the error of coefficients: a fit to data with a condition number of up to about
/// a thousand.
pub const FIT_WELL: f64 = 1e-12;

/// Relative norm of the error of coefficients: a fit to raw volts with a condition number of up to
/// 1.3e8. The condition may magnify rounding of 1e-16 to 1e-8. The roundings of 240 rows are
/// independent, so the error stays well below 1e-8. With normal equations, which square the
/// condition number, it would be far above.
pub const FIT_ILL: f64 = 1e-9;

/// Share of `|A| |c|` plus the condition number times the residual: rounding of Householder
/// reflections over 300 rows with up to 21 terms. If all 6000 roundings of 1e-16 had the same sign,
/// their sum would be 1e-12; as a random walk it grows only with the square root of their number.
pub const FIT_BACKWARD: f64 = 1e-14;

/// Relative: SSE, R^2 and RMSE. Their residuals are differences of values and lose at most six
/// digits.
pub const FIT_STATISTICS: f64 = 1e-9;

/// Relative: Student and Fisher quantiles by bisection of an incomplete beta function.
pub const FIT_QUANTILE: f64 = 1e-12;

/// Relative: a condition number estimated from below by a dozen power iterations.
pub const FIT_CONDITION: f64 = 0.1;

/// Relative norm: the iteration of the bisquare fit stops when no coefficient changes by more than
/// 1.5e-8 of its size.
pub const FIT_BISQUARE: f64 = 1e-7;

/// Relative: the amount by which a sum of absolute residuals exceeds the optimum of the linear
/// program. The absolute value is smoothed over a millionth of the scale at each of seven
/// interpolated samples, and convergence is slow.
pub const FIT_LEAST_ABSOLUTE: f64 = 1e-6;

/// Relative norm: compared with the bisquare fit of statsmodels, whose scale is the median absolute
/// deviation (MAD) without a correction for leverage.
pub const FIT_OTHER_SCALE: f64 = 1e-2;

/// Relative norm: as [`FIT_ILL`] over 1e5 samples, whose roundings average out. Orthogonal methods
/// reach this, and normal equations miss it by nine orders of magnitude.
pub const FIT_ILL_LONG: f64 = 1e-10;

/// Relative norm: coefficients and surface in `f32`, for volts that are normalised or centred. A
/// rounding of 6e-8 is magnified by up to a thousand.
pub const FIT_F32: f64 = 1e-4;

/// Share of k_max (the largest contraction): the static law of the muscle, tabulated by cubics at
/// 128 knots for each reference pressure. The error of interpolation is h^4/384 times the fourth
/// derivative, which is about 100.
pub const STATIC_LAW: f64 = 1e-8;

/// Share of a channel's full scale: two implementations of the rig with different integration steps
/// (the reference's own step leaves 1.5e-6, ours at most [`RIG_STEP`]).
pub const RIG_CONFORMANCE: f64 = 2e-3;

/// Share of a channel's full scale: the change of the output if the integration step is halved.
pub const RIG_STEP: f64 = 1e-4;

/// In units of the noise: the deviation of a fit of least absolute residuals from the truth if a
/// fifth of all samples are corrupted. It is largest at the edge of the rectangle, where few
/// samples determine the fit.
pub const FIT_GROSS_ERRORS: f64 = 20.0;

/// In millimetres, for a stroke of 30 mm: the difference between a receptor with memory in `f32`
/// and the same one in `f64`. Its states are near 1 and have 24 bits; up to 35 terms have
/// coefficients of up to 2.
pub const REMEMBERING_F32_MM: f64 = 2e-2;

/// In millimetres, for a stroke of 30 mm: the error of an observer on the noise-free signal of a
/// gauge that is exactly the one the observer models. Its motion model has no acceleration, so it
/// trails a sine of 0.6 Hz by about `acceleration * settling time^2`.
pub const OBSERVER_INVERTS_MM: f64 = 0.5;

/// Share of the stroke: the difference between an observer in integers and one in `f64`. Its states
/// have a resolution of 2^-26 of the stroke and its gains have 20 bits. The curve may be up to ten
/// times flatter than its mean slope, and the filter sums over hundreds of samples.
pub const FIXED_OBSERVER: f64 = 1e-4;

/// Relative: time constant and amplitude that are found for an observer from data of its own gauge
/// model. The golden-section search stops at a few per cent of the time constant, and the amplitude
/// compensates for the difference.
pub const OBSERVER_SEARCHED: f64 = 0.1;

/// Relative: the error of a history model while it runs, compared with the error that its fit
/// reports. The fit divides by the degrees of freedom (9000 samples minus 126 coefficients) and
/// leaves out the first samples.
pub const HISTORY_LIVE: f64 = 0.05;

/// Relative: the errors of two calibrations. One of them is trained on simulated trials that are as
/// long as the measured ones but have other commands. The tolerance is one and a half times
/// [`TRAINED_AGAIN`].
pub const TRAINED_APART: f64 = 0.15;

/// In units of a signal up to 25: a smoother may round a corner with slope 1 by a tenth of the step
/// between samples.
pub const CORNER_KEPT: f64 = 0.1;

/// Share of k_max: rounding of the contraction at the reference pressure, which the literature
/// gives to four decimals.
pub const K_MAX_DIGITS: f64 = 5e-5;

/// Absolute, for a value near 1: rounding in printed tables with five decimals.
pub const TABLE_DIGITS: f64 = 1e-5;

/// Volts: a value that is interpolated linearly between samples, at slopes up to 1e2 V/s. The time
/// is that of a sample, up to a rounding of 1e-15 times the session's length.
pub const SHIFTED_V: f64 = 1e-9;

/// Share of full scale: linear interpolation of a stage's input smooths its kinks.
pub const STAGE_ALONE: f64 = 2e-3;

/// Volts: the response of an amplifier with a time constant of 1e12 s to inputs up to 2 V within 6
/// s. It is 1e-11, plus rounding.
pub const NEVER_FOLLOWS_V: f64 = 1e-6;

/// Millimetres: the change that is still to come at the end of a move that has settled for seconds.
pub const BEHIND_MM: f64 = 1e-6;

/// In codes of a converter: values that are whole codes, apart from rounding to seven printed
/// digits.
pub const WHOLE_CODE: f64 = 1e-3;

/// Micrometres: half a converter step of 3.3 V/65536 at up to three taps of 0.12 per sample, at 100
/// Hz and about 1.1 mm per V/s, makes one part. The stated error is the other: 0.9 + 0.6.
pub const CODE_STEP_UM: f64 = 1.5;

/// In millimetres, for a stroke of 30 mm: the error after the baseline has drifted by 0.1 V and was
/// estimated again during a rest of 15 s.
pub const REST_FOUND_MM: f64 = 0.5;

/// Relative error of a standard deviation, and absolute error of a correlation, from 200 000
/// coloured samples with heavy tails. They are equivalent to about 20 000 independent samples, with
/// a standard error of 0.5 %, doubled for the heavy tails. The tolerance is five times that.
pub const BLIND_NOISE: f64 = 0.05;

/// Relative: the standard deviation of a drift with a correlation time of 5 s over 40 000 s,
/// equivalent to 4000 independent samples. The standard error is 1.1 %, and up to twice that for a
/// cascade of several lags. The tolerance is four to five times that.
pub const BLIND_SUPPLY: f64 = 0.1;

/// Relative: the share of missing rows, with 4000 of them in groups of four. 1000 independent
/// groups have a standard error of 3 %; the tolerance is five times that.
pub const BLIND_ROWS: f64 = 0.15;

/// Absolute, for curves with values near 1 from a table or a spline: at most some hundred
/// roundings.
pub const BLIND_CURVE: f64 = 1e-12;

/// Relative: a slope from differences in a table of 240 intervals with values up to 2. One or two
/// roundings are multiplied by 240; the tolerance is ten times that.
pub const BLIND_SLOPE: f64 = 1e-11;

/// Absolute, for a law that rises from 0 to 1: its value at the start, which is the difference
/// between a table's first knot and its reference value.
pub const BLIND_LAW_START: f64 = 1e-9;

/// Relative: the end of a law that rises from 0 to 1, where a table of 240 intervals is scaled to
/// 1.
pub const BLIND_LAW_END: f64 = 1e-9;

/// Share of the reference pressure: linear interpolation in a table of 4096 knots has an error of
/// h^2 x''/8.
pub const BLIND_LAW_TABLE: f64 = 1e-6;

/// Absolute, for unknowns near 1: ten times the change of 1e-7 at which the iteration stops.
pub const BOUNDED_SQUARES: f64 = 1e-6;

/// Seconds: a delay of 0.05 s that is computed as a sum over steps of 0.1 ms. The tolerance is two
/// steps.
pub const BLIND_DELAY_S: f64 = 2e-4;

/// Seconds: as [`BLIND_DELAY_S`], but for a lag that rises with its own time constant. Its delay in
/// a rising step may differ from the mean of rising and falling steps by this much.
pub const BLIND_UNEVEN_S: f64 = 0.02;

/// Relative: the part of a step that up to ten poles of 1 ns have not yet passed on after 1 ms,
/// 1e-6 each.
pub const BLIND_NO_FILTER: f64 = 1e-5;

/// Relative: the inelastic part of a move by 1/20 000 of the reach of a hysteresis loop, for all
/// families of loops.
pub const BLIND_ELASTIC: f64 = 0.1;

/// Relative: the inelastic part of a move by 1/2000 of the reach of a hysteresis loop, for loops
/// that are given by a formula.
pub const BLIND_LOOP_ELASTIC: f64 = 0.05;

/// Relative: the remaining transient of lags of 0.1 s after 20 s: exp(-200), and rounding.
pub const BLIND_SETTLED: f64 = 1e-9;

/// Relative: the remaining transient after 20 s of a relaxation whose slowest time constant is
/// eight to ten times 0.1 s: exp(-20).
pub const BLIND_RELAXED: f64 = 1e-6;

/// Pascals, at a supply of 620 kPa: the remaining pressure difference when a chamber is full.
pub const BLIND_FULL_PA: f64 = 100.0;

/// Pascals: choked filling adds 28.8 kPa in 10 ms; the error is made in the first integration
/// steps.
pub const BLIND_FILL_PA: f64 = 50.0;

/// Millimetres: rounding of the contraction as it is printed (5e-5 of 29 mm), plus the effect of
/// [`BLIND_FULL_PA`].
pub const BLIND_LENGTH_MM: f64 = 0.01;

/// Volts: the output of a trimmed bridge at rest, which is rounding magnified by the amplifier.
pub const BLIND_TRIMMED_V: f64 = 1e-9;

/// Relative: the offset that a slip with hysteresis keeps after venting. Venting ends at a point at
/// which the curve of the hysteresis is still slightly bent.
pub const BLIND_HYSTERESIS_STATE: f64 = 0.2;

/// Relative: the part of a pressure drop under a steady load that is still to come after 40 s.
pub const BLIND_DRAWN: f64 = 0.01;

/// Absolute, for a valve opening up to 1, far beyond a dead band: as [`BLIND_LAW_END`].
pub const BLIND_BAND: f64 = 1e-9;

/// Absolute, for a valve opening: the effect of a dead band of 1e-9, which is up to ten times its
/// width.
pub const BLIND_BAND_OFF: f64 = 1e-8;

/// Relative: coefficient and shape parameters of a term that was added to simulated data, compared
/// with those of the proposed term. Shape parameters are refined in steps of 5 %, and an error of a
/// width changes the coefficient by the same share.
pub const PLANTED_TERM: f64 = 0.08;
/// Relative difference between a coefficient that is fitted to columns in one unit and the same
/// coefficient from columns in another unit, converted back. Every sample is rounded because the
/// factors are not powers of two, and a search with numerical derivatives stops at its step size.
pub const RESCALED: f64 = 1e-4;

/// Relative: sums of ten thousand squares in another order, and a difference that is added back.
pub const TURNED: f64 = 1e-9;

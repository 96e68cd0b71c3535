//! One table of tolerances, each with its reason.

/// Relative: a few roundings of `f64` along one short chain of operations.
pub const F64_ROUNDING: f64 = 1e-14;

/// Relative: a value printed by another tool with at least twelve digits.
pub const PRINTED: f64 = 1e-12;

/// Horner's scheme compared with a sum of terms: roundings of 21 terms of size `3 * 2^5`.
pub const HORNER: f64 = 21.0 * 96.0 * 4.0 * f64::EPSILON;

/// For a normalised number, in units of the larger of 1 and (offset + span) / span: eight roundings
/// for the conversion in both directions.
pub const RANGE_ROUND_TRIP: f64 = 8.0 * f64::EPSILON;

/// In codes: a single rounding to nearest of an exact sum.
pub const LAST_ROUNDING: f64 = 0.5;

/// In units of the input, up to 1: a hysteresis of slopes from 0.1 to 9 and its inverse. Some
/// 20 roundings of values up to 9, magnified by up to 10, at each of four plays.
pub const HYSTERESIS_INVERSE: f64 = 1e-11;

/// Relative to the reference's full scale: the receptor folds normalisation into the
/// coefficients, so its terms differ from the paper's order by a few hundred roundings of
/// terms up to `3 * 4^5` (21 terms of the strategies' surfaces at four times the range).
pub const FOLDED: f64 = 1e-8;

/// Relative to the largest tap: Savitzky-Golay taps against exact rational
/// arithmetic. Up to 11 steps of a three-term recurrence, then as many products.
pub const TAPS: f64 = 1e-12;

/// Relative to the largest value: taps or output of a tool that solves a
/// Vandermonde system, of condition up to 1e6 once its columns are scaled.
pub const SOLVED_TAPS: f64 = 1e-9;

/// Relative to slope and delay: an alpha-beta or recursive estimate, a difference of
/// values up to 1e3 s^2 of a parabola or 1e2 of a ramp, times the sample rate of 100 Hz.
pub const RATE_FROM_DIFFERENCES: f64 = 1e-7;

/// Relative: the part of a transient that may remain when a live estimator reports that it has
/// warmed up.
pub const WARMED_UP: f64 = 0.01;

/// Relative: superposition through a recursive filter, rounded at every step, whose
/// poles at 0.2 Hz of 100 Hz magnify rounding by up to (100/0.2)^2/40.
pub const SUPERPOSITION: f64 = 1e-11;

/// Relative: a gain by projection on 14 000 samples, rounding alone.
pub const PROJECTED_GAIN: f64 = 1e-9;

/// In units of the signal: a local fit of degree 3 to values up to 10, whose
/// derivative divides by a window of 0.1 s and at the ends has taps up to 1e3.
pub const LOCAL_RATE: f64 = 1e-8;

/// In units of the signal: values up to 10, fitted or interpolated with weights
/// whose magnitudes add up to less than a hundred.
pub const LOCAL_VALUE: f64 = 1e-11;

/// Relative to the largest output: 120 steps of a cascade of up to four recursive sections, in two
/// implementations that round every step differently. At a cutoff of fs/200 the sections forget
/// over 100 samples and magnify rounding of their poles by (fs/cutoff)^2, about 1e4.
pub const RECURSIVE_OUTPUT: f64 = 1e-9;

/// Relative: a quadrature by another tool with a requested accuracy of 1e-12.
pub const QUADRATURE: f64 = 1e-9;

/// Relative: a delay that the other tool took from the phase at a small but not
/// zero frequency (1e-3 Hz, cutoff 0.5 Hz and above): second order in the ratio.
pub const DELAY_FROM_PHASE: f64 = 1e-4;

/// Relative: a standard deviation measured on 40 000 correlated outputs, which are worth a few
/// hundred independent ones: three standard errors.
pub const MEASURED_DEVIATION: f64 = 0.08;

/// Relative to the largest output: `f32` against `f64` through a filter of gain
/// near one or a Savitzky-Golay rate of at most 31 taps.
pub const F32_FILTER: f64 = 1e-4;

/// Relative: sums over 1200 samples, which NumPy adds pairwise and the crate with compensation.
pub const METRICS_SUMS: f64 = 1e-11;

/// Relative: a parabola through correlations that differ in their fifth digit.
pub const METRICS_LAG: f64 = 1e-8;

/// Samples: the error of parabolic interpolation between samples, for two slow sines over 400
/// samples whose end effects depend on the lag.
pub const METRICS_LAG_PARABOLA: f64 = 0.1;

/// Relative: P near 1e-240, where d(ln P)/d(ln t) is about -700.
pub const METRICS_TINY_P: f64 = 1e-9;

/// Relative to max(1, |ln P|): a few roundings of the terms of ln P.
pub const METRICS_LN_P: f64 = 2e-14;

/// Relative: P down to 1e-300; the exponent, near 700, is rounded to 1e-13.
pub const METRICS_P: f64 = 1e-12;

/// Relative: SciPy's inverse. A rounding of P to 1e-14 changes a small t by at most this.
pub const METRICS_CRITICAL: f64 = 1e-11;

/// Relative to max(1, value): moments merged in another order.
pub const METRICS_MERGE: f64 = 1e-10;

/// Relative to max(1, value): signals of about 1e2 moved by 1e3 and back lose two digits,
/// a spread of 1 two more.
pub const METRICS_SHIFT: f64 = 1e-9;

/// Relative: the errors themselves are rounded to `f32`, each by 2^-24; the length adds nothing.
pub const METRICS_F32: f64 = 5e-7;

/// Relative: an integral time from 40 000 samples of correlation 0.8. The sum of its hundred
/// squared autocorrelations has a random error of 4.6/40 000 each: three standard errors.
pub const EFFECTIVE_SIZE: f64 = 0.1;

/// Of a noise level and of its slow share, from a hundred windows of 128 samples. The 125 powers of
/// a window determine its variance to one part in 11, a hundred windows to one in 110. A slow part
/// with a correlation time longer than a seventh of a window is only known from its tail, five
/// times less accurately.
pub const NOISE_LEVEL: f64 = 0.1;

/// Relative: how two equal columns of a singular system share their common coefficient. The system
/// is solved with a jitter of 1e-13 of its diagonal, whose condition of 1e13 magnifies roundings of
/// 1e-16.
pub const TWINS: f64 = 1e-2;

/// For a gain of -0.9 over the range, found by a diagnosis that started at -0.82: noise of 2e-3 at
/// 12 000 samples of spread 0.35 leaves 5e-5. The rest is for the smoothed reference and the prior.
pub const GAIN_FOUND: f64 = 2e-3;

/// Seconds: a skew found by a diagnosis; a fifth of a sample of 10 ms.
pub const SKEW_FOUND_S: f64 = 2e-3;

/// Seconds: a time constant of 30 ms found by a diagnosis, a fifth of a sample of 10 ms.
pub const POLE_FOUND_S: f64 = 2e-3;

/// Relative to nominal: the inlet's flow found by a diagnosis, one sixth of its actual error of
/// 0.2.
pub const FLOW_FOUND: f64 = 0.03;

/// Relative to nominal: the muscle's time constant of 30 ms found by a diagnosis, a third of its
/// actual error of 0.3: 3 ms, a third of a sample.
pub const LAG_FOUND: f64 = 0.1;

/// Seconds: the time at which a recording resumes after a gap, on a grid of 10 ms with stamps up to
/// 4 ms late and one lost sample: five samples.
pub const RESUMED_S: f64 = 0.05;

/// Excess error of a correct model on 1800 test samples: three standard errors, 3 sqrt(2/1800).
pub const GAP_NULL: f64 = 0.1;

/// Relative: errors of two calibrations trained with two noise realisations on the same 18 s.
pub const TRAINED_AGAIN: f64 = 0.1;

/// Relative: a mean square of 20 000 samples, or a spread from the median of as many second
/// differences, each of three neighbours: four standard errors.
pub const MEDIAN_SPREAD: f64 = 0.04;

/// Excess error of a slice of 2500 samples whose mean square is 9: five standard errors, 9
/// sqrt(2/2500).
pub const SLICE_EXCESS: f64 = 1.3;

/// Relative norm: coefficients of a fit on data of condition up to about a thousand.
pub const FIT_WELL: f64 = 1e-12;

/// Relative norm: coefficients of a fit on raw volts of condition up to 1.3e8. Rounding of 1e-16
/// may be magnified by the condition, to 1e-8. The roundings of 240 rows are independent, so the
/// error stays well below that; with normal equations (condition squared) it would be far above.
pub const FIT_ILL: f64 = 1e-9;

/// Share of `|A| |c|` and of the condition times the residual: rounding of reflections over 300
/// rows with up to 21 terms. If all 6000 roundings of 1e-16 had the same sign, it would be 1e-12;
/// as a random walk they grow with the square root of their number.
pub const FIT_BACKWARD: f64 = 1e-14;

/// Relative: SSE, R^2 and RMSE, whose residuals lose at most six digits to the values.
pub const FIT_STATISTICS: f64 = 1e-9;

/// Relative: Student and Fisher quantiles by bisection of an incomplete beta function.
pub const FIT_QUANTILE: f64 = 1e-12;

/// Relative: a condition number estimated from below by a dozen power iterations.
pub const FIT_CONDITION: f64 = 0.1;

/// Relative norm: the bisquare stops once no coefficient moves by 1.5e-8 of its size.
pub const FIT_BISQUARE: f64 = 1e-7;

/// Relative: excess of the sum of absolute residuals over the linear program's optimum. Reasons are
/// a smoothing of a millionth of the scale at each of seven interpolated samples, and slow
/// convergence.
pub const FIT_LEAST_ABSOLUTE: f64 = 1e-6;

/// Relative norm: compared with the bisquare of statsmodels, whose scale is the plain MAD without
/// leverage.
pub const FIT_OTHER_SCALE: f64 = 1e-2;

/// Relative norm: as [`FIT_ILL`] over 1e5 samples, whose roundings average out. Orthogonal methods
/// reach this, and normal equations miss it by nine orders of magnitude.
pub const FIT_ILL_LONG: f64 = 1e-10;

/// Relative norm: `f32` coefficients and surface. A rounding of 6e-8 times up to a thousand, with
/// volts that are normalised or centred.
pub const FIT_F32: f64 = 1e-4;

/// Share of k_max: the static law of the muscle tabulated by cubics at 128 knots for each reference
/// pressure. Interpolation leaves h^4/384 of a fourth derivative of about 100.
pub const STATIC_LAW: f64 = 1e-8;

/// Share of a channel's full scale: two implementations of the rig with different integration steps
/// (the reference's own step leaves 1.5e-6, ours at most [`RIG_STEP`]).
pub const RIG_CONFORMANCE: f64 = 2e-3;

/// Share of a channel's full scale: the change if the integration step is halved.
pub const RIG_STEP: f64 = 1e-4;

/// In units of the noise: deviation of a fit of least absolute residuals from the truth at the edge
/// of the rectangle, where few samples determine it, if a fifth of all samples are corrupted.
pub const FIT_GROSS_ERRORS: f64 = 20.0;

/// Millimetres between receptors with memory in `f32` and in `f64`: states near 1 with 24 bits, up
/// to 35 terms of coefficients up to 2, a stroke of 30 mm.
pub const REMEMBERING_F32_MM: f64 = 2e-2;

/// Millimetres of a 30 mm stroke: error of an observer on its own gauge without noise. Its motion
/// model has no acceleration, so it trails a sine of 0.6 Hz by about
/// `acceleration * settling time^2`.
pub const OBSERVER_INVERTS_MM: f64 = 0.5;

/// Share of the stroke by which an observer in integers may differ from one in `f64`: states with a
/// resolution of 2^-26 of the stroke and gains of 20 bits, a curve up to ten times flatter than its
/// mean slope, and a filter that sums over hundreds of samples.
pub const FIXED_OBSERVER: f64 = 1e-4;

/// Relative: time constant and amplitude of an observer on its own gauge. The golden-section search
/// stops at a few per cent of the time constant, and the amplitude compensates the difference.
pub const OBSERVER_SEARCHED: f64 = 0.1;

/// Relative: the error of a history model when running, compared with that of its fit. The fit
/// divides by the degrees of freedom (126 of 9000) and leaves out the first samples.
pub const HISTORY_LIVE: f64 = 0.05;

/// Relative: errors of two calibrations, one of them trained on simulated trials that have the
/// length of the measured ones but other commands: one and a half times [`TRAINED_AGAIN`].
pub const TRAINED_APART: f64 = 0.15;

/// In units of a signal up to 25: a smoother may round a corner of slope 1 by a tenth of a sample's
/// step.
pub const CORNER_KEPT: f64 = 0.1;

/// Share of k_max: the contraction at the reference pressure as printed in the literature, to four
/// decimals.
pub const K_MAX_DIGITS: f64 = 5e-5;

/// For a value near 1: printed tables with five decimals.
pub const TABLE_DIGITS: f64 = 1e-5;

/// Volts: a value interpolated linearly between samples at a time that is a whole sample up to
/// rounding of 1e-15 times the session's length, at slopes up to 1e2 V/s.
pub const SHIFTED_V: f64 = 1e-9;

/// Share of full scale: linear interpolation of a stage's input smooths its kinks.
pub const STAGE_ALONE: f64 = 2e-3;

/// Volts: the response in 6 s of an amplifier with a time constant of 1e12 s to up to 2 V: 1e-11,
/// and rounding.
pub const NEVER_FOLLOWS_V: f64 = 1e-6;

/// Millimetres: remaining motion of a length at the end of a move that settled for seconds.
pub const BEHIND_MM: f64 = 1e-6;

/// In codes: values that are whole codes up to rounding to seven printed digits.
pub const WHOLE_CODE: f64 = 1e-3;

/// Micrometres: half a step of 3.3 V/65536 at up to three taps of 0.12 per sample, at 100 Hz and
/// about 1.1 mm for 1 V/s, in addition to the stated error: 0.9 + 0.6.
pub const CODE_STEP_UM: f64 = 1.5;

/// Millimetres of a 30 mm stroke: error after a baseline drift of 0.1 V and a rest of 15 s, in
/// which the baseline is found again.
pub const REST_FOUND_MM: f64 = 0.5;

/// Relative standard deviation, and correlation, of 200 000 coloured samples with heavy tails,
/// equivalent to about 20 000 independent ones: 0.5 %, doubled for the tails, and five times that.
pub const BLIND_NOISE: f64 = 0.05;

/// Relative: the standard deviation of a slow drift of 5 s over 40 000 s, equivalent to 4000
/// independent samples: 1.1 %, up to twice that for a cascade of several lags, and four to five
/// times that.
pub const BLIND_SUPPLY: f64 = 0.1;

/// Relative: the share of 4000 missing rows in groups of four: 1000 independent groups, 3 %, five
/// times that.
pub const BLIND_ROWS: f64 = 0.15;

/// For curves of size near 1, through a table or a spline: at most some hundred roundings.
pub const BLIND_CURVE: f64 = 1e-12;

/// Relative: a slope from differences in a table of 240 intervals of values up to 2: 240 times one
/// or two roundings, and ten times that.
pub const BLIND_SLOPE: f64 = 1e-11;

/// For a law from 0 to 1: its start, which is the difference between a table's first knot and its
/// reference value.
pub const BLIND_LAW_START: f64 = 1e-9;

/// Relative: its end, where a table of 240 intervals is scaled to 1.
pub const BLIND_LAW_END: f64 = 1e-9;

/// Share of the reference pressure: a linear table of 4096 knots, h^2 x''/8.
pub const BLIND_LAW_TABLE: f64 = 1e-6;

/// For unknowns near 1: ten times the change of 1e-7 at which the descent stops.
pub const BOUNDED_SQUARES: f64 = 1e-6;

/// Seconds: a delay of 0.05 s computed as a sum over steps of 0.1 ms: two steps.
pub const BLIND_DELAY_S: f64 = 2e-4;

/// Seconds: as `BLIND_DELAY_S`, with a separate time constant for rising.
pub const BLIND_UNEVEN_S: f64 = 0.02;

/// Relative: the remaining step response of up to ten poles of 1 ns after 1 ms, 1e-6 each.
pub const BLIND_NO_FILTER: f64 = 1e-5;

/// Relative: inelastic part of a move of 1/20 000 of the reach of a hysteresis loop of any
/// family.
pub const BLIND_ELASTIC: f64 = 0.1;

/// Relative: inelastic part of a move of 1/2000 of the reach of a hysteresis loop of the written
/// forms.
pub const BLIND_LOOP_ELASTIC: f64 = 0.05;

/// Relative: the remaining transient of lags of 0.1 s after 20 s: exp(-200), and rounding.
pub const BLIND_SETTLED: f64 = 1e-9;

/// The remaining transient after 20 s of a relaxation whose slowest part is eight to ten times 0.1
/// s: exp(-20).
pub const BLIND_RELAXED: f64 = 1e-6;

/// Pascals of 620 kPa: the remaining pressure difference of a full chamber.
pub const BLIND_FULL_PA: f64 = 100.0;

/// Pascals of 28.8 kPa that choked filling adds in 10 ms: the first integration steps.
pub const BLIND_FILL_PA: f64 = 50.0;

/// Millimetres: rounding of the printed contraction, 5e-5 of 29 mm, and the effect of
/// [`BLIND_FULL_PA`].
pub const BLIND_LENGTH_MM: f64 = 0.01;

/// Volts of a trimmed bridge at rest: rounding, magnified by the amplifier.
pub const BLIND_TRIMMED_V: f64 = 1e-9;

/// Relative: the offset that a slip with hysteresis keeps after venting. Venting ends where the
/// curve is still slightly bent.
pub const BLIND_HYSTERESIS_STATE: f64 = 0.2;

/// Relative: the part of a draw-down by a steady load that remains after 40 s.
pub const BLIND_DRAWN: f64 = 0.01;

/// For an opening up to 1, far beyond a dead band: the end of its law, [`BLIND_LAW_END`].
pub const BLIND_BAND: f64 = 1e-9;

/// For an opening: the effect of a dead band of 1e-9, up to ten times its width.
pub const BLIND_BAND_OFF: f64 = 1e-8;

/// A planted term compared with the proposed one. Shapes are refined in steps of 5 %, and an error
/// of the width changes the coefficient by the same share.
pub const PLANTED_TERM: f64 = 0.08;
/// A coefficient fitted in other units. Factors that are no powers of two round every sample, and a
/// search with numerical derivatives stops at its step size.
pub const RESCALED: f64 = 1e-4;

/// Sums of ten thousand squares in another order, and a difference that is added back.
pub const TURNED: f64 = 1e-9;

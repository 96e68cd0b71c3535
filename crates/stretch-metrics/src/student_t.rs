//! Student's t distribution: two-tailed probabilities of any size, and critical values.
//!
//! P(|T| >= t) = I_x(v/2, 1/2) with x = v / (v + t^2), the regularised incomplete beta function. It is evaluated as a
//! continued fraction (Didonato and Morris, doi:10.1145/131766.131776) with Lentz's method. The fraction takes 1 - x as
//! a separate input, so that no digits are lost with a million degrees of freedom. The factor before the fraction is
//! computed as a logarithm, from log1p(t^2 / v) and from a ratio of gamma functions that is never a difference of two
//! large logarithms. Therefore [`ln_two_tailed`] is accurate even if P underflows.

use core::f64::consts::PI;

/// Returns P(|T| >= |t|) for `dof` degrees of freedom, 0..=1; NaN if `t` is NaN or `dof` is not above 0.
///
/// The relative error is about 1e-13. A result below about 1e-308 is a subnormal number or 0. [`ln_two_tailed`] has no
/// such limit.
///
/// ```
/// use stretch_metrics::student_t::two_tailed;
/// approx::assert_abs_diff_eq!(two_tailed(1.0, 1.0), 0.5, epsilon = 1e-15);
/// assert_eq!(two_tailed(0.0, 10.0), 1.0);
/// ```
pub fn two_tailed(t: f64, dof: f64) -> f64 {
    match tail(t, dof) {
        Tail::Ln(ln) => libm::exp(ln),
        Tail::Rest(rest) => 1.0 - rest,
    }
}

/// Returns the natural logarithm of [`two_tailed`], accurate even if P underflows.
///
/// ```
/// use stretch_metrics::student_t::ln_two_tailed;
/// // P is 10^-522.27 here.
/// let log10 = ln_two_tailed(100.0, 1000.0) / core::f64::consts::LN_10;
/// approx::assert_abs_diff_eq!(log10, -522.273_858_080_63, epsilon = 1e-10);
/// ```
pub fn ln_two_tailed(t: f64, dof: f64) -> f64 {
    match tail(t, dof) {
        Tail::Ln(ln) => ln,
        Tail::Rest(rest) => libm::log1p(-rest),
    }
}

/// Returns the t for which P(|T| >= t) = `p`: half the width of a two-sided confidence interval of level 1 - p, in
/// standard errors. Infinite if `p` is 0; NaN if `p` is outside 0..=1 or `dof` is not above 0.
///
/// ```
/// use stretch_metrics::student_t::critical;
/// approx::assert_abs_diff_eq!(critical(0.05, 1.0), 12.706204736174705, epsilon = 1e-11);
/// ```
pub fn critical(p: f64, dof: f64) -> f64 {
    if !(0.0..=1.0).contains(&p) || dof.is_nan() || dof <= 0.0 {
        return f64::NAN;
    }
    if p == 0.0 {
        return f64::INFINITY;
    }
    let ln_p = libm::log(p);
    let (mut low, mut high) = (0.0, 1.0);
    while ln_two_tailed(high, dof) > ln_p {
        (low, high) = (high, 2.0 * high);
        if high.is_infinite() {
            return high;
        }
    }
    // Bisection needs no derivative. It takes about 60 rounds, and more if t is close to 0.
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return middle;
        }
        if ln_two_tailed(middle, dof) > ln_p {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/// P(|T| >= t), in the form that is accurate.
enum Tail {
    /// ln P.
    Ln(f64),
    /// 1 - P.
    Rest(f64),
}

fn tail(t: f64, dof: f64) -> Tail {
    if t.is_nan() || dof.is_nan() || dof <= 0.0 {
        return Tail::Rest(f64::NAN);
    }
    if t.is_infinite() {
        return Tail::Ln(f64::NEG_INFINITY);
    }
    let t = t.abs();
    if dof.is_infinite() {
        return normal_tail(t);
    }
    let (a, b) = (dof / 2.0, 0.5);
    // u = t^2 / v, x = 1 / (1 + u), and y = 1 - x computed without a subtraction.
    let root = t / libm::sqrt(dof);
    let u = root * root;
    if u.is_infinite() {
        // P equals x^a / (a B(a, 1/2)) to far more digits than an f64 has.
        return Tail::Ln(-2.0 * a * libm::log(root) - libm::log(a) - ln_beta_half(a));
    }
    let (x, y) = (1.0 / (1.0 + u), u / (1.0 + u));
    let ln_u = 2.0 * libm::log(root);
    let ln_x = -libm::log1p(u);
    let ln_y = ln_u + ln_x;
    let ln_front = a * ln_x + b * ln_y - ln_beta_half(a);
    if x < (a + 1.0) / (a + b + 2.0) {
        Tail::Ln(ln_front + libm::log(fraction(a, b, x, y)))
    } else if t == 0.0 {
        Tail::Rest(0.0)
    } else {
        Tail::Rest(libm::exp(ln_front) * fraction(b, a, y, x))
    }
}

/// Returns the limit for infinitely many degrees of freedom: erfc(t / sqrt 2).
fn normal_tail(t: f64) -> Tail {
    if t < 20.0 {
        return Tail::Ln(libm::log(libm::erfc(t / core::f64::consts::SQRT_2)));
    }
    // Asymptotic series of Mills' ratio. At t = 20 the first omitted term is 8e-14.
    let w = 1.0 / (t * t);
    let series = 1.0 - w * (1.0 - w * (3.0 - w * (15.0 - w * (105.0 - w * (945.0 - w * 10395.0)))));
    Tail::Ln(-t * t / 2.0 - libm::log(t) + 0.5 * libm::log(2.0 / PI) + libm::log(series))
}

/// Returns ln B(a, 1/2) = ln(sqrt(pi) gamma(a) / gamma(a + 1/2)).
fn ln_beta_half(a: f64) -> f64 {
    // From a = 30 on, gamma(a + 1/2) / gamma(a) is computed by its asymptotic series (DLMF 5.11.13, as a logarithm).
    // Smaller a are first raised to 30 by the recurrence.
    let (mut a, mut ratio) = (a, 1.0);
    while a < 30.0 {
        ratio *= a / (a + 0.5);
        a += 1.0;
    }
    let w = 1.0 / (a * a);
    let series = (-1.0 / 8.0 + w * (1.0 / 192.0 + w * (-1.0 / 640.0 + w * (17.0 / 14336.0)))) / a;
    0.5 * libm::log(PI / a) - series - libm::log(ratio)
}

/// Returns the continued fraction by which the factor x^a y^b / B(a, b) of I_x(a, b) is multiplied, with y = 1 - x.
fn fraction(a: f64, b: f64, x: f64, y: f64) -> f64 {
    const TINY: f64 = 1e-300;
    // In practice some tens of rounds are enough.
    const ROUNDS: u32 = 20_000;
    let away = |x: f64| if x.abs() < TINY { TINY } else { x };
    // a - (a + b) x + 1, computed from the smaller of x and y so that no digits are lost.
    let lead = 1.0 + if x < y { a - (a + b) * x } else { (a + b) * y - b };
    let mut h = away(a * lead / (a + 1.0));
    let (mut c, mut d) = (h, 0.0);
    for n in 1..ROUNDS {
        let n = f64::from(n);
        let odd = a + 2.0 * n - 1.0;
        let w = n * (b - n) * x;
        let beta = (a + n - 1.0) / odd * ((a + b + n - 1.0) / odd) * w * x;
        let alpha = n + w / odd + (a + n) / (odd + 2.0) * (lead + n * (1.0 + y));
        d = 1.0 / away(alpha + beta * d);
        c = away(alpha + beta / c);
        h *= c * d;
        if (c * d - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    1.0 / h
}

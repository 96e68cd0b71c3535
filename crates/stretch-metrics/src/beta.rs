//! The incomplete beta function, from which the tails of Student's t and Fisher's F follow.

use core::f64::consts::PI;

/// A tail probability P, stored as ln P or as 1 - P, whichever is more accurate.
pub(crate) enum Tail {
    /// ln P.
    Ln(f64),
    /// 1 - P.
    Rest(f64),
}

impl Tail {
    /// Returns ln P.
    pub(crate) fn ln(self) -> f64 {
        match self {
            Self::Ln(ln) => ln,
            Self::Rest(rest) => libm::log1p(-rest),
        }
    }
}

/// Returns I_x(a, b) with x = 1 / (1 + root^2), the regularised incomplete beta function, for `root` of at least 0.
///
/// It is evaluated as a continued fraction (Didonato and Morris, doi:10.1145/131766.131776) with Lentz's method. The
/// fraction takes 1 - x as a separate input, so that no digits are lost with a million degrees of freedom. The factor
/// before the fraction is computed as a logarithm, so that it cannot underflow.
pub(crate) fn tail_at(root: f64, a: f64, b: f64, ln_beta: f64) -> Tail {
    if root.is_infinite() {
        return Tail::Ln(f64::NEG_INFINITY);
    }
    let u = root * root;
    let ln_u = 2.0 * libm::log(root);
    if u.is_infinite() {
        // I_x equals x^a / (a B(a, b)) to far more digits than an f64 has.
        return Tail::Ln(-a * ln_u - libm::log(a) - ln_beta);
    }
    // y = 1 - x, computed without a subtraction.
    let (x, y) = (1.0 / (1.0 + u), u / (1.0 + u));
    let ln_x = -libm::log1p(u);
    let ln_front = a * ln_x + b * (ln_u + ln_x) - ln_beta;
    if x < (a + 1.0) / (a + b + 2.0) {
        Tail::Ln(ln_front + libm::log(fraction(a, b, x, y)))
    } else if root == 0.0 {
        Tail::Rest(0.0)
    } else {
        Tail::Rest(libm::exp(ln_front) * fraction(b, a, y, x))
    }
}

/// Returns ln B(a, halves / 2), by the recurrence B(a, b + 1) = B(a, b) b / (a + b) from B(a, 1/2) or B(a, 1) = 1/a.
pub(crate) fn ln_beta(a: f64, halves: u16) -> f64 {
    let (mut b, mut ln) =
        if halves % 2 == 1 { (0.5, ln_beta_half(a)) } else { (1.0, -libm::log(a)) };
    while b < 0.5 * f64::from(halves) {
        ln += libm::log(b / (a + b));
        b += 1.0;
    }
    ln
}

/// Returns the x of at least 0 at which a tail that falls with x has the logarithm `ln_p`; infinite if there is none.
pub(crate) fn root(ln_tail: impl Fn(f64) -> f64, ln_p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while ln_tail(high) > ln_p {
        (low, high) = (high, 2.0 * high);
        if high.is_infinite() {
            return high;
        }
    }
    // Bisection takes some sixty rounds, and about 1,100 if the root is 0. It needs no derivative.
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return middle;
        }
        if ln_tail(middle) > ln_p {
            low = middle;
        } else {
            high = middle;
        }
    }
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

//! What the equations of the catalogue take for granted.

/// A sentence to stand below equations: what `mean_rev`, `play` and braces mean. `None` where no equation has one of them.
///
/// ```
/// use stretch_problem::notation;
/// assert_eq!(notation(["y = x + offset"]), None);
/// let words = notation(["y = x + offset", "y = mean_rev(x, tau_s)"]).expect("words");
/// assert!(words.contains("tau dy/dt = x - y"));
/// ```
pub fn notation<'a>(equations: impl IntoIterator<Item = &'a str>) -> Option<&'static str> {
    let needs = |equation: &str| equation.contains("play(") || equation.contains("mean_rev(");
    equations.into_iter().any(needs).then_some(
        "In equations y = mean_rev(x, tau) follows x with a time constant, tau dy/dt = x - y; y = play(x, w) stays until x is farther \
         off than w, then follows at that distance; with {a, b, c} there are three of them, whose mean is taken.",
    )
}

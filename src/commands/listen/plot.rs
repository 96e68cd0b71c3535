//! A curve in letters: eight dots each, two across and four down (Unicode's Braille patterns).

/// The bits of a letter's dots, by column and row.
const DOTS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// Draws straight lines from point to point into so many columns and rows of letters, a text a row, the upper first. `x` and `y` are
/// what the plot spans; what lies beyond is not drawn.
pub(super) fn curve(
    points: &[(f64, f64)],
    [x, y]: [[f64; 2]; 2],
    (columns, rows): (usize, usize),
) -> Vec<String> {
    let mut letters = vec![0_u8; columns * rows];
    let (wide, high) = (2 * columns, 4 * rows);
    let place = |value: f64, [low, high]: [f64; 2], dots: usize| {
        (value - low) / (high - low).max(f64::MIN_POSITIVE) * (dots.max(1) - 1) as f64
    };
    let mut mark = |across: f64, up: f64| {
        let is_inside = |at: f64, dots: usize| (0.0..dots as f64).contains(&at);
        if is_inside(across.round(), wide) && is_inside(up.round(), high) {
            let (i, j) = (across.round() as usize, high - 1 - up.round() as usize);
            letters[j / 4 * columns + i / 2] |= DOTS[i % 2][j % 4];
        }
    };
    let mut last: Option<(f64, f64)> = None;
    for &(at, value) in points {
        let (across, up) = (place(at, x, wide), place(value, y, high));
        let from = last.replace((across, up)).unwrap_or((across, up));
        // a dot each step; no line is longer than the plot
        let steps = (across - from.0).abs().max((up - from.1).abs()).min((wide + high) as f64);
        for step in 0..=steps.ceil() as usize {
            let share = if steps > 0.0 { (step as f64 / steps).min(1.0) } else { 0.0 };
            mark(from.0 + share * (across - from.0), from.1 + share * (up - from.1));
        }
    }
    let letter = |bits: &u8| char::from_u32(0x2800 + u32::from(*bits)).unwrap_or(' ');
    let text = |bits: &u8| if *bits == 0 { ' ' } else { letter(bits) };
    letters.chunks(columns.max(1)).map(|row| row.iter().map(text).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::curve;

    #[test]
    fn a_diagonal_goes_from_corner_to_corner() {
        let drawn = curve(&[(0.0, 0.0), (1.0, 1.0)], [[0.0, 1.0], [0.0, 1.0]], (2, 1));
        assert_eq!(drawn, ["\u{2860}\u{280a}"]);
        let level = curve(&[(0.0, 5.0), (1.0, 5.0)], [[0.0, 1.0], [0.0, 10.0]], (3, 2));
        assert_eq!(level, ["\u{28c0}\u{28c0}\u{28c0}", "   "]);
        let odd = [(f64::NAN, 0.0), (0.5, f64::INFINITY), (9.0, 9.0)];
        assert_eq!(curve(&odd, [[0.0, 1.0], [0.0, 1.0]], (1, 1)), [" "]);
        assert!(curve(&odd, [[0.0, 0.0], [0.0, 0.0]], (0, 0)).is_empty());
    }
}

//! Whole numbers of a few bytes in either order.

/// The number of at most eight bytes.
pub(crate) fn word(bytes: &[u8], is_big: bool) -> u64 {
    let push = |word: u64, byte: &u8| word << 8 | u64::from(*byte);
    if is_big { bytes.iter().fold(0, push) } else { bytes.iter().rev().fold(0, push) }
}

/// The value of a word of so many bytes whose first bit is the sign.
pub(crate) fn signed(word: u64, bytes: usize) -> f64 {
    let unused = 64 - 8 * bytes as u32;
    (((word << unused) as i64) >> unused) as f64
}

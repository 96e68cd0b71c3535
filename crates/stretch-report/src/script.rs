//! The script of a page, and the policy under which no other script runs.

use sha2::{Digest, Sha256};

/// The script behind the figures.
const SCRIPT: &str = include_str!("report.js");

/// The whole text of the element, which is a CDATA section in XML and a program between comments in HTML.
pub(crate) fn text() -> String {
    format!("/*<![CDATA[*/\n{SCRIPT}/*]]>*/")
}

/// The script as an element.
pub(crate) fn element() -> String {
    format!("<script>{}</script>\n", text())
}

/// The content security policy of a page: the page may run the script with this digest and use its own style, and
/// nothing else.
pub(crate) fn policy() -> String {
    format!(
        "default-src 'none'; script-src {}; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'",
        digest(&text())
    )
}

/// The digest by which a policy names a script.
pub(crate) fn digest(text: &str) -> String {
    format!("'sha256-{}'", base64(&Sha256::digest(text.as_bytes())))
}

/// Base64 by RFC 4648, section 4.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::new();
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            match k <= chunk.len() {
                true => out.push(char::from(ALPHABET[(word >> (18 - 6 * k) & 63) as usize])),
                false => out.push('='),
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        let pairs =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")];
        for (plain, coded) in pairs {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn the_script_is_small_and_reaches_for_nothing() {
        assert!(SCRIPT.len() < 60_000, "{}", SCRIPT.len());
        for reach in [
            "fetch(",
            "XMLHttpRequest",
            "WebSocket",
            "import",
            "eval(",
            "innerHTML",
            "http",
            "]]>",
            "</",
        ] {
            assert!(!SCRIPT.contains(reach), "{reach}");
        }
    }
}

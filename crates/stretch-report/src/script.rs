//! The script of a page, and the policy under which no other script runs.

use base64::{Engine as _, engine::general_purpose::STANDARD};
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
    format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

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

//! Names and units may come from untrusted files. None of them may become code.

use stretch_effects::{EffectParameter, Extent, KINDS, Language, Quantity, Signals};

/// Names that are code in one of the languages, or hide code.
const HOSTILE: [&str; 14] = [
    "mm\nimport os; os.remove('x')",
    "mm\r\nint y;\rint z;",
    "deg*/ int y; /*",
    "/*/ int y; /*/",
    "mm\u{2028}import os",
    "\u{202e}mm\u{2066}x",
    "%{",
    "%}\nx = 1",
    "coding: utf_7 +AAo-import os",
    "-*- coding=utf_7 -*-",
    "\u{0}\u{7f}\u{1b}[2J",
    "mm\\",
    "\"\"\"'''",
    "\u{c}import os",
];

/// The code of every kind in a language, with the name in every place that accepts one.
fn codes(language: Language, name: &str) -> Vec<String> {
    let own = |symbol| Quantity {
        unit: name.to_owned().into(),
        meaning: name.to_owned().into(),
        ..Quantity::new(symbol, "", "")
    };
    let extent = Extent::between(0.0, 1.0);
    let code = |kind: &&stretch_effects::Kind| {
        let values: Vec<f64> =
            (kind.parameters)(&extent, "1").iter().map(EffectParameter::usual).collect();
        let signals = Signals { x: own("x"), beside: own("e"), load: own("load"), dt_s: 0.01 };
        let comments = [name.to_owned(), format!("{name}: of {name}")];
        let sketch = kind.sketch?(&values, &extent, &signals);
        Some(sketch.code(language, &Language::identifier(name), &comments))
    };
    KINDS.iter().filter_map(code).collect()
}

/// Code without its comments.
fn without_comments(language: Language, code: &str) -> String {
    let (mut kept, mut rest) = (String::new(), code);
    let (begin, end) = match language {
        Language::C => ("/*", "*/"),
        Language::Python => ("#", "\n"),
        Language::Matlab => ("%", "\n"),
    };
    while let Some((before, behind)) = rest.split_once(begin) {
        // `#include` occurs only in C, where comments begin with `/*`.
        let (before, behind) = (before.trim_end(), behind);
        kept += before;
        rest = behind.split_once(end).expect("a comment that ends").1;
        kept.push('\n');
    }
    let kept = kept + rest;
    kept.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
}

#[test]
fn no_name_becomes_code_in_any_language() {
    for language in Language::ALL {
        let expected = codes(language, "mm");
        assert!(expected.len() > 10, "{}", expected.len());
        for name in HOSTILE {
            let own = Language::identifier(name);
            assert!(own.chars().all(|c| c.is_ascii_alphanumeric() || c == '_'), "{own}");
            for (code, expected) in codes(language, name).iter().zip(&expected) {
                let (found, expected) =
                    (without_comments(language, code), without_comments(language, expected));
                // The function has another name.
                let expected = expected.replace("mm", &own);
                assert_eq!(found, expected, "{name:?} in {}:\n{code}", language.name());
                let is_seen = |c: char| c == '\n' || !stretch_core::label::is_hidden(c);
                assert!(code.chars().all(is_seen), "{name:?}:\n{code}");
                let is_coding = |line: &str| line.contains("coding:") || line.contains("coding=");
                assert!(language != Language::Python || !code.lines().take(2).any(is_coding));
            }
        }
    }
}

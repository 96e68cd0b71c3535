//! Packs the page into one file: HTML, style, scripts, and compressed WASM.
//!
//! `stretch-pack PAGE.wasm SOURCES OUT` writes `OUT/index.html` from `SOURCES/index.html`, whose
//! lines `<!-- style FILE -->`, `<!-- script FILE ... -->`, `<!-- worker FILE ... -->`, `<!-- wasm
//! -->` and `POLICY` it replaces. The content policy lists the digests of the scripts that a browser
//! may run: the scripts of the page, and the script of the reports, because the page shows reports.

use std::{env, error::Error, fs, io::Write, path::Path};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use flate2::{Compression, write::GzEncoder};
use wasm_bindgen_cli_support::Bindgen;

// the reports and the page share the code that writes content policies
#[path = "../../../crates/stretch-report/src/script.rs"]
#[allow(dead_code)]
mod script;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [wasm, sources, out] = arguments.as_slice() else {
        return Err("stretch-pack PAGE.wasm SOURCES OUT".into());
    };
    let (sources, out) = (Path::new(sources), Path::new(out));
    fs::create_dir_all(out)?;
    let glue = Glue::of(Path::new(wasm), out)?;
    let template = fs::read_to_string(sources.join("index.html"))?;
    let (mut html, mut digests) = (String::new(), vec![script::digest(&script::text())]);
    for line in template.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["<!--", "style", files @ .., "-->"] => {
                html += &format!("<style>\n{}</style>\n", joined(sources, files)?);
            }
            ["<!--", "script", files @ .., "-->"] => {
                let text = joined(sources, files)?;
                digests.push(script::digest(&text));
                html += &format!("<script>{text}</script>\n");
            }
            ["<!--", "worker", files @ .., "-->"] => {
                let text = glue.js.clone() + &joined(sources, files)?;
                html += &format!("<script type=\"text/plain\" id=\"worker\">{text}</script>\n");
            }
            ["<!--", "wasm", "-->"] => {
                let packed = STANDARD.encode(gzip(&glue.wasm)?);
                html +=
                    &format!("<script type=\"application/gzip\" id=\"wasm\">{packed}</script>\n");
            }
            _ => html += &format!("{line}\n"),
        }
    }
    let html = html.replace("POLICY", &policy(&digests));
    fs::write(out.join("index.html"), &html)?;
    println!(
        "{} bytes: index.html; {} compressed; {} of WASM in it",
        html.len(),
        gzip(html.as_bytes())?.len(),
        glue.wasm.len()
    );
    Ok(())
}

/// Returns the content policy. It allows the scripts with these digests, WASM, and workers created
/// from the text of the page, and forbids everything else, including requests.
fn policy(digests: &[String]) -> String {
    format!(
        "default-src 'none'; script-src {} 'wasm-unsafe-eval'; style-src 'unsafe-inline'; worker-src blob:; frame-src blob:; \
         base-uri 'none'; form-action 'none'",
        digests.join(" ")
    )
}

/// The WASM module, and the JavaScript that wasm-bindgen generates for it.
struct Glue {
    js: String,
    wasm: Vec<u8>,
}

impl Glue {
    fn of(wasm: &Path, out: &Path) -> Outcome<Self> {
        let folder = out.join("glue");
        let mut bindgen = Bindgen::new();
        bindgen.input_path(wasm).no_modules(true)?.typescript(false).out_name("page");
        bindgen.remove_name_section(true).remove_producers_section(true);
        bindgen.generate(&folder)?;
        let js = fs::read_to_string(folder.join("page.js"))?;
        let wasm = fs::read(folder.join("page_bg.wasm"))?;
        fs::remove_dir_all(folder)?;
        Ok(Self { js: checked(js)?, wasm })
    }
}

/// Concatenates files.
fn joined(sources: &Path, files: &[&str]) -> Outcome<String> {
    let mut text = String::new();
    for file in files {
        text += &fs::read_to_string(sources.join(file)).map_err(|e| format!("{file}: {e}"))?;
    }
    checked(text)
}

/// Checks that a text can be the content of an element.
fn checked(text: String) -> Outcome<String> {
    match text.contains("</script") || text.contains("<!--") {
        true => Err("a script holds what ends an element".into()),
        false => Ok(text),
    }
}

fn gzip(bytes: &[u8]) -> Outcome<Vec<u8>> {
    let mut out = GzEncoder::new(Vec::new(), Compression::best());
    out.write_all(bytes)?;
    Ok(out.finish()?)
}

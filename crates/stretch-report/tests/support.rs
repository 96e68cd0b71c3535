//! Reads pages as text, and compares them with snapshots.

use std::path::Path;

use testkit::{corpus::is_in_file, page::without_program};

/// Compares a text with a file of the folder `snapshots`.
#[track_caller]
pub(crate) fn is_snapshot(name: &str, text: &str) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    is_in_file(&folder.join(name), text);
}

/// The body of a page, without its drawings and their data.
fn body(page: &str) -> String {
    let page = without_program(page);
    let (_, rest) = page.split_once("<main>").expect("a body");
    let (body, _) = rest.rsplit_once("</main>").expect("a body that ends");
    ["svg", "script"].iter().fold(body.to_owned(), |body, name| without(&body, name))
}

fn without(html: &str, element: &str) -> String {
    let end = format!("</{element}>");
    let begin = format!("<{element}");
    let mut parts = html.split(&begin);
    let first = parts.next().unwrap_or_default().to_owned();
    let rest = parts.map(|part| part.split_once(&end).expect("an element that ends").1);
    first + &rest.collect::<String>()
}

/// Returns a section of a page as HTML, without its figures.
pub(crate) fn section(page: &str, heading: &str) -> String {
    let body = body(page);
    let (_, rest) = body.split_once(&format!("<h2>{heading}</h2>\n")).expect("a section");
    let (section, _) = rest.split_once("</section>").expect("a section that ends");
    format!("<h2>{heading}</h2>\n{section}")
}

/// Returns the text of a page before its first section, without the captions of figures.
pub(crate) fn first_seconds(page: &str) -> String {
    let body = body(page);
    let first = body.split_once("<section>").map_or(&*body, |(first, _)| first);
    text_of(&without(first, "figure"))
}

/// Returns the text of a page without its drawings. `#` begins a heading, `>` a folded part, and `|` separates the
/// cells of a table.
pub(crate) fn text(page: &str) -> String {
    text_of(&body(page))
}

fn text_of(html: &str) -> String {
    let mut out = String::new();
    for piece in html.split('<') {
        let Some((tag, words)) = piece.split_once('>') else { continue };
        out += match tag.split(' ').next().unwrap_or_default() {
            "h1" => "# ",
            "h2" => "\u{1}## ",
            "li" => "- ",
            "summary" => "> ",
            "th" | "td" => "| ",
            "/th" | "/td" => " ",
            "dd" => ": ",
            _ => "",
        };
        out += words;
    }
    let lines = out.lines().map(|line| unescaped(line.trim_end())).filter(|line| !line.is_empty());
    lines.map(|line| line.replace('\u{1}', "\n") + "\n").collect()
}

fn unescaped(text: &str) -> String {
    let entities = [
        ("\u{a0}", " "),
        ("&lt;", "<"),
        ("&gt;", ">"),
        ("&quot;", "\""),
        ("&#39;", "'"),
        ("&amp;", "&"),
    ];
    entities.iter().fold(text.to_owned(), |text, (entity, c)| text.replace(entity, c))
}

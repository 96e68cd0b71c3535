//! A minimal parser for Markdown pages: fenced blocks, links, tables between marks.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Returns the folder of the project.
pub(super) fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the README and every page of the book, by paths relative to the project's folder.
pub(super) fn pages() -> Vec<PathBuf> {
    let (mut found, mut folders) =
        (vec![PathBuf::from("README.md")], vec![root().join("book/src")]);
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).expect("the book") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "md") {
                found.push(path.strip_prefix(root()).expect("a page below").to_owned());
            }
        }
    }
    found.sort();
    found
}

/// Returns the READMEs of the crates, which are the first pages of their documentation.
pub(super) fn crate_pages() -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join("crates")).expect("the crates");
    let page = |entry: fs::DirEntry| Path::new("crates").join(entry.file_name()).join("README.md");
    let mut found: Vec<PathBuf> = entries.map(|entry| page(entry.expect("an entry"))).collect();
    found.sort();
    found
}

pub(super) fn read(page: &Path) -> String {
    fs::read_to_string(root().join(page)).unwrap_or_else(|e| panic!("{}: {e}", page.display()))
}

/// A fenced block.
#[derive(Debug, PartialEq)]
pub(super) struct Block<'a> {
    /// The language after the opening fence.
    pub(super) language: &'a str,
    pub(super) text: String,
    /// The file name, if the sentence above asks the reader to save the block.
    pub(super) file: Option<&'a str>,
}

/// Returns the fenced blocks of a page. A block after a line that ends with "as `NAME`:" is the
/// text of that file.
pub(super) fn blocks(page: &str) -> Vec<Block<'_>> {
    let (mut found, mut lines, mut above) = (Vec::new(), page.lines(), "");
    while let Some(line) = lines.next() {
        if let Some(language) = line.strip_prefix("```") {
            let inside = lines.by_ref().take_while(|line| *line != "```");
            let text = inside.map(|line| format!("{line}\n")).collect();
            let saved = above.strip_suffix("`:").and_then(|text| text.rsplit_once("as `"));
            found.push(Block { language, text, file: saved.map(|(_, name)| name) });
        }
        if !line.is_empty() {
            above = line;
        }
    }
    found
}

/// Returns the targets of a page's links, except web addresses and places within the page.
pub(super) fn links(page: &str) -> Vec<&str> {
    let targets = page.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    let outside = |target: &&str| !target.contains("://") && !target.starts_with('#');
    targets.filter(outside).map(|target| target.split('#').next().expect("a part")).collect()
}

#[test]
fn blocks_and_links_are_found() {
    let page = "Save it as `a.py`:\n\n```python\nx\n\ny\n```\n[a](b.md#c) and [d](https://e.f)\n```sh\nls\n```\n";
    let python = Block { language: "python", text: "x\n\ny\n".to_owned(), file: Some("a.py") };
    let shell = Block { language: "sh", text: "ls\n".to_owned(), file: None };
    assert_eq!(blocks(page), [python, shell]);
    assert_eq!(links(page), ["b.md"]);
}

//! The README and the book: what a reader types works in the order in which it stands there, links lead somewhere, and
//! figures are those of the files that the gate writes.

mod figures;
mod first_minutes;
mod markdown;
mod reference;
mod schema;
mod typed;

use std::{collections::BTreeSet, path::Path};

use markdown::{links, pages, read, root};

#[test]
fn links_of_readme_and_book_lead_somewhere() {
    for page in pages() {
        let folder = root().join(&page).parent().expect("a folder").to_owned();
        for target in links(&read(&page)) {
            assert!(folder.join(target).exists(), "{}: {target} is not there", page.display());
        }
    }
}

#[test]
fn the_summary_lists_every_page_of_the_book() {
    let summary = read(Path::new("book/src/SUMMARY.md"));
    let listed: BTreeSet<String> =
        links(&summary).iter().map(|to| format!("book/src/{to}")).collect();
    let there: BTreeSet<String> = pages()
        .iter()
        .map(|page| page.to_str().expect("a name").replace('\\', "/"))
        .filter(|name| name.starts_with("book/") && !name.ends_with("SUMMARY.md"))
        .collect();
    assert_eq!(listed, there);
}

#[test]
fn the_readme_stays_short() {
    let words = read(Path::new("README.md")).split_whitespace().count();
    assert!(words <= 1300, "{words} words: what more there is to say belongs into the book");
}

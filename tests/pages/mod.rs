//! Tests of the README and the book: the commands work in the order of each page, links have
//! targets, and figures equal those in the files that the gate writes.

mod figures;
mod files;
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
fn the_book_links_to_nothing_outside_of_it() {
    // The book is built separately, so links to other files of the repository would be broken
    // there.
    let book = root().join("book/src").canonicalize().expect("the book");
    for page in pages().iter().filter(|page| page.starts_with("book")) {
        let folder = root().join(page).parent().expect("a folder").to_owned();
        for target in links(&read(page)) {
            let to = folder.join(target).canonicalize().unwrap_or_default();
            assert!(to.starts_with(&book), "{}: {target} is no page of it", page.display());
        }
    }
}

/// Returns the numbers in an answer: "24 of 27" as it is, otherwise each number with the word next
/// to it.
fn figures(answer: &str) -> Vec<String> {
    let words: Vec<&str> =
        answer.split(' ').map(|word| word.trim_matches([',', ';', '(', ')'])).collect();
    let is_number =
        |at: usize| words.get(at).is_some_and(|word| word.contains(|c: char| c.is_ascii_digit()));
    let mut found = Vec::new();
    let mut at = 0;
    while at < words.len() {
        let is_share = is_number(at) && words.get(at + 1) == Some(&"of") && is_number(at + 2);
        let taken = if is_share { 3 } else { 1 };
        if is_number(at) {
            found.push(words[at..at + taken].join(" "));
        }
        at += taken;
    }
    found
}

#[test]
fn the_index_of_results_says_what_its_pages_say() {
    let index = read(Path::new("book/src/results/README.md"));
    let mut seen = 0;
    for row in index.lines().filter(|line| line.starts_with("| ") && line.contains("](")) {
        let answer = row.split(" | ").nth(1).expect("an answer");
        let page = links(row)[0].to_owned();
        let text = read(&Path::new("book/src/results").join(&page));
        for figure in figures(answer) {
            seen += 1;
            assert!(text.contains(&figure), "{page} does not say {figure}: {answer}");
        }
    }
    assert!(seen > 5, "{seen} figures");
    assert_eq!(figures("24 of 27, no name on 22 (0.5 of it)"), ["24 of 27", "22", "0.5"]);
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
    assert!(words <= 1000, "{words} words: what more there is to say belongs into the book");
}

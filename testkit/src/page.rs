//! Prepares report pages for comparisons in tests.

/// Removes the text of a page's script, which is a CDATA section in XML. The script is the same for
/// all data; the rest of the page depends on the data.
///
/// # Panics
///
/// If the CDATA section does not end.
pub fn without_program(page: &str) -> String {
    let Some((before, rest)) = page.split_once("/*<![CDATA[*/") else { return page.to_owned() };
    let (_, after) = rest.split_once("/*]]>*/").expect("the section ends");
    before.to_owned() + after
}

//! Report pages in tests.

/// Removes the text of a page's script, which is a CDATA section in XML. The rest depends on the
/// data.
///
/// # Panics
///
/// If the section does not end.
pub fn without_program(page: &str) -> String {
    let Some((before, rest)) = page.split_once("/*<![CDATA[*/") else { return page.to_owned() };
    let (_, after) = rest.split_once("/*]]>*/").expect("the section ends");
    before.to_owned() + after
}

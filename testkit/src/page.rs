//! Pages of reports, as tests read them.

/// A page without the text of its script, which is a section of characters to XML: what is left was written of the data.
///
/// # Panics
///
/// Where the section does not end.
pub fn without_program(page: &str) -> String {
    let Some((before, rest)) = page.split_once("/*<![CDATA[*/") else { return page.to_owned() };
    let (_, after) = rest.split_once("/*]]>*/").expect("the section ends");
    before.to_owned() + after
}

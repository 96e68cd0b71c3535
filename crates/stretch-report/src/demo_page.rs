//! The report of a demonstration: a calibration, and the diagnosis of the difference between simulator and rig.

use stretch_data::listed;

use super::{
    calibration_page::{Judged, calibration_sections, calibration_verdict},
    diagnosis_page::{diagnosis_sections, diagnosis_title},
    first_seconds::diagnosis_verdict,
    page::Page,
    subject::Subject,
    words::in_words,
};

/// What the diagnosis names, for the top of the page: the rest stands where its part begins.
fn headline(subject: &Subject<'_>) -> String {
    match subject.diagnosis.named.as_slice() {
        [] => diagnosis_verdict(subject),
        named => format!("The simulator lacks {}.", listed(named)),
    }
}

/// Both reports as one HTML file; each part has the content of its own page.
pub fn demo_page(judged: &Judged<'_>, subject: &Subject<'_>) -> String {
    let worded = in_words(subject.diagnosis);
    let subject = &Subject { diagnosis: &worded, ..*subject };
    let both = format!("{} {}", calibration_verdict(judged), headline(subject));
    let mut page = Page::new(&judged.context.title, &both);
    calibration_sections(&mut page, judged);
    page.part(&diagnosis_title(subject), &diagnosis_verdict(subject));
    diagnosis_sections(&mut page, subject);
    page.finish()
}

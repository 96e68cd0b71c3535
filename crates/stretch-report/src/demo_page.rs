//! The report of a demonstration: a calibration, and the diagnosis of the difference between simulator and rig.

use stretch_problem::in_words;

use super::{
    calibration_page::{Judged, calibration_sections, calibration_verdict},
    diagnosis_page::{diagnosis_sections, diagnosis_title},
    first_seconds::headline,
    page::Page,
    subject::Subject,
};

/// Where the second part begins.
const DIAGNOSIS: &str = "diagnosis";

/// Both reports as one HTML file; each part has the content of its own page.
pub fn demo_page(judged: &Judged<'_>, subject: &Subject<'_>) -> String {
    let worded = in_words(subject.diagnosis);
    let subject = &Subject { diagnosis: &worded, ..*subject };
    let both = format!("{} {}", calibration_verdict(judged), headline(subject));
    let mut page = Page::new(&judged.context.title, &both);
    page.jump(DIAGNOSIS, "Go to the diagnosis");
    calibration_sections(&mut page, judged);
    page.part(DIAGNOSIS, &diagnosis_title(subject), &headline(subject));
    diagnosis_sections(&mut page, subject);
    page.finish()
}

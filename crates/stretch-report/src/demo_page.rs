//! The report of a demonstration: a calibration, and the diagnosis of the difference between simulator and rig.

use super::{
    calibration_page::{Judged, calibration_sections, calibration_verdict},
    diagnosis_page::{diagnosis_sections, diagnosis_title},
    first_seconds::diagnosis_verdict,
    page::Page,
    subject::Subject,
};

/// Both reports as one HTML file; each part has the content of its own page.
pub fn demo_page(judged: &Judged<'_>, subject: &Subject<'_>) -> String {
    let mut page = Page::new(&judged.context.title, &calibration_verdict(judged));
    calibration_sections(&mut page, judged);
    page.part(&diagnosis_title(subject), &diagnosis_verdict(subject));
    diagnosis_sections(&mut page, subject);
    page.finish()
}

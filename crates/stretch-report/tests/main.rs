//! Compares reports with snapshots. `SNAPSHOTS=overwrite cargo test -p stretch-report --test it` writes the
//! snapshots again.

mod calibrations;
mod diagnoses;
mod support;

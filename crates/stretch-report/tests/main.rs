//! Snapshots of reports, one program: `SNAPSHOTS=overwrite cargo test -p stretch-report --test it` writes them anew.

mod calibrations;
mod diagnoses;
mod support;

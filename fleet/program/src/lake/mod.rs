//! A lake: folders of Parquet files, one per trial, and their common properties.
//!
//! ```text
//! DIR/lake.json                                                    signal, reference, rate estimator, sample rate
//! DIR/trials/site=S/rig=R/sensor=N/date=YYYY-MM-DD/<digest>.parquet  one trial, sorted by time
//! DIR/states/poly13/site=S/rig=R/<YYYY-MM>.parquet                 partial fits, a row a sensor and day
//! DIR/refused/                                                     a sentence for each file that is not in the lake
//! DIR/.stretch-lock                                                locked by the command that writes
//! ```

mod about;
mod aside;
mod footer;
#[cfg(test)]
mod hostile;
mod open;
mod place;
mod table;
mod write;

pub(crate) use about::About;
pub(crate) use aside::{Refused, accept, refuse, set_aside};
pub(crate) use footer::{Footer, digest, digest_of_file};
pub(crate) use open::{Lake, LakeFile, below, files, metadata};
pub(crate) use place::{Place, check_name};
pub(crate) use table::{register, register_folder};
pub(crate) use write::{Samples, write, write_parquet};

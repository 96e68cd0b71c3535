//! A lake: folders of Parquet files, a file a trial, and what they have in common.
//!
//! ```text
//! DIR/lake.json                                                    signal, reference, rate estimator, sample rate
//! DIR/trials/site=S/rig=R/sensor=N/date=YYYY-MM-DD/<digest>.parquet  one trial, sorted by time
//! DIR/states/poly13/site=S/rig=R/<YYYY-MM>.parquet                 partial fits, a row a sensor and day
//! DIR/refused/                                                     a sentence for each file that is not in the lake
//! ```

mod about;
mod aside;
mod footer;
mod open;
mod place;
mod table;
mod write;

pub(crate) use about::About;
pub(crate) use aside::{Refused, accept, refuse};
pub(crate) use footer::{Footer, digest};
pub(crate) use open::{Lake, LakeFile, files};
pub(crate) use place::Place;
pub(crate) use table::{register, register_folder};
pub(crate) use write::{Samples, write, write_parquet};

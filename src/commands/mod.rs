//! One file a subcommand, and what they share.

pub(crate) mod apply;
pub(crate) mod blind;
mod blind_answers;
mod blind_room;
mod blind_score;
pub(crate) mod calibrate;
mod causes;
pub(crate) mod convert;
pub(crate) mod demo;
pub(crate) mod diagnose;
mod diagnosis_files;
mod diagnosis_text;
pub(crate) mod effects;
pub(crate) mod evaluate;
pub(crate) mod export;
pub(crate) mod init;
pub(crate) mod listen;
mod long;
pub(crate) mod paper;
mod problem;
mod rails;
mod reading;
pub(crate) mod record;
pub(crate) mod rig;
pub(crate) mod shared;
pub(crate) mod simulate;
pub(crate) mod stop;

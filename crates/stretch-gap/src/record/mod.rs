//! Errors of the record and of the rig file: hypotheses like the effects, and commoner than they are.

pub(crate) mod column;
pub(crate) mod examine;
pub(crate) mod fault;
pub(crate) mod plain;
pub(crate) mod screen;
pub(crate) mod suspect;
pub(crate) mod told;
pub(crate) mod weigh;

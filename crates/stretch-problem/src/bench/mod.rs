//! Parts that a whole rig and a gauge alone share: reading and cleaning of recordings, and effects
//! of the catalogue.

pub(crate) mod acting;
pub(crate) mod courses;
pub(crate) mod isolated_outliers;
pub(crate) mod rig_file;
pub(crate) mod shortened;
pub(crate) mod specs;
pub(crate) mod trials;
pub(crate) mod undetermined;

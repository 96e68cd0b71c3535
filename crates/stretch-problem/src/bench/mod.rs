//! What a whole rig and a gauge alone share: how records are read and cleaned, and how effects of the catalogue act.

pub(crate) mod acting;
pub(crate) mod courses;
pub(crate) mod kept;
pub(crate) mod lost;
pub(crate) mod rig_file;
pub(crate) mod specs;
pub(crate) mod wild;

//! Sets that strangers solve: makes folders of cases and sealed labels from a plant and a seed.
//!
//! `servo` and `thermal` are two plants of two stages; `plant` integrates them with `operators` around; `family` draws the forms of
//! effects, `excess` says how visible one is, `draw` makes a case, `make` writes a set, `rig` gives the rig's cases the same layout,
//! `written` puts files down.
mod draw;
mod excess;
mod family;
mod label;
mod make;
mod operators;
mod plant;
mod rig;
mod servo;
mod thermal;
mod written;
pub use family::{Form, FormFamily};
pub use label::{Level, OpenLabel, OpenTruth, sealed_beside};
pub use make::{PlantName, make_set, make_set_apart};

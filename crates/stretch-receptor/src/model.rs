//! The models behind the receptors, and the memory that each keeps between samples.
//!
//! A receptor is a [`Front`](crate::Front) around one of these. Their names are needed to write down the type of a
//! receptor or of its memory; their numbers serve an implementation of a step in another language.

pub use crate::{
    diagnosed::{Diagnosed, DiagnosedMemory},
    front::{Live, Side},
    history::{History, HistoryMemory},
    observer::{Observer, ObserverMemory},
    one::{AnyMemory, AnyModel},
    receptor::{Surfaces, SurfacesMemory},
};

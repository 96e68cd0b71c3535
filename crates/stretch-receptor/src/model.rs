//! The models behind the receptors, and the memory that each keeps between samples.
//!
//! Each receptor is a [`Front`](crate::Front) around one of these models. The names of the models are needed to write
//! down the type of a receptor or of its memory. To implement a step in another language, use the numbers in the fields
//! of the models.

pub use crate::{
    diagnosed::{Diagnosed, DiagnosedMemory},
    front::{Live, Side},
    history::{History, HistoryMemory},
    observer::{Observer, ObserverMemory},
    one::{AnyMemory, AnyModel},
    receptor::{Surfaces, SurfacesMemory},
};

//! A rig that is not as shipped.

use stretch_sim::{Key, RigParams};

/// A rig within its tolerances but not as shipped.
pub(crate) fn own_rig() -> RigParams {
    let mut params = RigParams::default();
    params[Key::CIn] *= 1.2;
    params[Key::KMax] *= 1.04;
    params[Key::TauM] *= 1.3;
    params[Key::VRef] += 0.015;
    params
}

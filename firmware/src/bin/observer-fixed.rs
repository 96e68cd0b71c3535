//! Converts converter codes to micrometres in integers, with the gauge's forward model that a
//! filter inverts.
#![no_std]
#![no_main]

use core::convert::identity;
use stretch_firmware::program;
use stretch_receptor::code::FixedObserver;

program!(
    codes, FixedObserver, identity,
    "observer-fixed" from "observer-fixed",
    "observer+rest-fixed" from "observer-rest-fixed",
);

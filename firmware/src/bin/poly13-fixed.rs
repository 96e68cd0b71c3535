//! Converts converter codes to micrometres with the surfaces of the published method, in fixed
//! point.
#![no_std]
#![no_main]

use stretch_firmware::program;
use stretch_receptor::code::FixedReceptor;

program!(codes, FixedReceptor<11, 2>, FixedReceptor::new, "poly13-fixed" from "poly13-fixed");

//! Converts converter codes to micrometres with a line, in fixed point.
#![no_std]
#![no_main]

use stretch_firmware::program;
use stretch_receptor::code::FixedReceptor;

program!(codes, FixedReceptor<11, 2>, FixedReceptor::new, "linear-fixed" from "linear-fixed");

//! Converts converter codes to millimetres with a line. The rate is computed in integers, the rest
//! in `f32`.
#![no_std]
#![no_main]

use stretch_firmware::program;
use stretch_receptor::code::CodeReceptor;

type Receptor = CodeReceptor<f32, 11, 2>;

program!(codes, Receptor, f32, Receptor::new, "linear-f32" from "linear-f32");

//! Converts converter codes to millimetres with the surfaces of the published method. The rate is
//! computed in integers, the rest in `f32`.
#![no_std]
#![no_main]

use stretch_firmware::program;
use stretch_receptor::code::CodeReceptor;

type Receptor = CodeReceptor<f32, 11, 2>;

program!(codes, Receptor, f32, Receptor::new, "poly13-f32" from "poly13-f32");

//! Prints a record's header: `header cal.json [fixed|float]`.

use std::{env, path::Path};

use stretch_calibrate::{parse_adc, read_calibration};
use stretch_export::{Options, header};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = env::args().collect();
    let [_, record, rest @ ..] = &arguments[..] else {
        return Err("name a calibration record".into());
    };
    let form = rest.first().map(|form| form.parse()).transpose()?;
    let calibration = read_calibration(Path::new(record))?;
    let header = header(&calibration, &Options { form, adc: parse_adc("12,0,3.3")? })?;
    print!("{}", header.text);
    Ok(())
}

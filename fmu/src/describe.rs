//! The interface of an FMU as the beginning of a problem file.

use std::fmt::Write;

use crate::{
    archive::Fmu,
    model::{Kind, Role, Variable},
};

/// Returns a first `problem.toml`: a stage for every output, driven by all inputs, and all
/// parameters, which are exact until a tolerance is given.
///
/// Columns have the names of the variables. The recordings have to be added by the user.
pub fn describe(fmu: &Fmu) -> String {
    let model = fmu.model();
    let with = |role: Role| {
        model.variables.iter().filter(move |v| v.role == role && !matches!(v.kind, Kind::Other(_)))
    };
    let unit =
        |v: &Variable| v.unit.as_ref().map(|u| format!("unit = {u:?}\n")).unwrap_or_default();
    let file = fmu.file().file_name().unwrap_or_default().to_string_lossy().into_owned();
    let inputs: Vec<&str> = with(Role::Input).map(|v| v.name.as_str()).collect();
    let mut out = format!("# {}, FMI {}\n", model.name.replace('\n', " "), model.version.number());
    let mut add = |text: std::fmt::Arguments<'_>| {
        // Writing to a string cannot fail.
        let _ = out.write_fmt(text);
    };
    add(format_args!("[simulator]\nfmu = {file:?}\n"));
    add(format_args!(
        "# [simulator.variables]  # where names differ: name in this file = \"variable\"\n"
    ));
    for v in with(Role::Output) {
        let name = &v.name;
        add(format_args!(
            "\n[[stage]]\nname = {name:?}\noutput = {name:?}\n{}inputs = {inputs:?}\n",
            unit(v)
        ));
    }
    for v in with(Role::Input).filter(|v| v.unit.is_some()) {
        add(format_args!("\n[[input]]\ncolumn = {:?}\n{}", v.name, unit(v)));
    }
    for v in with(Role::Parameter) {
        let start = v.start.map_or("0.0  # the FMU does not say".into(), |x| format!("{x:?}"));
        add(format_args!(
            "\n[[parameter]]\nname = {:?}\n{}value = {start}\n# tolerance = \"10 %\"\n",
            v.name,
            unit(v)
        ));
    }
    add(format_args!("\n[[trial]]\nfile = \"recording.csv\"\n"));
    out
}

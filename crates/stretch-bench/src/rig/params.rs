//! Nominal parameters and tolerances from a rig file.

use stretch_data::RigFile;
use stretch_sim::{Key, PARAMETERS, RigParams, SimError};

use crate::error::BenchError;

/// Values, and one standard deviation of each, by index of the key.
pub(super) fn read_params(rig: Option<&RigFile>) -> Result<(RigParams, Vec<f64>), BenchError> {
    let mut params = RigParams::default();
    let mut given = vec![None; Key::COUNT];
    for (stage, table) in rig.iter().flat_map(|r| &r.stages) {
        for (name, parameter) in table {
            let Some(key) = Key::named(name) else {
                let names = PARAMETERS.iter().map(|p| p.name);
                return Err(SimError::UnknownParameter {
                    owner: stage.clone(),
                    name: name.clone(),
                    nearest: stretch_data::nearest(name, names).map(str::to_owned),
                }
                .into());
            };
            let info = key.info();
            if !(parameter.value > 0.0 || (info.zero_allowed && parameter.value == 0.0)) {
                return Err(SimError::BadParameter {
                    owner: stage.clone(),
                    name: name.clone(),
                    value: parameter.value,
                    needs: "positive",
                }
                .into());
            }
            params[key] = parameter.value;
            given[key as usize] = parameter
                .tolerance_abs
                .or(parameter.tolerance.map(|share| share * parameter.value.abs()));
        }
    }
    let tolerances = PARAMETERS
        .iter()
        .map(|p| given[p.key as usize].unwrap_or_else(|| p.tolerance.sd(params[p.key])))
        .collect();
    Ok((params, tolerances))
}

//! The file and the code of a gauge alone.

use stretch_data::{Remarks, RigFile};
use stretch_gap::Model;
use stretch_sim::{EffectSet, Gauge, GaugeRig, Grid, Surroundings};

use super::{GAIN, GaugeSimulator, OFFSET};
use crate::{
    bench::{Bench, BuiltIn},
    fix::{Chosen, NoFix},
};

/// Table of the file that holds offset and gain.
const TABLE: &str = "sensing";

impl BuiltIn for GaugeSimulator {
    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn surroundings<'a>(&self, _: &Model, grid: &'a Grid) -> Surroundings<'a> {
        Gauge::surroundings(&self.spec, grid)
    }

    fn line_unit(&self, model: &Model) -> f64 {
        model.parameters[GAIN]
    }

    fn file(
        &self,
        chosen: &Chosen<'_>,
        effects: EffectSet,
        remarks: &mut Remarks,
    ) -> Result<RigFile, NoFix> {
        let spec = self.tuned(chosen.model);
        let [offset, gain] = self.tolerances;
        let rig = GaugeRig {
            offset: chosen.tolerance(OFFSET, spec.offset, offset),
            gain: chosen.tolerance(GAIN, spec.gain, gain),
            spec,
            effects,
        };
        for (index, name, values) in [
            (OFFSET, "offset", (self.spec.offset, spec.offset)),
            (GAIN, "gain", (self.spec.gain, spec.gain)),
        ] {
            let remark =
                chosen.remark(index, &self.bench.about.spec().parameters[index].unit, values);
            remarks.parameters.insert((TABLE.into(), name.into()), remark);
        }
        let file = rig.to_file();
        GaugeRig::from_file(&file)?;
        Ok(file)
    }
}

//! The file and the code of a rig.

use stretch_data::{Remarks, RigFile};
use stretch_gap::Model;
use stretch_sim::{Effect, EffectParameter, EffectSet, Grid, Rig, Surroundings};

use super::{
    RigSimulator,
    nominal::{TunedParameter, TunedRig},
};
use crate::{
    bench::{Bench, BuiltIn},
    fix::{Chosen, NoFix},
};

impl BuiltIn for RigSimulator {
    fn bench(&self) -> &Bench {
        &self.bench
    }

    fn surroundings<'a>(&self, model: &Model, grid: &'a Grid) -> Surroundings<'a> {
        TunedRig::of(&self.base, &self.tuned, model).params.surroundings(grid)
    }

    fn line_unit(&self, _: &Model) -> f64 {
        1.0
    }

    fn within(effect: &Effect, values: &[f64]) -> Vec<f64> {
        let allowed = effect.parameters.iter().map(EffectParameter::allowed);
        allowed.zip(values).map(|(ends, x)| x.clamp(*ends.start(), *ends.end())).collect()
    }

    fn file(
        &self,
        chosen: &Chosen<'_>,
        effects: EffectSet,
        remarks: &mut Remarks,
    ) -> Result<RigFile, NoFix> {
        let mut rig = Rig { params: self.base, tolerances: self.tolerances, effects };
        let tuned = self.tuned.iter().zip(&chosen.model.parameters).enumerate();
        for (index, (parameter, value)) in tuned {
            let TunedParameter::Rig(key) = *parameter else { continue };
            let info = key.info();
            let old = rig.tolerances[key as usize];
            rig.tolerances[key as usize] = chosen.tolerance(index, *value, old);
            let remark = chosen.remark(index, info.unit, (self.base[key], *value));
            remarks.parameters.insert((info.stage.name().into(), info.name.into()), remark);
            rig.params[key] = *value;
        }
        let file = rig.to_file(None);
        // A file that could not be read again is refused here.
        Rig::from_file(&file)?;
        Ok(file)
    }
}

//! A simulator that stands before another one: what it leaves as it is.

/// Every method of [`Simulator`](crate::Simulator) that a simulator with a field `simulator` takes from that one, but for its description,
/// its runs and the lines of its effects.
macro_rules! as_is {
    () => {
        fn measured(&self, stage: usize) -> &[f64] {
            self.simulator.measured(stage)
        }

        fn is_lost(&self) -> &[bool] {
            self.simulator.is_lost()
        }

        fn wander_clock(&self, parameter: usize) -> Option<Vec<u32>> {
            self.simulator.wander_clock(parameter)
        }

        fn rows_used(&self) -> $crate::problem::rows_used::RowsUsed {
            self.simulator.rows_used()
        }

        fn is_costly(&self, effect: usize) -> bool {
            // Effects that were added behind its own cost what it costs.
            match effect < self.simulator.effects().len() {
                true => self.simulator.is_costly(effect),
                false => self.simulator.model_runs().is_some(),
            }
        }

        fn model_runs(&self) -> Option<$crate::problem::simulator::ModelRuns> {
            self.simulator.model_runs()
        }

        fn linearise(
            &self,
            stage: usize,
            model: &$crate::problem::simulator::Model,
            trials: usize,
        ) -> Result<(), GapError> {
            self.simulator.linearise(stage, model, trials)
        }

        fn motion(&self) -> $crate::problem::simulator::Motion<'_> {
            self.simulator.motion()
        }

        fn sensor(&self) -> Option<usize> {
            self.simulator.sensor()
        }

        fn foreign_share(&self) -> f64 {
            self.simulator.foreign_share()
        }

        fn input(&self, stage: usize) -> Option<Vec<f64>> {
            self.simulator.input(stage)
        }

        fn recorded(&self) -> Vec<$crate::problem::simulator::Recorded> {
            self.simulator.recorded()
        }

        fn columns(&self) -> Vec<$crate::problem::column::Column<'_>> {
            self.simulator.columns()
        }

        fn put_right(
            &self,
            column: &str,
            error: $crate::problem::column::Distortion,
        ) -> Result<Option<Box<dyn Simulator + Send + '_>>, GapError> {
            self.simulator.put_right(column, error)
        }
    };
}

pub(crate) use as_is;

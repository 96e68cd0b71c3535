//! An instance of an FMU, from instantiation to termination, for both versions of the standard.

use std::{
    cell::RefCell,
    mem,
    sync::{Arc, Mutex, PoisonError},
};

use fmi_rs::{
    fmi2::{self, CS, FMU2, types::fmi2Status},
    fmi3::{self, FMU3, native::NativeLibrary, types::fmi3Status},
    sim::SimulationError,
};

use crate::{
    archive::Fmu,
    deep::deep,
    error::FmuError,
    model::{Kind, Variable, Version},
};

/// Why a run was stopped early.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Stopped {
    /// The run cannot continue with these values; other values may work.
    Refused(String),
    /// The instance may not be called any more.
    Fatal(String),
}

/// Names of the statuses of a call by their numbers, which both versions of the standard share.
const STATUSES: [&str; 6] = ["ok", "warning", "discard", "error", "fatal", "pending"];

/// The last warning or error message of an FMU.
#[derive(Debug, Default)]
struct Said(Mutex<Option<String>>);

impl Said {
    fn hear(&self, is_wrong: bool, message: &str) {
        let message = message.trim();
        if is_wrong && !message.is_empty() {
            *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(message.to_owned());
        }
    }

    /// Returns the message as the end of a sentence, or an empty string if there is none.
    fn text(&self) -> String {
        let said = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        said.as_ref().map_or(String::new(), |said| format!("; its message: {said}"))
    }
}

impl fmi2::log::Logger for Said {
    fn log_call(&self, _: fmi2Status, _: &str) {}
    fn log_message(&self, status: fmi2Status, _: &str, message: &str) {
        self.hear(status != fmi2Status::Ok, message);
    }
}

impl fmi3::log::Logger for Said {
    fn log_call(&self, _: fmi3Status, _: &str) {}
    fn log_message(&self, status: fmi3Status, _: &str, message: &str) {
        self.hear(status != fmi3Status::Ok, message);
    }
}

/// Variables that are set or read together, grouped by the type of their numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Slots {
    count: usize,
    doubles: Group,
    singles: Group,
}

/// Value references, and the index of the value for each of them.
#[derive(Debug, Clone, PartialEq, Default)]
struct Group {
    references: Vec<u32>,
    at: Vec<usize>,
}

impl Slots {
    pub(crate) fn push(&mut self, variable: &Variable) {
        let group = match variable.kind {
            Kind::Single => &mut self.singles,
            _ => &mut self.doubles,
        };
        group.references.push(variable.reference);
        group.at.push(self.count);
        self.count += 1;
    }

    pub(crate) fn len(&self) -> usize {
        self.count
    }
}

impl Group {
    fn is_empty(&self) -> bool {
        self.at.is_empty()
    }

    fn picked(&self, values: &[f64]) -> Vec<f64> {
        self.at.iter().map(|&at| values[at]).collect()
    }

    fn put<T: Into<f64>>(&self, from: Vec<T>, values: &mut [f64]) {
        self.at.iter().zip(from).for_each(|(&at, x)| values[at] = x.into());
    }
}

enum Native {
    Two(Arc<FMU2<CS>>),
    Three(Arc<FMU3>),
}

/// An instance. It is freed on drop, except after a fatal error, because FMI forbids any further
/// call then.
pub(crate) struct Instance {
    native: Option<Native>,
    said: Arc<Said>,
}

impl Instance {
    pub(crate) fn new(fmu: &Fmu) -> Result<Self, FmuError> {
        let (said, model) = (Arc::new(Said::default()), fmu.model());
        let native = match model.version {
            Version::Fmi2 => deep(|| {
                FMU2::<CS>::new(
                    fmu.folder(),
                    &model.identifier,
                    "stretch",
                    &model.token,
                    false,
                    false,
                    false,
                    said.clone(),
                    model.takes_allocator,
                )
            })
            .unwrap_or(Err(SimulationError::FMICall))
            .map(Native::Two),
            Version::Fmi3 => NativeLibrary::load(fmu.library()).and_then(|library| {
                let resources = Some(fmu.folder().join("resources")).filter(|path| path.is_dir());
                let (token, implementation) = (&model.token, Box::new(library));
                FMU3::instantiateCoSimulation(
                    implementation,
                    resources.as_deref(),
                    "stretch",
                    token,
                    false,
                    false,
                    false,
                    false,
                    said.clone(),
                    false,
                    None,
                )
                .map(Native::Three)
            }),
        };
        match native {
            Ok(native) => Ok(Self { native: Some(native), said }),
            Err(error) => Err(not_made(fmu, error, &said)),
        }
    }

    /// Calls the library by one of two functions, depending on the version.
    fn call(
        &mut self,
        name: &str,
        two: impl FnOnce(&FMU2<CS>) -> fmi2Status,
        three: impl FnOnce(&FMU3) -> fmi3Status,
    ) -> Result<(), Stopped> {
        let status = match &self.native {
            Some(Native::Two(fmu)) => two(fmu) as usize,
            Some(Native::Three(fmu)) => three(fmu) as usize,
            None => 0,
        };
        let stopped = || format!("{name} returned the status {}", STATUSES[status]);
        match STATUSES[status] {
            "ok" | "warning" => Ok(()),
            "fatal" => {
                // After a fatal status the instance may not even be freed, so its memory is leaked.
                if let Some(native) = self.native.take() {
                    mem::forget(native);
                }
                Err(Stopped::Fatal(stopped() + &self.said.text()))
            }
            "pending" => Err(Stopped::Refused(
                stopped() + ": steps in the background are not supported" + &self.said.text(),
            )),
            _ => Err(Stopped::Refused(stopped() + &self.said.text())),
        }
    }

    pub(crate) fn set(&mut self, slots: &Slots, values: &[f64]) -> Result<(), Stopped> {
        let Slots { doubles, singles, .. } = slots;
        let what = "setting values";
        if !doubles.is_empty() {
            let (at, own) = (&doubles.references, doubles.picked(values));
            self.call(what, |fmu| fmu.setReal(at, &own), |fmu| fmu.setFloat64(at, &own))?;
        }
        if !singles.is_empty() {
            let own: Vec<f32> = singles.picked(values).into_iter().map(|x| x as f32).collect();
            let at = &singles.references;
            self.call(what, |_| fmi2Status::Ok, |fmu| fmu.setFloat32(at, &own))?;
        }
        Ok(())
    }

    pub(crate) fn read(&mut self, slots: &Slots, values: &mut [f64]) -> Result<(), Stopped> {
        let Slots { doubles, singles, .. } = slots;
        let what = "reading values";
        if !doubles.is_empty() {
            let (at, own) = (&doubles.references, RefCell::new(vec![0.0; doubles.at.len()]));
            self.call(
                what,
                |fmu| fmu.getReal(at, &mut own.borrow_mut()),
                |fmu| fmu.getFloat64(at, &mut own.borrow_mut()),
            )?;
            doubles.put(own.into_inner(), values);
        }
        if !singles.is_empty() {
            let mut own = vec![0.0_f32; singles.at.len()];
            let at = &singles.references;
            self.call(what, |_| fmi2Status::Ok, |fmu| fmu.getFloat32(at, &mut own))?;
            singles.put(own, values);
        }
        Ok(())
    }

    /// Enters the initialization mode. Called after setting start values and before setting the
    /// first inputs.
    pub(crate) fn begin(&mut self) -> Result<(), Stopped> {
        self.call(
            "beginning its initialization",
            |fmu| match fmu.setupExperiment(None, 0.0, None) {
                fmi2Status::Ok | fmi2Status::Warning => fmu.enterInitializationMode(),
                status => status,
            },
            |fmu| fmu.enterInitializationMode(None, 0.0, None),
        )
    }

    /// Exits the initialization mode. Called after setting the first inputs.
    pub(crate) fn begun(&mut self) -> Result<(), Stopped> {
        let what = "its initialization";
        self.call(what, |fmu| fmu.exitInitializationMode(), |fmu| fmu.exitInitializationMode())
    }

    /// Advances by one step of the session.
    pub(crate) fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), Stopped> {
        let (mut event, mut is_over, mut is_early, mut reached_s) = (false, false, false, time_s);
        let at = format!("the step at {time_s:.6} s");
        self.call(
            &at,
            // The flag 1 promises that the simulation never returns to a time before this point.
            |fmu| fmu.doStep(time_s, step_s, 1),
            |fmu| {
                let flags = (&mut event, &mut is_over, &mut is_early, &mut reached_s);
                fmu.doStep(time_s, step_s, true, flags.0, flags.1, flags.2, flags.3)
            },
        )?;
        if is_over || is_early {
            let how = if is_over { "ends the simulation" } else { "returns early" };
            let said = self.said.text();
            return Err(Stopped::Refused(format!("{at} {how} at {reached_s:.6} s{said}")));
        }
        Ok(())
    }

    /// Terminates a run regularly.
    pub(crate) fn end(&mut self) -> Result<(), Stopped> {
        self.call("terminating it", |fmu| fmu.terminate(), |fmu| fmu.terminate())
    }
}

fn not_made(fmu: &Fmu, error: SimulationError, said: &Said) -> FmuError {
    let why = match error {
        SimulationError::Library { source, .. } => {
            format!("its library cannot be loaded: {source}")
        }
        SimulationError::Symbol { name, .. } => format!(
            "its library has no function {name}, which every FMU of FMI {} has; export it again",
            fmu.model().version.number()
        ),
        SimulationError::FMICall => {
            let tool = match fmu.model().needs_tool {
                true => "; it needs the program that it was exported from, installed and licensed",
                false => "",
            };
            format!("it cannot be instantiated{}{tool}", said.text())
        }
        other => format!("it cannot be instantiated: {other}"),
    };
    FmuError::of(fmu.file(), why)
}

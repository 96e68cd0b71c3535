//! An instance of an FMU, from instantiation to termination, for both versions of the standard.

use std::{
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

/// The status of a call, common to both versions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Status {
    Fine,
    Discard,
    Error,
    Fatal,
    Pending,
}

impl From<fmi2Status> for Status {
    fn from(status: fmi2Status) -> Self {
        match status {
            fmi2Status::Ok | fmi2Status::Warning => Self::Fine,
            fmi2Status::Discard => Self::Discard,
            fmi2Status::Error => Self::Error,
            fmi2Status::Fatal => Self::Fatal,
            fmi2Status::Pending => Self::Pending,
        }
    }
}

impl From<fmi3Status> for Status {
    fn from(status: fmi3Status) -> Self {
        match status {
            fmi3Status::Ok | fmi3Status::Warning => Self::Fine,
            fmi3Status::Discard => Self::Discard,
            fmi3Status::Error => Self::Error,
            fmi3Status::Fatal => Self::Fatal,
        }
    }
}

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

    fn put(&self, from: &[f64], values: &mut [f64]) {
        self.at.iter().zip(from).for_each(|(&at, x)| values[at] = *x);
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

    /// Converts the status of a call to a result.
    fn checked(&mut self, call: &str, status: Status) -> Result<(), Stopped> {
        let said = self.said.text();
        match status {
            Status::Fine => Ok(()),
            Status::Discard => {
                Err(Stopped::Refused(format!("{call} returned the status discard{said}")))
            }
            Status::Error => {
                Err(Stopped::Refused(format!("{call} returned the status error{said}")))
            }
            Status::Pending => Err(Stopped::Refused(format!(
                "{call} returned the status pending: steps in the background are not supported{said}"
            ))),
            Status::Fatal => {
                // After a fatal status the instance may not even be freed, so its memory is leaked.
                if let Some(native) = self.native.take() {
                    mem::forget(native);
                }
                Err(Stopped::Fatal(format!("{call} returned the status fatal{said}")))
            }
        }
    }

    pub(crate) fn set(&mut self, slots: &Slots, values: &[f64]) -> Result<(), Stopped> {
        let (doubles, singles) = (&slots.doubles, &slots.singles);
        let status = match &self.native {
            Some(Native::Two(fmu)) if !doubles.is_empty() => {
                fmu.setReal(&doubles.references, &doubles.picked(values)).into()
            }
            Some(Native::Three(fmu)) if !doubles.is_empty() => {
                fmu.setFloat64(&doubles.references, &doubles.picked(values)).into()
            }
            _ => Status::Fine,
        };
        self.checked("setting values", status)?;
        let status = match &self.native {
            Some(Native::Three(fmu)) if !singles.is_empty() => {
                let values: Vec<f32> =
                    singles.picked(values).into_iter().map(|x| x as f32).collect();
                fmu.setFloat32(&singles.references, &values).into()
            }
            _ => Status::Fine,
        };
        self.checked("setting values", status)
    }

    pub(crate) fn read(&mut self, slots: &Slots, values: &mut [f64]) -> Result<(), Stopped> {
        let (doubles, singles) = (&slots.doubles, &slots.singles);
        let mut own = vec![0.0; doubles.at.len()];
        let status = match &self.native {
            Some(Native::Two(fmu)) if !doubles.is_empty() => {
                fmu.getReal(&doubles.references, &mut own).into()
            }
            Some(Native::Three(fmu)) if !doubles.is_empty() => {
                fmu.getFloat64(&doubles.references, &mut own).into()
            }
            _ => Status::Fine,
        };
        self.checked("reading values", status)?;
        doubles.put(&own, values);
        let mut own = vec![0.0_f32; singles.at.len()];
        let status = match &self.native {
            Some(Native::Three(fmu)) if !singles.is_empty() => {
                fmu.getFloat32(&singles.references, &mut own).into()
            }
            _ => Status::Fine,
        };
        self.checked("reading values", status)?;
        let own: Vec<f64> = own.into_iter().map(f64::from).collect();
        singles.put(&own, values);
        Ok(())
    }

    /// Enters the initialization mode. Called after setting start values and before setting the
    /// first inputs.
    pub(crate) fn begin(&mut self) -> Result<(), Stopped> {
        let status = match &self.native {
            Some(Native::Two(fmu)) => match fmu.setupExperiment(None, 0.0, None) {
                fmi2Status::Ok | fmi2Status::Warning => fmu.enterInitializationMode().into(),
                status => status.into(),
            },
            Some(Native::Three(fmu)) => fmu.enterInitializationMode(None, 0.0, None).into(),
            None => Status::Fine,
        };
        self.checked("beginning its initialization", status)
    }

    /// Exits the initialization mode. Called after setting the first inputs.
    pub(crate) fn begun(&mut self) -> Result<(), Stopped> {
        let status = match &self.native {
            Some(Native::Two(fmu)) => fmu.exitInitializationMode().into(),
            Some(Native::Three(fmu)) => fmu.exitInitializationMode().into(),
            None => Status::Fine,
        };
        self.checked("its initialization", status)
    }

    /// Advances by one step of the session.
    pub(crate) fn step(&mut self, time_s: f64, step_s: f64) -> Result<(), Stopped> {
        let (mut event, mut is_over, mut is_early, mut reached_s) = (false, false, false, time_s);
        let status = match &self.native {
            // The flag 1 promises that the simulation never returns to a time before this point.
            Some(Native::Two(fmu)) => fmu.doStep(time_s, step_s, 1).into(),
            Some(Native::Three(fmu)) => fmu
                .doStep(
                    time_s,
                    step_s,
                    true,
                    &mut event,
                    &mut is_over,
                    &mut is_early,
                    &mut reached_s,
                )
                .into(),
            None => Status::Fine,
        };
        let at = || format!("the step at {time_s:.6} s");
        self.checked(&at(), status)?;
        if is_over || is_early {
            let how = if is_over { "ends the simulation" } else { "returns early" };
            let said = self.said.text();
            return Err(Stopped::Refused(format!("{} {how} at {reached_s:.6} s{said}", at())));
        }
        Ok(())
    }

    /// Terminates a run regularly.
    pub(crate) fn end(&mut self) -> Result<(), Stopped> {
        let status = match &self.native {
            Some(Native::Two(fmu)) => fmu.terminate().into(),
            Some(Native::Three(fmu)) => fmu.terminate().into(),
            None => Status::Fine,
        };
        self.checked("terminating it", status)
    }
}

fn not_made(fmu: &Fmu, error: SimulationError, said: &Said) -> FmuError {
    let file = fmu.file().to_owned();
    match error {
        SimulationError::Library { source, .. } => {
            FmuError::Library { file, why: source.to_string() }
        }
        SimulationError::Symbol { name, .. } => {
            FmuError::Function { file, name, version: fmu.model().version.number() }
        }
        SimulationError::FMICall => {
            let tool = match fmu.model().needs_tool {
                true => "; it needs the program that it was exported from, installed and licensed",
                false => "",
            };
            FmuError::Instance { file, said: said.text() + tool }
        }
        other => FmuError::Instance { file, said: format!(": {other}") },
    }
}

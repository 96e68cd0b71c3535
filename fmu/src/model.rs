//! The model description of an FMU, common to both versions of the standard.

use fmi_rs::model_description::{fmi2, fmi3};

/// Version of the standard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Fmi2,
    /// FMI 3.0.
    Fmi3,
}

impl Version {
    /// Returns the number of the version, 2 or 3.
    pub fn number(self) -> u8 {
        match self {
            Self::Fmi2 => 2,
            Self::Fmi3 => 3,
        }
    }
}

/// The role of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Role {
    /// Set before a run.
    Parameter,
    /// Set at every step.
    Input,
    /// Read at every step.
    Output,
    /// Internal variable that can be read.
    Local,
    /// Anything else: calculated parameters, sizes of arrays, time.
    Other,
}

impl Role {
    pub(crate) fn shown(self) -> &'static str {
        match self {
            Self::Parameter => "a parameter",
            Self::Input => "an input",
            Self::Output => "an output",
            Self::Local => "a local variable",
            Self::Other => "neither parameter nor input nor output",
        }
    }
}

/// Number format of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Kind {
    /// 64 bits, floating point.
    Double,
    /// 32 bits, floating point.
    Single,
    /// Any other type: an array, or not a floating-point number. The text names the type.
    Other(&'static str),
}

/// A variable of an FMU.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// Its number format.
    pub kind: Kind,
    /// Unit, if it is given.
    pub unit: Option<String>,
    /// Start value, if it is given.
    pub start: Option<f64>,
    pub(crate) reference: u32,
}

/// The model description of an FMU.
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// Version of the standard.
    pub version: Version,
    /// Its name.
    pub name: String,
    /// Its variables.
    pub variables: Vec<Variable>,
    /// Length of its internal steps, s, if they are fixed.
    pub inner_step_s: Option<f64>,
    pub(crate) identifier: String,
    /// GUID, or instantiation token.
    pub(crate) token: String,
    pub(crate) takes_allocator: bool,
    /// Whether it needs an installed program to run.
    pub(crate) needs_tool: bool,
}

fn number(text: Option<&String>) -> Option<f64> {
    text.and_then(|t| t.trim().parse().ok())
}

impl Model {
    /// Returns `None` if the FMU is not for co-simulation.
    pub(crate) fn of_fmi2(description: &fmi2::ModelDescription) -> Option<Self> {
        use fmi2::{Causality, VariableType};
        let about = description.coSimulation.as_ref()?;
        let variable = |v: &fmi2::ScalarVariable| Variable {
            name: v.name.clone(),
            role: match v.causality {
                Causality::Parameter => Role::Parameter,
                Causality::Input => Role::Input,
                Causality::Output => Role::Output,
                Causality::Local => Role::Local,
                Causality::CalculatedParameter | Causality::Independent => Role::Other,
            },
            kind: match &v.variableType {
                VariableType::Real { .. } => Kind::Double,
                other => Kind::Other(other.name()),
            },
            unit: description.get_unit(v).map(str::to_owned),
            start: number(v.variableType.start().as_ref()),
            reference: v.valueReference,
        };
        // FMI 2 does not describe internal steps. An FMU that only accepts communication steps of
        // one length usually has fixed internal steps.
        let step = description.defaultExperiment.as_ref().and_then(|e| number(e.stepSize.as_ref()));
        Some(Self {
            version: Version::Fmi2,
            name: description.modelName.clone(),
            variables: description.modelVariables.iter().map(variable).collect(),
            inner_step_s: step.filter(|_| !about.canHandleVariableCommunicationStepSize),
            identifier: about.modelIdentifier.clone(),
            token: description.guid.clone(),
            takes_allocator: !about.canNotUseMemoryManagementFunctions,
            needs_tool: about.needsExecutionTool,
        })
    }

    /// Returns `None` if the FMU is not for co-simulation.
    pub(crate) fn of_fmi3(description: &fmi3::ModelDescription) -> Option<Self> {
        use fmi3::{Causality, VariableType};
        let about = description.coSimulation.as_ref()?;
        let variable = |v: &fmi3::ModelVariable| {
            let (kind, start) = match &v.variableType {
                _ if !v.dimensions.is_empty() => (Kind::Other("an array"), None),
                VariableType::Float64 { start, .. } => (Kind::Double, start.as_ref()),
                VariableType::Float32 { start, .. } => (Kind::Single, start.as_ref()),
                _ => (Kind::Other("of another type"), None),
            };
            Variable {
                name: v.name.clone(),
                role: match v.causality {
                    Causality::Parameter => Role::Parameter,
                    Causality::Input => Role::Input,
                    Causality::Output => Role::Output,
                    Causality::Local => Role::Local,
                    _ => Role::Other,
                },
                kind,
                unit: description.get_unit(v).map(str::to_owned),
                start: number(start),
                reference: v.valueReference,
            }
        };
        Some(Self {
            version: Version::Fmi3,
            name: description.modelName.clone(),
            variables: description.modelVariables.iter().map(variable).collect(),
            inner_step_s: number(about.fixedInternalStepSize.as_ref()),
            identifier: about.modelIdentifier.clone(),
            token: description.instantiationToken.clone(),
            takes_allocator: false,
            needs_tool: about.needsExecutionTool,
        })
    }
}

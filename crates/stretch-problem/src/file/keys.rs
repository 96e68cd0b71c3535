//! Every key of a problem's file, once: the reader accepts these, and the reference and the schema for editors say them.

/// What a key holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Holds {
    Text,
    /// A text, or a list of texts.
    Texts,
    Number,
    Count,
    Flag,
    /// Two numbers.
    Range,
    /// A number, or a text with a per cent sign.
    Tolerance,
    /// One of these texts.
    OneOf(&'static [&'static str]),
    /// Texts by name.
    Names,
    /// The simulator: a command as a list, or its table.
    Simulator,
    /// Tables of that kind, one or several.
    Tables(&'static str),
}

/// A key of a table.
#[derive(Debug, Clone, Copy)]
pub(super) struct Key {
    pub(super) name: &'static str,
    pub(super) holds: Holds,
    pub(super) is_needed: bool,
    pub(super) words: &'static str,
}

const fn key(name: &'static str, holds: Holds, words: &'static str) -> Key {
    Key { name, holds, is_needed: false, words }
}

const fn needed(name: &'static str, holds: Holds, words: &'static str) -> Key {
    Key { name, holds, is_needed: true, words }
}

/// A table of the file.
#[derive(Debug, Clone, Copy)]
pub(super) struct Keys {
    pub(super) name: &'static str,
    pub(super) words: &'static str,
    pub(super) keys: &'static [Key],
    /// Whether further keys are names of the user's own.
    pub(super) is_open: bool,
}

impl Keys {
    /// Names of the keys.
    pub(super) fn names(&self) -> Vec<&'static str> {
        self.keys.iter().map(|key| key.name).collect()
    }
}

const UNIT: Key = key("unit", Holds::Text, "unit; empty where there is none");
const STAGES: Key =
    key("stages", Holds::Texts, "names of the stages in which it acts; all without it");

pub(super) static TOP: Keys = Keys {
    name: "",
    words: "The file itself.",
    is_open: false,
    keys: &[
        key("name", Holds::Text, "name of the problem in reports"),
        key(
            "folder",
            Holds::Text,
            "folder that its files are relative to, where it is not its own",
        ),
        needed(
            "simulator",
            Holds::Simulator,
            "the simulator: a command as a list, or the table [simulator]",
        ),
        key(
            "wrap",
            Holds::Texts,
            "what is looked for around the stages: all, or names such as input.delay, output.all, state.all, gear.output.backlash",
        ),
        key("wrapped", Holds::Tables("wrapped"), "wrappers that act in every run"),
        key(
            "without",
            Holds::Texts,
            "effects that are not looked for, by name, kind (backlash) or place (output.all)",
        ),
        key(
            "beside",
            Holds::Texts,
            "further columns that a wrapper may look at: what talks across, what loads a contact",
        ),
        key("reference", Holds::Text, "column that an output senses; with signal"),
        key("signal", Holds::Text, "that output"),
        key("time", Holds::Text, "column of the time; time_s without it"),
        key(
            "time_unit",
            Holds::OneOf(&["s", "ms", "us", "ns"]),
            "what the time counts, where the name of its column does not say",
        ),
        key("budget", Holds::Count, "greatest number of runs of the simulator"),
        key("stage", Holds::Tables("stage"), "the stages; needed unless the simulator is built in"),
        key("input", Holds::Tables("input"), "unit and noise of columns that drive stages"),
        key("parameter", Holds::Tables("parameter"), "nominal parameters"),
        key("effect", Holds::Tables("effect"), "effects that the simulator has itself"),
        key(
            "trial",
            Holds::Tables("trial"),
            "the recordings; needed unless the simulator is built in",
        ),
    ],
};

pub(super) static STAGE: Keys = Keys {
    name: "stage",
    words: "A stage turns measured input columns into one measured output column.",
    is_open: false,
    keys: &[
        key("name", Holds::Text, "name in reports; the output without it"),
        needed("output", Holds::Text, "column that the simulated output is compared with"),
        key(
            "unit",
            Holds::Text,
            "unit of the output; the last part of the column's name without it",
        ),
        key("inputs", Holds::Texts, "columns that drive the stage"),
        key(
            "noise",
            Holds::Number,
            "noise of the output, one standard deviation; estimated without it",
        ),
        key(
            "velocity",
            Holds::Text,
            "column of the velocity at which it rubs; friction needs it, or the position",
        ),
        key("position", Holds::Text, "column of the position whose change that velocity is"),
    ],
};

pub(super) static INPUT: Keys = Keys {
    name: "input",
    words: "What is known of a column that drives a stage.",
    is_open: false,
    keys: &[
        needed("column", Holds::Text, "the column"),
        UNIT,
        key(
            "noise",
            Holds::Number,
            "noise, one standard deviation; 0 for a command, and without it",
        ),
    ],
};

pub(super) static PARAMETER: Keys = Keys {
    name: "parameter",
    words: "A nominal parameter, which may be re-tuned within three tolerances.",
    is_open: false,
    keys: &[
        needed("name", Holds::Text, "name, as the simulator knows it"),
        UNIT,
        needed("value", Holds::Number, "value that the simulator is shipped with"),
        key(
            "tolerance",
            Holds::Tolerance,
            "one standard deviation, a number in the unit or a share such as \"10 %\"; exact without it",
        ),
        key("least", Holds::Number, "least value that makes sense"),
        key("greatest", Holds::Number, "greatest value that makes sense"),
        STAGES,
        key(
            "alone",
            Holds::Number,
            "value re-tuned without the effects of the file, which stretch foretell compares with; --fix writes it",
        ),
    ],
};

const ARGUMENT_KEYS: [Key; 5] = [
    UNIT,
    needed("range", Holds::Range, "least and greatest plausible value"),
    key("off", Holds::Number, "value at which it does nothing; none for a shape"),
    key("log", Holds::Flag, "whether it is searched in equal ratios"),
    key("value", Holds::Number, "value in every run, where it was found before; --fix writes it"),
];

pub(super) static EFFECT: Keys = Keys {
    name: "effect",
    words: "An effect that the simulator has itself, of one argument; one of several has a table [[effect.argument]] for each, and the keys of an argument there.",
    is_open: false,
    keys: &[
        needed("name", Holds::Text, "name, as the simulator knows it"),
        UNIT,
        key(
            "range",
            Holds::Range,
            "least and greatest plausible value; needed without [[effect.argument]]",
        ),
        ARGUMENT_KEYS[2],
        ARGUMENT_KEYS[3],
        ARGUMENT_KEYS[4],
        STAGES,
        key("twins", Holds::Texts, "effects that are hard to tell from it"),
        key("argument", Holds::Tables("argument"), "its arguments, where it has several"),
    ],
};

pub(super) static ARGUMENT: Keys = Keys {
    name: "argument",
    words: "An argument of an effect that has several ([[effect.argument]]); the simulator knows it as effect.argument.",
    is_open: false,
    keys: &[
        needed("name", Holds::Text, "name of the argument"),
        ARGUMENT_KEYS[0],
        ARGUMENT_KEYS[1],
        ARGUMENT_KEYS[2],
        ARGUMENT_KEYS[3],
        ARGUMENT_KEYS[4],
    ],
};

static WRAPPED: Keys = Keys {
    name: "wrapped",
    words: "A wrapper that acts in every run, with its values by name; a form that is left out has its usual value. --fix writes it.",
    is_open: true,
    keys: &[needed("name", Holds::Text, "place and kind, as output.backlash")],
};

pub(super) static TRIAL: Keys = Keys {
    name: "trial",
    words: "A recording.",
    is_open: false,
    keys: &[
        needed("file", Holds::Text, "file, relative to the problem's folder"),
        key(
            "start_s",
            Holds::Number,
            "session time of its first sample, s; without it the trial follows the one before",
        ),
        key(
            "split",
            Holds::OneOf(&["fit", "test"]),
            "whether it may be fitted, as without it, or is tested on once",
        ),
    ],
};

static SIMULATOR: Keys = Keys {
    name: "simulator",
    words: "One of command, python, fmu and builtin; the others say how it is run.",
    is_open: false,
    keys: &[
        key(
            "command",
            Holds::Texts,
            "program and arguments of a worker, started in the problem's folder",
        ),
        key("python", Holds::Text, "module:object of a Python simulator"),
        key("fmu", Holds::Text, "an FMU, relative to the problem's folder"),
        key(
            "variables",
            Holds::Names,
            "of an FMU: its names for parameters, effects and columns, where they differ",
        ),
        key("jobs", Holds::Count, "workers at once; --jobs without it"),
        key("deadline_s", Holds::Number, "longest time that one model may take, s; 60 without it"),
        key(
            "start_s",
            Holds::Number,
            "longest time that a worker may take to begin, s; 120 without it",
        ),
        key("builtin", Holds::OneOf(&["rig", "gauge"]), "the built-in rig, or a gauge alone"),
        key("data_set", Holds::Text, "of a built-in one: folder of its data set, or a trial"),
        key("rig", Holds::Text, "of a built-in one: its rig file"),
        key("reference", Holds::Text, "of a gauge: column of its reference; with signal"),
        key("signal", Holds::Text, "of a gauge: column of its signal"),
    ],
};

/// Every table, in the order of the reference.
pub(super) static ALL: [&Keys; 9] =
    [&TOP, &SIMULATOR, &STAGE, &INPUT, &PARAMETER, &EFFECT, &ARGUMENT, &WRAPPED, &TRIAL];

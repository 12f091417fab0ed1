//! The state machine of a co-simulation slave: which function is legal in which state.

/// The states of FMI 2.0.3, section 4.2.4, that a slave without asynchronous steps can be in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum State {
    Instantiated = 1,
    Initialisation = 2,
    StepComplete = 4,
    StepFailed = 8,
    Terminated = 16,
    Error = 32,
}

impl State {
    pub(crate) const ALL: [Self; 6] =
        [Self::Instantiated, Self::Initialisation, Self::StepComplete, Self::StepFailed, Self::Terminated, Self::Error];

    /// The state with this number, as written in a saved state.
    pub(crate) fn from_number(number: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|state| *state as u8 == number)
    }

    /// What the standard calls it, for messages.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated",
            Self::Initialisation => "initialization mode",
            Self::StepComplete => "step complete",
            Self::StepFailed => "step failed",
            Self::Terminated => "terminated",
            Self::Error => "error",
        }
    }
}

macro_rules! functions {
    ($($variant:ident = $name:literal: $states:expr;)*) => {
        /// The functions that work on an instance.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub(crate) enum Function { $($variant),* }

        impl Function {
            pub(crate) const ALL: &[Self] = &[$(Self::$variant),*];

            pub(crate) fn name(self) -> &'static str {
                match self { $(Self::$variant => $name),* }
            }

            fn legal_states(self) -> u8 {
                match self { $(Self::$variant => $states),* }
            }
        }
    };
}

const INSTANTIATED: u8 = State::Instantiated as u8;
const INITIALISATION: u8 = State::Initialisation as u8;
/// Between steps. After a step that was not taken in full the standard's table lets a host read and
/// restore only; here it may also set inputs and go on from the time that was reached, which is what
/// `fmi2LastSuccessfulTime` is good for.
const STEPPING: u8 = State::StepComplete as u8 | State::StepFailed as u8;
const TERMINATED: u8 = State::Terminated as u8;
const ERROR: u8 = State::Error as u8;
const ANY: u8 = INSTANTIATED | INITIALISATION | STEPPING | TERMINATED | ERROR;
/// Values read in the error state are for looking into what happened only.
const READING: u8 = INITIALISATION | STEPPING | TERMINATED | ERROR;
const WRITING: u8 = INSTANTIATED | INITIALISATION | STEPPING;
/// Only a step that runs in the background could be cancelled.
const NONE: u8 = 0;

// The one table. Which variables may be set in the states of `WRITING` depends on the variable, see
// `Variable::settable_before_initialisation` and its neighbours.
functions! {
    SetDebugLogging = "fmi2SetDebugLogging": ANY;
    SetupExperiment = "fmi2SetupExperiment": INSTANTIATED;
    EnterInitializationMode = "fmi2EnterInitializationMode": INSTANTIATED;
    ExitInitializationMode = "fmi2ExitInitializationMode": INITIALISATION;
    Terminate = "fmi2Terminate": STEPPING;
    Reset = "fmi2Reset": ANY;
    GetReal = "fmi2GetReal": READING;
    GetInteger = "fmi2GetInteger": READING;
    GetBoolean = "fmi2GetBoolean": READING;
    GetString = "fmi2GetString": READING;
    SetReal = "fmi2SetReal": WRITING;
    SetInteger = "fmi2SetInteger": WRITING;
    SetBoolean = "fmi2SetBoolean": WRITING;
    SetString = "fmi2SetString": WRITING;
    GetFmuState = "fmi2GetFMUstate": ANY;
    SetFmuState = "fmi2SetFMUstate": ANY;
    FreeFmuState = "fmi2FreeFMUstate": ANY;
    SerializedFmuStateSize = "fmi2SerializedFMUstateSize": ANY;
    SerializeFmuState = "fmi2SerializeFMUstate": ANY;
    DeSerializeFmuState = "fmi2DeSerializeFMUstate": ANY;
    GetDirectionalDerivative = "fmi2GetDirectionalDerivative": READING;
    SetRealInputDerivatives = "fmi2SetRealInputDerivatives": WRITING;
    GetRealOutputDerivatives = "fmi2GetRealOutputDerivatives": STEPPING | TERMINATED | ERROR;
    DoStep = "fmi2DoStep": STEPPING;
    CancelStep = "fmi2CancelStep": NONE;
    GetStatus = "fmi2GetStatus": STEPPING | TERMINATED;
    GetRealStatus = "fmi2GetRealStatus": STEPPING | TERMINATED;
    GetIntegerStatus = "fmi2GetIntegerStatus": STEPPING | TERMINATED;
    GetBooleanStatus = "fmi2GetBooleanStatus": STEPPING | TERMINATED;
    GetStringStatus = "fmi2GetStringStatus": STEPPING | TERMINATED;
}

impl Function {
    /// May the host call it in this state?
    pub(crate) fn is_legal_in(self, state: State) -> bool {
        self.legal_states() & state as u8 != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_read_back_from_their_numbers() {
        for state in State::ALL {
            assert_eq!(State::from_number(state as u8), Some(state));
        }
        assert_eq!(State::from_number(0), None);
        assert_eq!(State::from_number(3), None);
    }

    #[test]
    fn a_broken_instance_can_be_read_reset_and_restored_but_not_driven() {
        for &function in Function::ALL {
            let name = function.name();
            let drives = ["Set", "Enter", "Exit", "Terminate", "DoStep", "Cancel"]
                .iter()
                .any(|verb| name.trim_start_matches("fmi2").starts_with(verb))
                && !["fmi2SetDebugLogging", "fmi2SetFMUstate"].contains(&name);
            let status = name.ends_with("Status");
            assert_eq!(function.is_legal_in(State::Error), !drives && !status, "{name}");
        }
    }
}

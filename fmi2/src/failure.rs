//! Why a call did not return `fmi2OK`.

use crate::model::{ModelError, Status};

/// A call that went wrong, told apart by what it leaves behind.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Failure {
    /// `fmi2Error` for a request that was refused; the instance is as it was and can go on.
    #[error("{0}")]
    Refused(String),
    /// `fmi2Error` from inside the model; the instance is in the error state.
    #[error("{0}")]
    Broken(String),
    /// `fmi2Discard`: a step not taken in full, or a status that there is none of.
    #[error("{0}")]
    Discarded(String),
}

impl Failure {
    pub(crate) fn refused(message: impl Into<String>) -> Self {
        Self::Refused(message.into())
    }

    pub(crate) fn broken(message: impl Into<String>) -> Self {
        Self::Broken(message.into())
    }

    pub(crate) fn status(&self) -> Status {
        match self {
            Self::Refused(_) | Self::Broken(_) => Status::Error,
            Self::Discarded(_) => Status::Discard,
        }
    }
}

impl From<ModelError> for Failure {
    /// The model said no and, by its contract, kept what it had.
    fn from(error: ModelError) -> Self {
        Self::Refused(error.message)
    }
}

/// What a call comes to.
pub(crate) type Outcome<T = ()> = Result<T, Failure>;

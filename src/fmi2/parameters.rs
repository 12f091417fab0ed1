//! Value references of the parameters, and those with named values.

use crate::integrator::Solver;
use crate::model_file::Model;
use crate::parameter::REALS;
use crate::parameters::{CableInertia, CableModel, Initialization};

use super::role::Choice;

/// Cables of the default robot, whose variables lie side by side.
const FIRST_CABLES: u32 = 4;
/// Value reference of the first parameter.
const FIRST_PARAMETER: u32 = 100;

/// The value reference of one of a row of variables, `first` being that of cable 1.
///
/// The rows of the default robot lie side by side; further cables have theirs in rows of their own.
pub(super) fn reference(first: u32, cable: usize) -> u32 {
    const FURTHER: u32 = 10_000;
    const ROW: u32 = 100;
    let cable = cable as u32;
    if cable < FIRST_CABLES { first + cable } else { FURTHER + ROW * first + cable }
}

/// The value reference of a parameter, by its place in the list; of the first cable's where there is one for each. They lie one
/// behind the other.
pub(super) fn parameter_reference(place: usize) -> u32 {
    let width = |per_cable| if per_cable { FIRST_CABLES } else { 1 };
    FIRST_PARAMETER + REALS[..place].iter().map(|parameter| width(parameter.per_cable)).sum::<u32>()
}

const CABLE_MODELS: [CableModel; 3] = [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass];
const CABLE_INERTIAS: [CableInertia; 3] = [CableInertia::Paper, CableInertia::Reeled, CableInertia::None];
const INITIALIZATIONS: [Initialization; 3] =
    [Initialization::FromWinchForces, Initialization::FromStates, Initialization::StaticEquilibrium];

const SOLVERS: [Solver; 3] = [Solver::Radau, Solver::DormandPrince, Solver::Auto];

fn number<T: PartialEq>(values: &[T], value: &T) -> i32 {
    // The items are numbered from 1 in the order of these lists.
    (1..).zip(values).find(|(_, v)| *v == value).map_or(0, |(n, _)| n)
}

fn item<T: Copy>(values: &[T], number: i32) -> Option<T> {
    usize::try_from(number.checked_sub(1)?).ok().and_then(|k| values.get(k)).copied()
}

impl Choice {
    /// All of them, in the order of their value references.
    pub(super) const ALL: [Self; 4] = [Self::CableModel, Self::CableInertia, Self::Initialization, Self::Solver];

    /// Name of the variable.
    pub(super) fn variable(self) -> &'static str {
        match self {
            Self::CableModel => "cable_model",
            Self::CableInertia => "cable_inertia",
            Self::Initialization => "initialization",
            Self::Solver => "solver",
        }
    }

    /// The chosen item's number.
    pub(super) fn get(self, model: &Model) -> i32 {
        match self {
            Self::CableModel => number(&CABLE_MODELS, &model.parameters.cable_model),
            Self::CableInertia => number(&CABLE_INERTIAS, &model.parameters.cable_inertia),
            Self::Initialization => number(&INITIALIZATIONS, &model.start.initialization),
            Self::Solver => number(&SOLVERS, &model.solver),
        }
    }

    /// Chooses the item with this number; `None` where there is none.
    pub(super) fn set(self, model: &mut Model, number: i32) -> Option<()> {
        match self {
            Self::CableModel => model.parameters.cable_model = item(&CABLE_MODELS, number)?,
            Self::CableInertia => model.parameters.cable_inertia = item(&CABLE_INERTIAS, number)?,
            Self::Initialization => model.start.initialization = item(&INITIALIZATIONS, number)?,
            Self::Solver => model.solver = item(&SOLVERS, number)?,
        }
        Some(())
    }
}

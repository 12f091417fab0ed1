//! The parameters that a host can set, and where each is kept in the model.

use crate::model_file::Model;
use crate::parameters::{CABLES, CableInertia, CableModel, Initialization};

use super::role::Choice;

/// A real parameter, or one for each cable.
pub(super) struct RealParameter {
    pub(super) name: &'static str,
    /// One for each cable, named `name[1]` to `name[4]`.
    pub(super) per_cable: bool,
    /// Value reference, of the first where there are four.
    pub(super) reference: u32,
    pub(super) unit: &'static str,
    pub(super) quantity: &'static str,
    pub(super) description: &'static str,
    pub(super) range: (Option<f64>, Option<f64>),
    pub(super) nominal: f64,
    /// Where it is kept; the index is 0 where there is one.
    pub(super) field: fn(&mut Model, usize) -> &mut f64,
}

impl RealParameter {
    /// How many variables it has.
    pub(super) fn count(&self) -> usize {
        if self.per_cable { CABLES } else { 1 }
    }

    /// The variable's name.
    pub(super) fn variable(&self, index: usize) -> String {
        if self.per_cable { format!("{}[{}]", self.name, index + 1) } else { self.name.to_owned() }
    }
}

const POSITIVE: (Option<f64>, Option<f64>) = (Some(0.0), None);
const ANY: (Option<f64>, Option<f64>) = (None, None);

/// Every real parameter. A lower bound of zero that is itself not allowed is refused at initialisation.
pub(super) static REALS: [RealParameter; 11] = [
    RealParameter {
        name: "platform_mass",
        per_cable: false,
        reference: 100,
        unit: "kg",
        quantity: "Mass",
        description: "Mass of the platform",
        range: POSITIVE,
        nominal: 1e3,
        field: |m, _| &mut m.parameters.platform_mass,
    },
    RealParameter {
        name: "platform_inertia",
        per_cable: false,
        reference: 101,
        unit: "kg.m2",
        quantity: "MomentOfInertia",
        description: "Moment of inertia of the platform about its centre of mass",
        range: POSITIVE,
        nominal: 1e5,
        field: |m, _| &mut m.parameters.platform_inertia,
    },
    RealParameter {
        name: "anchor_radius",
        per_cable: false,
        reference: 102,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of anchors",
        range: POSITIVE,
        nominal: 1e3,
        field: |m, _| &mut m.parameters.anchor_radius,
    },
    RealParameter {
        name: "attachment_radius",
        per_cable: false,
        reference: 103,
        unit: "m",
        quantity: "Length",
        description: "Radius of the circle of attachment points on the platform",
        range: POSITIVE,
        nominal: 10.0,
        field: |m, _| &mut m.parameters.attachment_radius,
    },
    RealParameter {
        name: "anchor_angle",
        per_cable: true,
        reference: 104,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the anchor on its circle",
        range: ANY,
        nominal: 1.0,
        field: |m, i| &mut m.parameters.anchor_angle[i],
    },
    RealParameter {
        name: "attachment_angle",
        per_cable: true,
        reference: 108,
        unit: "rad",
        quantity: "Angle",
        description: "Angle of the attachment point on its circle, in the platform's frame",
        range: ANY,
        nominal: 1.0,
        field: |m, i| &mut m.parameters.attachment_angle[i],
    },
    RealParameter {
        name: "cable_density",
        per_cable: false,
        reference: 112,
        unit: "kg/m",
        quantity: "LinearDensity",
        description: "Mass of the cables per unstretched length",
        range: POSITIVE,
        nominal: 0.1,
        field: |m, _| &mut m.parameters.cable_density,
    },
    RealParameter {
        name: "youngs_modulus",
        per_cable: false,
        reference: 113,
        unit: "Pa",
        quantity: "Stress",
        description: "Effective Young's modulus of the cables",
        range: POSITIVE,
        nominal: 1e10,
        field: |m, _| &mut m.parameters.youngs_modulus,
    },
    RealParameter {
        name: "cable_area",
        per_cable: false,
        reference: 114,
        unit: "m2",
        quantity: "Area",
        description: "Cross-section area of the cables",
        range: POSITIVE,
        nominal: 1e-4,
        field: |m, _| &mut m.parameters.cable_area,
    },
    RealParameter {
        name: "cable_damping",
        per_cable: false,
        reference: 115,
        unit: "N.s",
        quantity: "",
        description: "Damping of the cables: damping coefficient times unstretched length",
        range: POSITIVE,
        nominal: 1e4,
        field: |m, _| &mut m.parameters.cable_damping,
    },
    RealParameter {
        name: "relative_tolerance",
        per_cable: false,
        reference: 116,
        unit: "1",
        quantity: "",
        description: "Relative tolerance of the integrator; once changed it goes before the experiment's tolerance",
        range: (Some(1e-13), Some(1e-3)),
        nominal: 1e-8,
        field: |m, _| &mut m.relative_tolerance,
    },
];

const CABLE_MODELS: [CableModel; 3] = [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass];
const CABLE_INERTIAS: [CableInertia; 3] = [CableInertia::Paper, CableInertia::Reeled, CableInertia::None];
const INITIALIZATIONS: [Initialization; 3] =
    [Initialization::FromWinchForces, Initialization::FromStates, Initialization::StaticEquilibrium];

fn number<T: PartialEq>(values: &[T], value: &T) -> i32 {
    // The items are numbered from 1 in the order of these lists.
    (1..).zip(values).find(|(_, v)| *v == value).map_or(0, |(n, _)| n)
}

fn item<T: Copy>(values: &[T], number: i32) -> Option<T> {
    usize::try_from(number.checked_sub(1)?).ok().and_then(|k| values.get(k)).copied()
}

impl Choice {
    /// Name of the variable.
    pub(super) fn variable(self) -> &'static str {
        match self {
            Self::CableModel => "cable_model",
            Self::CableInertia => "cable_inertia",
            Self::Initialization => "initialization",
        }
    }

    /// The chosen item's number.
    pub(super) fn get(self, model: &Model) -> i32 {
        match self {
            Self::CableModel => number(&CABLE_MODELS, &model.parameters.cable_model),
            Self::CableInertia => number(&CABLE_INERTIAS, &model.parameters.cable_inertia),
            Self::Initialization => number(&INITIALIZATIONS, &model.start.initialization),
        }
    }

    /// Chooses the item with this number; `None` where there is none.
    pub(super) fn set(self, model: &mut Model, number: i32) -> Option<()> {
        match self {
            Self::CableModel => model.parameters.cable_model = item(&CABLE_MODELS, number)?,
            Self::CableInertia => model.parameters.cable_inertia = item(&CABLE_INERTIAS, number)?,
            Self::Initialization => model.start.initialization = item(&INITIALIZATIONS, number)?,
        }
        Some(())
    }
}

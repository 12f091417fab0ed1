//! What each effect of the catalogue is for discovery: how its signature is told, and what its picture is.
//!
//! Its columns, and how their amplitudes become parameters, are in [`candidates`](super::candidates); what laws of friction have
//! in common in [`friction`](super::friction).

/// How the signature of a law is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Told {
    /// By the rates of the plant that has it.
    Rates,
    /// By a winch force that only comes late.
    LateForce,
    /// By simulating the plant that has it.
    Simulation,
}

/// The picture that says how a law looks in the data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Picture {
    /// What a winch loses against its speed.
    WinchLoss,
    /// What a winch does with its command against that.
    WinchCommand,
    /// What is missing at a winch against the rate of its force.
    Late,
    /// The same against the acceleration of its cable.
    WinchInertia,
    /// What is missing against the speed of the platform, and against that through the air.
    LinearDrag,
    QuadraticDrag,
    /// The missing torque against the angular rate, and against the angular acceleration.
    RotationalDamping,
    Inertia,
    /// The missing force against the acceleration.
    Mass,
    /// The missing force along the wind, or its torque, against time.
    Wind,
    /// The missing force along the gust against time within its period.
    Gust,
    /// The missing force against the position.
    Spring,
    /// What is missing where a term acts against its variable.
    Term,
    /// No force stands for it: all such effects share one picture, of what was found together.
    Shared,
}

/// What an effect is for discovery.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Facts {
    pub(crate) id: &'static str,
    pub(crate) told: Told,
    /// Whether what it adds to the rates depends on the inputs, and not on states and time alone.
    pub(crate) by_inputs: bool,
    /// Whether sensors show other values of the same states with it though it is none of theirs.
    pub(crate) shifts_sensors: bool,
    /// Whether it is not in the equations of the plant but in when its inputs come.
    pub(crate) dead_time: bool,
    /// Size of a state of its own, where neither its stage nor its law says it.
    pub(crate) state_size: Option<f64>,
    /// Whether it is a force that enters the model as it is, so that its signature says all of it.
    pub(crate) enters_as_it_is: bool,
    pub(crate) picture: Picture,
}

/// What holds for most laws: one of the plant's rates, by states and time, without a picture of its own.
const fn law(id: &'static str) -> Facts {
    Facts {
        id,
        told: Told::Rates,
        by_inputs: false,
        shifts_sensors: false,
        dead_time: false,
        state_size: None,
        enters_as_it_is: false,
        picture: Picture::Shared,
    }
}

/// Every effect of the catalogue.
static FACTS: [Facts; 51] = [
    law("anchor_compliance"),
    Facts { shifts_sensors: true, ..law("anchor_offset") },
    Facts { shifts_sensors: true, ..law("attachment_offset") },
    law("cable_axial_mass"),
    law("cable_catenary"),
    Facts { state_size: Some(1e-3), ..law("cable_creep") },
    law("cable_damping"),
    law("cable_drag"),
    Facts { told: Told::Simulation, ..law("cable_elasticity") },
    law("cable_hysteresis"),
    law("cable_sag"),
    law("cable_stiffening"),
    law("cable_stiffness"),
    law("cable_thermal_expansion"),
    Facts { told: Told::Simulation, ..law("cable_transverse_mode") },
    law("cable_wind"),
    Facts { enters_as_it_is: true, picture: Picture::Term, ..law("expression") },
    law("length_sensor_bias"),
    law("length_sensor_scale"),
    Facts { enters_as_it_is: true, picture: Picture::Gust, ..law("periodic_gust") },
    law("platform_com_offset"),
    Facts { picture: Picture::Inertia, ..law("platform_inertia") },
    Facts { picture: Picture::LinearDrag, ..law("platform_linear_drag") },
    Facts { picture: Picture::Mass, ..law("platform_mass") },
    Facts { picture: Picture::QuadraticDrag, ..law("platform_quadratic_drag") },
    Facts { picture: Picture::RotationalDamping, ..law("platform_rotational_damping") },
    law("pose_sensor_bias"),
    law("pose_sensor_delay"),
    law("pose_sensor_frame"),
    law("pose_sensor_scale"),
    Facts { by_inputs: true, picture: Picture::WinchLoss, ..law("pulley_capstan_loss") },
    law("pulley_radius"),
    Facts { by_inputs: true, picture: Picture::WinchLoss, ..law("pulley_wrap_friction") },
    Facts { enters_as_it_is: true, picture: Picture::Wind, ..law("steady_wind") },
    law("tension_sensor_bias"),
    law("tension_sensor_gain"),
    Facts { picture: Picture::Spring, ..law("umbilical") },
    Facts { picture: Picture::WinchLoss, ..law("winch_coulomb_friction") },
    law("winch_dead_band"),
    Facts { told: Told::LateForce, dead_time: true, picture: Picture::Late, ..law("winch_delay") },
    law("winch_drum_eccentricity"),
    Facts { picture: Picture::WinchInertia, ..law("winch_drum_inertia") },
    law("winch_drum_layers"),
    Facts { picture: Picture::WinchCommand, ..law("winch_force_bias") },
    Facts { picture: Picture::WinchCommand, ..law("winch_force_gain") },
    Facts { told: Told::LateForce, picture: Picture::Late, ..law("winch_lag") },
    law("winch_power_limit"),
    Facts { picture: Picture::WinchCommand, ..law("winch_saturation") },
    Facts { picture: Picture::WinchLoss, ..law("winch_stribeck_friction") },
    law("winch_torque_ripple"),
    Facts { picture: Picture::WinchLoss, ..law("winch_viscous_friction") },
];

/// What an effect is for discovery; of one that the catalogue does not have what holds for most.
pub(crate) fn facts(id: &str) -> Facts {
    FACTS.iter().find(|facts| facts.id == id).copied().unwrap_or(law(""))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::CATALOGUE;
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Channel;
    use crate::data::recording::record;
    use crate::hypothesis::candidates::{Situation, catalogue};

    #[test]
    fn every_effect_of_the_catalogue_has_its_facts_and_no_other_has() {
        let mut ids: Vec<&str> = FACTS.iter().map(|facts| facts.id).collect();
        ids.sort_unstable();
        let mut catalogue: Vec<&str> = CATALOGUE.iter().map(|info| info.id).collect();
        catalogue.sort_unstable();
        assert_eq!(ids, catalogue);
    }

    /// Effects that are not looked for, and why.
    const NOT_SOUGHT: [(&str, &str); 11] = [
        (
            "anchor_compliance",
            "at lengths that change little it is an error of the cable's stiffness, from which it is reached",
        ),
        ("cable_catenary", "to first order in the sag it is the parabola, which is looked for"),
        ("cable_wind", "at poses near each other it is a steady wind or drag in wind, from which it is reached"),
        ("pulley_radius", "to first order in the angle it is an anchor off across its cable, from which it is reached"),
        ("pulley_wrap_friction", "to first order it is the capstan loss, as whose form it is tried"),
        (
            "winch_dead_band",
            "what it holds back depends on the turns of the whole command, not in proportion to the band; lag and bias are looked for",
        ),
        (
            "winch_drum_layers",
            "over lengths that change little it is the scale of a length sensor, which is looked for",
        ),
        ("winch_power_limit", "where it is reached it is a limit of the force, which is looked for"),
        (
            "winch_torque_ripple",
            "waves along the paid-out length are found in the spectrum, as terms that get its name",
        ),
        ("cable_elasticity", "another base model, which `discover` tries as such"),
        ("expression", "the dictionary of terms"),
    ];

    #[test]
    fn every_effect_has_a_candidate_or_a_reason() {
        let mut trial = record(&[], 5.0, 1);
        trial.channels.extend((0..4).map(Channel::Tension));
        let mut situation = Situation::of(&[trial]);
        situation.peaks.push(1.0);
        let library = catalogue(&Model::default(), &situation);
        for info in CATALOGUE {
            let sought = library.candidates.iter().any(|c| c.id == info.id);
            let reason = NOT_SOUGHT.iter().find(|(id, _)| *id == info.id);
            assert!(sought != reason.is_some(), "{}: sought is {sought}, reason {reason:?}", info.id);
        }
    }
}

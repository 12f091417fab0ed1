//! Effects that correct a number which the model gives, and how much of it they may take away.
//!
//! Likelihood alone would take anything: where friction eats the forces, forces that do next to nothing follow a slow machine
//! as well, and so does one without mass. These are no corrections of the machine that was described.

use cdpr::effect::{EffectSpec, ParameterInfo, Site};

use crate::model::sizes::Sizes;

/// Share of what the model gives that a correction of it leaves at least: a third. Whoever writes down a force, a mass or a
/// stiffness knows it better than by a factor of three; where data ask for less, another law is missing.
const LEAST_LEFT: f64 = 1.0 / 3.0;
/// How many times what is met in practice the scale of a pose may be off at most: who measures a pose has a ruler. A drive whose friction
/// was missing had positions that were 11 % too large, which does to a motion along a line what 10 % less mass does.
const MOST_OFF: f64 = 10.0;

/// The smallest size that a parameter has as the law that it is of, for a robot of these sizes.
pub(crate) fn smallest(parameter: &ParameterInfo, sizes: &Sizes) -> f64 {
    if parameter.shape || parameter.extension {
        return parameter.min;
    }
    let most = LEAST_LEFT - 1.0;
    // What is known so badly that more of it is missing in practice may go as far as that.
    let smallest = match parameter.unit {
        "1" if (-1.0..0.0).contains(&parameter.min) => most.min(parameter.typical.0),
        unit if parameter.min == f64::NEG_INFINITY => {
            sizes.of_unit(unit).map_or(f64::NEG_INFINITY, |given| most * given)
        }
        _ => f64::NEG_INFINITY,
    };
    smallest.max(parameter.min)
}

/// Whether an effect leaves enough of every number that it corrects, and of the scale of a pose nearly all.
pub(crate) fn leaves_enough(effect: &EffectSpec, sizes: &Sizes) -> bool {
    let Ok(info) = effect.info() else { return true };
    let corrects = |parameter: &ParameterInfo| smallest(parameter, sizes) > parameter.min;
    let in_scale = |parameter: &ParameterInfo, value: f64| {
        info.site != Site::PoseSensor || parameter.unit != "1" || value.abs() <= MOST_OFF * parameter.typical.1
    };
    let enough = |p: &ParameterInfo, value: f64| in_scale(p, value) && (!corrects(p) || value > smallest(p, sizes));
    info.parameters.iter().zip(&effect.values).all(|(p, value)| enough(p, *value))
}

#[cfg(test)]
mod tests {
    use cdpr::parameters::Parameters;

    use super::*;

    fn leaves(id: &str, cable: Option<usize>, value: f64) -> bool {
        let effect = EffectSpec::new(id, cable, &[value]).expect("an effect");
        leaves_enough(&effect, &Sizes::of(&Parameters::default()))
    }

    #[test]
    fn a_third_is_left_of_what_a_model_gives() {
        let mass = Parameters::default().platform_mass;
        for (value, enough) in [(-0.6, true), (-0.7, false), (3.0, true)] {
            assert_eq!(leaves("winch_force_gain", Some(2), value), enough, "a gain of {value}");
            assert_eq!(leaves("cable_stiffness", None, value), enough, "a stiffness of {value}");
            assert_eq!(leaves("platform_mass", None, value * mass), enough, "a mass of {value}");
        }
        // Of the damping of a cable nine tenths may be missing in practice, which its catalogue entry says.
        assert!(leaves("cable_damping", None, -0.85) && !leaves("cable_damping", None, -0.95));
    }

    #[test]
    fn a_pose_is_measured_in_metres() {
        for (value, enough) in [(0.01, true), (-0.01, true), (0.1, false), (-0.1, false)] {
            assert_eq!(leaves("pose_sensor_scale", None, value), enough, "{value}");
        }
    }

    #[test]
    fn what_corrects_nothing_is_as_large_as_it_likes() {
        assert!(leaves("winch_force_bias", None, -1e6) && leaves("winch_drum_inertia", None, 0.0));
        assert!(leaves("length_sensor_scale", Some(1), -0.4) && leaves("winch_viscous_friction", Some(1), 1e9));
    }
}

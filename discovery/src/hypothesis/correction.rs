//! Effects that correct a number which the model gives, and how much of it they may take away.
//!
//! Likelihood alone would take anything: where friction eats the forces, forces that do next to nothing follow a slow machine
//! as well, and so does one without mass. These are no corrections of the machine that was described.

use cdpr::effect::{EffectSpec, ParameterInfo};

use crate::model::sizes::Sizes;

/// Share of what the model gives that a correction of it leaves at least: a third. Whoever writes down a force, a mass or a
/// stiffness knows it better than by a factor of three; where data ask for less, another law is missing.
const LEAST_LEFT: f64 = 1.0 / 3.0;

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

/// Whether an effect leaves enough of every number that it corrects.
pub(crate) fn leaves_enough(effect: &EffectSpec, sizes: &Sizes) -> bool {
    let Ok(info) = effect.info() else { return true };
    let corrects = |parameter: &ParameterInfo| smallest(parameter, sizes) > parameter.min;
    info.parameters.iter().zip(&effect.values).all(|(p, value)| !corrects(p) || *value > smallest(p, sizes))
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
    fn what_corrects_nothing_is_as_large_as_it_likes() {
        assert!(leaves("winch_force_bias", None, -1e6) && leaves("winch_drum_inertia", None, 0.0));
        assert!(leaves("length_sensor_scale", Some(1), -0.4) && leaves("winch_viscous_friction", Some(1), 1e9));
    }
}

//! Eccentric drum: l = s - e (cos(s/r + ψ) - cos ψ) where the encoder has counted s.

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::length_sensor::Drum;
use crate::winch::WinchCommand;

/// Eccentric drum: l = s - e (cos(s/r + ψ) - cos ψ) where the encoder has counted s.
///
/// The encoder counts the drum's angle θ as `s = r θ`. The cable leaves at the lever `r + e sin(θ + ψ)`, so the paid-out length is the
/// sum of that over the angle. What is measured is `s`: a wave around the true length, and around its rate. The winch's angle turns
/// with `s` as well. It acts on the sensors and starts alone: winches that are told a force pull with it whatever the lever.
///
/// Shows in: a wave of the measured unstretched length along the length, one period a turn of the drum.
///
/// Valid for: winches commanded by force; layers on the drum are another effect. A torque would find the lever in its force, and a servo would follow
/// its encoder; with those commands the effect is refused.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (winch transmission); the lever summed over the angle.
#[derive(Clone, Debug)]
pub struct WinchDrumEccentricity {
    eccentricity: f64,
    radius: f64,
    phase: f64,
}

impl Effect for WinchDrumEccentricity {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_drum_eccentricity",
        title: "Drum eccentricity",
        equation: "l = s - e (cos(s/r + ψ) - cos ψ), s measured",
        law: |v, n| format!("l = s - {} (cos(s/{} + {}) - cos {})", n(v[0]), n(v[1]), n(v[2]), n(v[2])),
        scope: Scope::EachCable,
        site: Site::LengthSensor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("eccentricity", "m", "distance e of the drum's axis from its centre, less than half its radius", (-5e-3, 5e-3)),
            parameter("drum_radius", "m", "radius r of the drum", (0.05, 0.5)).at_least(1e-6).shape(),
            parameter("phase", "rad", "phase ψ with nothing paid out", (-3.2, 3.2)).shape(),
        ],
        texts: &[],
        shows_in: "a wave of the measured unstretched length along the length, one period a turn of the drum",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (winch transmission); the lever summed over the angle",
        validity: "winches commanded by force",
        look_alikes: &[
            LookAlike { id: "length_sensor_scale", separate_by: "a range of lengths over several turns of the drum" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [eccentricity, radius, phase] = spec.values[..] else { unreachable!("as many values as parameters") };
        if eccentricity.abs() >= 0.5 * radius {
            let message = format!("`eccentricity` is {eccentricity} m, expected less than half of `drum_radius` ({radius} m)");
            return Err(SpecError::new(&spec.id, message));
        }
        Ok(Self { eccentricity, radius, phase })
    }

    fn check_command(&self, command: WinchCommand) -> Result<(), String> {
        if command != WinchCommand::Force {
            return Err(format!("takes winches commanded by force, found {}", command.name()));
        }
        Ok(())
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn drum(&self, drum: &mut Drum) {
        let Self { eccentricity, radius, phase } = *self;
        *drum = Drum { eccentricity, radius, phase, ..*drum };
    }
}

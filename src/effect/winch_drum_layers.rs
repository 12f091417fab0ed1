//! Layers on the drum: l = s - d s²/(4π n r²) where the encoder has counted s.

use std::f64::consts::TAU;

use super::{DependsOn, Effect, EffectInfo, EffectSpec, LookAlike, Scope, Site, SpecError, Stage, parameter};
use crate::length_sensor::Drum;
use crate::winch::WinchCommand;

/// Layers on the drum: l = s - d s²/(4π n r²) where the encoder has counted s.
///
/// A cable of diameter `d` winds up `n` turns to a layer, each layer on the one before. What a metre of cable takes of the wound
/// cross-section is the same wherever it lies, so the radius falls by `d/(2π n)` a radian: from `r` with nothing paid out to
/// `r - d θ/(2π n)`, and what is paid out is the sum of that over the angle. The encoder counts `s = r θ`: it shows more than is paid
/// out, the more so the longer the cable. The winch's angle turns with `s` as well. It acts on the sensors and starts alone: winches
/// that are told a force pull with it whatever the lever.
///
/// Shows in: the measured unstretched length grows faster than the true one, with its square.
///
/// Valid for: winches commanded by force; many layers, or one that winds up like a tape (`n` = 1), the step from layer to layer spread
/// over its turns. A torque would find the lever in its force, and a servo would follow its encoder; with those commands the effect is
/// refused.
///
/// Source: A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (winch transmission); the cross-section kept as it winds.
#[derive(Clone, Debug)]
pub struct WinchDrumLayers {
    /// Share of its radius that the drum loses with each metre counted (1/m).
    shrink: f64,
}

impl Effect for WinchDrumLayers {
    const INFO: EffectInfo = EffectInfo {
        id: "winch_drum_layers",
        title: "Layers on the drum",
        equation: "l = s - d s²/(4π n r²), s measured",
        law: |v, n| format!("l = s - {} s²/(4π {} {}²)", n(v[0]), n(v[1]), n(v[2])),
        scope: Scope::EachCable,
        site: Site::LengthSensor,
        depends_on: &[DependsOn::Position],
        parameters: &[
            parameter("cable_diameter", "m", "diameter d of the cable as it lies on the drum", (1e-3, 5e-3)).at_least(0.0),
            parameter("turns", "1", "turns n of the cable in a layer", (20.0, 100.0)).at_least(1e-3).shape(),
            parameter("drum_radius", "m", "radius r at which the cable leaves with nothing paid out", (0.5, 1.0)).at_least(1e-6).shape(),
        ],
        texts: &[],
        shows_in: "the measured unstretched length grows faster than the true one, with its square",
        source: "A. Pott, Cable-Driven Parallel Robots: Theory and Application, 2018 (winch transmission); the cross-section kept as it winds",
        validity: "winches commanded by force; many layers, the step from layer to layer spread over its turns",
        look_alikes: &[
            LookAlike { id: "length_sensor_scale", separate_by: "a range of lengths over which the drum changes: short and long cables" },
        ],
    };

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let [diameter, turns, radius] = spec.values[..] else { unreachable!("as many values as parameters") };
        Ok(Self { shrink: diameter / (TAU * turns * radius * radius) })
    }

    fn check_command(&self, command: WinchCommand) -> Result<(), String> {
        if command != WinchCommand::Force {
            return Err(format!("takes winches commanded by force, found {}", command.name()));
        }
        Ok(())
    }

    fn check_length(&self, longest: f64) -> Result<(), String> {
        // What is counted as the radius comes to nothing, and half of that is paid out.
        let held = 0.5 / self.shrink;
        if held <= longest {
            return Err(format!("leaves {held:.6} m of cable on the drum, expected more than the {longest:.6} m that it may have to pay out"));
        }
        Ok(())
    }

    fn stage(&self) -> Stage {
        Stage::Sensor
    }

    fn drum(&self, drum: &mut Drum) {
        drum.shrink = self.shrink;
    }
}

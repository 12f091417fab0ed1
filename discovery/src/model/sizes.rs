//! Sizes of the robot under examination and of its recordings, from which starts, steps and bounds follow.

use std::f64::consts::TAU;

use cdpr::dynamics::PlantData;
use cdpr::parameters::Parameters;

use crate::data::Trial;

/// Sizes of a robot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    /// How far the anchors are from the middle (m).
    pub(crate) reach: f64,
    /// Lever of the cables' forces about the platform's reference point (m).
    pub(crate) arm: f64,
    /// Mass of the platform (kg).
    pub(crate) mass: f64,
    /// Moment of inertia of the platform (kg m²).
    pub(crate) inertia: f64,
    /// Mass that swings at a winch on its cable (kg).
    pub(crate) winch_mass: f64,
    /// Radius of the drums, their mean (m).
    pub(crate) drum_radius: f64,
    /// Period in which the platform swings on cables of fixed length (s).
    pub(crate) swing: f64,
}

impl Sizes {
    pub(crate) fn of(parameters: &Parameters) -> Self {
        Self::of_plant(&PlantData::new(parameters))
    }

    pub(crate) fn of_plant(data: &PlantData) -> Self {
        let geometry = &data.geometry;
        let lengths = cdpr::kinematics::cable_lengths(geometry, &[0.0; 3]);
        let cables = || data.cables.iter().zip(&lengths);
        let count = lengths.len() as f64;
        // Each cable stiffens one direction of two, as a mean over its directions.
        let stiffness: f64 = cables().map(|(cable, length)| 0.5 * cable.axial_stiffness / length).sum();
        let carried: f64 = cables().map(|(cable, length)| cable.density * length / 3.0).sum();
        Self {
            reach: geometry.size(),
            arm: geometry.attachment_scale(),
            mass: data.mass,
            inertia: data.inertia,
            winch_mass: cables().map(|(cable, length)| 0.5 * cable.density * length + cable.drum_mass).sum::<f64>()
                / count,
            drum_radius: cables().map(|(cable, _)| cable.winch.drum_radius).sum::<f64>() / count,
            swing: TAU * ((data.mass + carried) / stiffness).sqrt(),
        }
    }

    /// Size of a parameter by its unit, where that says it: what a robot has of it itself.
    pub(crate) fn of_unit(&self, unit: &str) -> Option<f64> {
        match unit {
            "kg" => Some(self.mass),
            "kg.m2" => Some(self.inertia),
            _ => None,
        }
    }
}

/// Winch force (N) below which nothing is driven.
const NO_FORCE: f64 = 1e-3;

/// Mean size of the winch forces of some recordings (N).
pub(crate) fn usual_force(trials: &[Trial]) -> f64 {
    let forces = || trials.iter().flat_map(|trial| &trial.inputs).flat_map(|inputs| inputs.winch_force);
    let count = forces().count().max(1);
    (forces().map(f64::abs).sum::<f64>() / count as f64).max(NO_FORCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::Bench;

    #[test]
    fn a_platform_swings_as_fast_as_its_cables_are_stiff() {
        let large = Sizes::of(&Bench::large().parameters);
        assert!((large.swing - 1.795).abs() < 0.01, "{large:?}");
        assert!((large.reach - 900.0).abs() < 1e-9 && (large.arm - 10.0).abs() < 1e-9, "{large:?}");
        let small = Sizes::of(&Bench::laboratory().parameters);
        assert!(small.swing < 0.1 && small.arm < 0.21, "{small:?}");
    }
}

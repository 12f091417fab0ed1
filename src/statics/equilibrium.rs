//! The pose at rest with locked winches.

use nalgebra::{Matrix3, Vector3};

use super::StaticsError;
use super::stiffness::{effect_stiffness, elastic_stiffness, geometric_stiffness, tension_and_slope};
use crate::dynamics::MAX_EFFECT_STATES;
use crate::inverse::wrench::{Prescribed, required};
use crate::kinematics;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;

/// The platform at rest on cables of given unstretched lengths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LockedEquilibrium {
    /// Pose `[x, y, φ]` (m, rad).
    pub pose: [f64; 3],
    /// Tensions (N), zero in a slack cable.
    pub tension: PerCable<f64>,
    /// Stiffness of the platform there.
    pub stiffness: Matrix3<f64>,
}

/// Tension (N) and its slope over the length (N/m) of a cable that has rested long, creep settled.
fn settled(plant: &Plant, cable: usize, time: f64, length: f64, unstretched: f64) -> (f64, f64) {
    let at = |guess: f64| {
        let mut states = [0.0; MAX_EFFECT_STATES];
        plant.start_effect_states(cable, 0.0, guess, &mut states);
        tension_and_slope(plant, cable, time, length, unstretched, &states)
    };
    let (first, slope) = at(0.0);
    if first <= 0.0 {
        return (0.0, 0.0);
    }
    if plant.cable[cable].law.iter().all(|(kind, _)| kind.states() == 0) {
        return (first, slope);
    }
    // Creep only relaxes: the settled tension is below the one without it, where guess and tension agree.
    let (mut low, mut high) = (0.0, first);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if at(middle).0 > middle {
            low = middle;
        } else {
            high = middle;
        }
    }
    let tension = 0.5 * (low + high);
    (tension, at(tension).1)
}

/// The pose at rest near `guess` (m, rad) with locked winches: the cables have the unstretched lengths `unstretched` (m),
/// and `disturbance` `[f_x, f_y, τ]` (N, N m) acts. Newton's method with step limits; creep has settled.
///
/// # Errors
/// Rigid cables; a search that leaves the anchors, meets a singular stiffness (too many slack cables) or does not settle.
pub fn locked_equilibrium(
    plant: &Plant,
    time: f64,
    unstretched: &PerCable<f64>,
    disturbance: &[f64; 3],
    guess: [f64; 3],
) -> Result<LockedEquilibrium, StaticsError> {
    let plant = plant.at(time);
    if plant.data().cables.iter().any(|c| c.model == CableModel::Rigid) {
        return Err(StaticsError::Rigid);
    }
    let geometry = plant.geometry();
    let arm = geometry.attachment_scale();
    let state = |pose: [f64; 3]| {
        let at_rest = Prescribed { time, pose, twist: [0.0; 3], acceleration: [0.0; 3], disturbance: *disturbance };
        let cables = kinematics::cables(geometry, &pose, &[0.0; 3]);
        let mut wrench = Vector3::from(required(plant, &at_rest, &cables)) * -1.0;
        let mut tension = PerCable::filled(plant.cables(), 0.0);
        let mut axial = tension;
        for i in 0..plant.cables() {
            (tension[i], axial[i]) = settled(plant, i, time, cables[i].length, unstretched[i]);
            wrench -= Vector3::from(cables[i].jacobian_row()) * tension[i];
        }
        let stiffness = geometric_stiffness(geometry, &pose, &tension)
            + elastic_stiffness(geometry, &pose, &axial)
            + effect_stiffness(plant, time, &pose);
        (wrench, tension, stiffness)
    };
    let size = |w: &Vector3<f64>| w[0].abs().max(w[1].abs()).max(w[2].abs() / arm);
    let mut pose = guess;
    let (mut wrench, mut tension, mut stiffness) = state(pose);
    let fail =
        |reason, pose, wrench: Vector3<f64>| StaticsError::NoEquilibrium { reason, pose, unbalanced: wrench.into() };
    for _ in 0..200 {
        let force = tension.iter().chain(disturbance).fold(1.0_f64, |a, b| a.max(b.abs()));
        let Some(step) = stiffness.lu().solve(&wrench) else {
            return Err(fail("the stiffness is singular", pose, wrench));
        };
        let length = step[0].abs().max(step[1].abs()).max(step[2].abs() * arm);
        if !length.is_finite() {
            return Err(fail("the stiffness is singular", pose, wrench));
        }
        if size(&wrench) <= 1e-10 * force && length < 1e-9 * geometry.size() {
            return Ok(LockedEquilibrium { pose, tension, stiffness });
        }
        // At most the platform's arm in one step, and less while the balance does not improve.
        let mut factor = (arm / length).min(1.0);
        loop {
            let next: [f64; 3] = std::array::from_fn(|k| pose[k] + factor * step[k]);
            let trial = (geometry.check_pose(&next).is_ok()).then(|| state(next));
            match trial {
                Some(found) if size(&found.0) < size(&wrench) || factor < 1e-3 || length < 1e-9 * geometry.size() => {
                    pose = next;
                    (wrench, tension, stiffness) = found;
                    break;
                }
                None if factor < 1e-3 => {
                    return Err(fail("the search leaves the space between the anchors", pose, wrench));
                }
                _ => factor *= 0.5,
            }
        }
    }
    Err(fail("the search does not settle", pose, wrench))
}

//! Statements on geometry, Jacobian and equilibrium: sections II and III.C.1.

use crate::CABLES;
use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{TensionLine, structure_matrix};
use cdpr::kinematics;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::simulation::wrench_at_rest;
use cdpr::statics::geometric_stiffness;
use nalgebra::SVector;

use super::{Claim, decide, largest, only_if, plant};
use crate::run::{Area, FORCE};
use crate::{PaperError, Runs};

pub(super) fn claims(runs: &Runs) -> Result<Vec<Claim>, PaperError> {
    Ok(vec![crossed_cables(), redundancy()?, position()?, transposed_jacobian(runs), equilibrium()?])
}

/// Smallest singular value of `J_M` with torques divided by the arm.
fn smallest_singular_value(parameters: &Parameters) -> f64 {
    let mut jacobian = kinematics::jacobian(&Geometry::new(parameters), &[0.0; 3]);
    jacobian.column_mut(2).scale_mut(1.0 / parameters.attachment_radius);
    jacobian.singular_values().min()
}

fn crossed_cables() -> Claim {
    let crossed = Parameters::default();
    let straight = Parameters { attachment_angle: crossed.anchor_angle, ..crossed.clone() };
    let (a, b) = (smallest_singular_value(&crossed), smallest_singular_value(&straight));
    Claim {
        place: "II",
        statement: "the cables are crossed in order to avoid singularities at the central position",
        found: format!("smallest singular value of J_M at the centre: {a:.3} crossed, {b:.3} with radial cables"),
        verdict: decide(a > 0.1 && b < 1e-9),
    }
}

fn redundancy() -> Result<Claim, PaperError> {
    let structure = structure_matrix(&Geometry::new(&Parameters::default()), &[0.0; 3]);
    let line = TensionLine::of(&structure, &[0.0; 3]).map_err(PaperError::model)?;
    let least = line.internal.iter().copied().fold(f64::INFINITY, f64::min);
    Ok(Claim {
        place: "II, IV",
        statement: "three degrees of freedom with one degree of redundancy, in tension throughout",
        found: format!("rank 3; unit internal tension at the centre {:.3} in every cable", least),
        verdict: decide(least > 0.0),
    })
}

/// Poses about the middle of the workspace, and one far out.
const POSES: [[f64; 3]; 4] = [[0.0; 3], [40.0, -25.0, 0.3], [-150.0, 90.0, -0.2], [300.0, 200.0, 0.1]];

fn position() -> Result<Claim, PaperError> {
    let geometry = Geometry::new(&Parameters::default());
    let mut miss = 0.0_f64;
    for pose in POSES {
        let lengths = kinematics::cable_lengths(&geometry, &pose);
        let found = kinematics::forward_kinematics(&geometry, &lengths, [0.0; 3], 1e-6).map_err(PaperError::model)?;
        miss = (0..3).map(|k| (found[k] - pose[k]).abs()).fold(miss, f64::max);
    }
    Ok(Claim {
        place: "II.A",
        statement: "limb lengths and limb angles are uniquely determined by the pose",
        found: format!(
            "(4) and (5) are explicit; the other way round, four lengths lead from the centre back to the pose within \
             {miss:.0e} (m, rad), at {} poses out to 360 m",
            POSES.len()
        ),
        verdict: decide(miss < 1e-6),
    })
}

/// `J_M` as the map from forces to wrenches: power balance at rest, and what the cables' inertia adds in motion.
fn transposed_jacobian(runs: &Runs) -> Claim {
    let geometry = Geometry::new(&Parameters::default());
    let (twist, tension) = (SVector::<f64, 3>::new(0.5, -0.3, 0.02), SVector::<f64, CABLES>::new(1e3, 2e3, 3e3, 4e3));
    let unbalanced = POSES.map(|pose| {
        let speed = kinematics::jacobian(&geometry, &pose) * twist;
        let wrench = structure_matrix(&geometry, &pose) * tension;
        (wrench.dot(&twist) + tension.dot(&speed)) / tension.abs().dot(&speed.abs())
    });
    let unbalanced = largest(unbalanced.into_iter());
    let instants = &runs.inverse_rigid.instants;
    let inertia = largest(instants.iter().flat_map(|at| (0..CABLES).map(move |i| at.winch_force[i] - at.tension[i])));
    Claim {
        place: "II.B",
        statement: "J_M also gives the actuator forces from the forces on the platform",
        found: format!(
            "the power of tensions and of the wrench A T, A = -J_Mᵀ, agree to {unbalanced:.0e}; by (23) winch force and \
             tension differ by the cable's inertia, up to {inertia:.1} N in the inverse dynamics simulation"
        ),
        verdict: only_if(unbalanced < 1e-12, inertia < 1e-9, "the inertia of the cables is added, (23)"),
    }
}

fn equilibrium() -> Result<Claim, PaperError> {
    let plant = plant(Area::Physical, CableModel::Rigid)?;
    let inputs = Inputs { winch_force: [FORCE; CABLES].into(), disturbance: [0.0; 3] };
    let left = largest(wrench_at_rest(&plant, 0.0, [0.0; 3], &inputs).into_iter());
    let k = geometric_stiffness(plant.geometry(), &[0.0; 3], &inputs.winch_force);
    Ok(Claim {
        place: "III.C.1",
        statement: "X = [0, 0, 0] is the equilibrium under four equal forces",
        found: format!(
            "at 1 kN each {left:.0e} N and N m are left there; its stiffness is {:.2} N/m in x, {:.2} N/m in y and {:.0} N \
             m/rad in φ, so it is unstable in φ",
            k[(0, 0)],
            k[(1, 1)],
            k[(2, 2)]
        ),
        verdict: decide(left < 1e-6),
    })
}

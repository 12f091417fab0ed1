//! The wrench that the cables' tensions must exert for a prescribed motion.

use crate::dynamics::Inputs;
use crate::dynamics::matrix3;
use crate::effect::{EffectKind, PlatformContext};
use crate::geometry::Geometry;
use crate::kinematics::CableKinematics;
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

/// Pose, twist and acceleration of the platform, disturbance and time, as values or with derivatives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prescribed<S> {
    pub(crate) time: S,
    pub(crate) pose: [S; 3],
    pub(crate) twist: [S; 3],
    pub(crate) acceleration: [S; 3],
    pub(crate) disturbance: [S; 3],
}

impl<S: Real> Prescribed<S> {
    /// What platform-side effects see under the motion, from length and rate of the chords and of what is paid out.
    pub(crate) fn context<'a>(
        &'a self,
        geometry: &'a Geometry,
        inputs: &'a Inputs<S>,
        [cable_length, cable_speed]: [&'a PerCable<S>; 2],
        [unstretched_length, unstretched_rate]: [&'a PerCable<S>; 2],
    ) -> PlatformContext<'a, S> {
        PlatformContext {
            time: self.time,
            geometry,
            pose: &self.pose,
            twist: &self.twist,
            inputs,
            cable_length,
            cable_speed,
            unstretched_length,
            unstretched_rate,
        }
    }
}

/// `A T` for the prescribed motion (26), (27): the platform's inertia, less disturbance, effects and the cables' transverse
/// forces (22), (25).
pub(crate) fn required<S: Real>(plant: &Plant, p: &Prescribed<S>, cables: &PerCable<CableKinematics<S>>) -> [S; 3] {
    let data = plant.data();
    let omega = p.twist[2];
    let rotation = [p.pose[2].cos(), p.pose[2].sin()];
    // Effects on the platform that the inverse problem admits see neither winch forces nor unstretched lengths.
    let inputs = Inputs { winch_force: cables.map(|_| S::from(0.0)), disturbance: p.disturbance };
    let (lengths, speeds) = (cables.map(|c| c.length), cables.map(|c| c.speed));
    let context = p.context(&data.geometry, &inputs, [&lengths, &speeds], [&lengths, &speeds]);
    let (own, applied) = (plant.own_load(rotation, omega), plant.applied_wrench(&context));
    let mut wrench = matrix3::product(&plant.platform_mass(rotation).full(), &p.acceleration);
    for k in 0..3 {
        wrench[k] -= own[k] + applied[k];
    }
    for (i, k) in cables.iter().enumerate() {
        // Q = -ρ/3 (f² α̈ + 3 f ḟ α̇), f the straight part.
        let density = data.cables[i].straight_density + data.cables[i].swinging_density;
        let still = |sum, kind: &EffectKind| sum + kind.transverse_force(k.span, k.angular_rate);
        let across = k.span * k.acceleration_across(&p.acceleration, omega) * density;
        let q = plant.cable[i].transverse.iter().fold(-across, still);
        let along = k.length * data.cables[i].end_density * k.length_acceleration(&p.acceleration, omega);
        let (row, normal) = (k.jacobian_row(), k.normal_row());
        for c in 0..3 {
            wrench[c] += along * row[c] - q * normal[c];
        }
    }
    wrench
}

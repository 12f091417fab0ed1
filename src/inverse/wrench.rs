//! The wrench that the cables' tensions must exert for a prescribed motion.

use crate::dynamics::Inputs;
use crate::dynamics::matrix3;
use crate::effect::PlatformContext;
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

/// Kinematics of the cables and their length accelerations (12).
pub(crate) fn cable_motion<S: Real>(plant: &Plant, p: &Prescribed<S>) -> (PerCable<CableKinematics<S>>, PerCable<S>) {
    let cables = crate::kinematics::cables(plant.geometry(), &p.pose, &p.twist);
    let accelerations =
        cables.map(|c| matrix3::dot(&c.jacobian_row(), &p.acceleration) + c.length_acceleration_bias(p.twist[2]));
    (cables, accelerations)
}

/// What platform-side effects see under a prescribed motion.
pub(crate) struct Context<'a, S> {
    pub(crate) geometry: &'a Geometry,
    pub(crate) inputs: Inputs<S>,
    pub(crate) length: PerCable<S>,
    pub(crate) speed: PerCable<S>,
    pub(crate) unstretched: PerCable<S>,
    pub(crate) unstretched_rate: PerCable<S>,
    pub(crate) motion: &'a Prescribed<S>,
}

impl<S: Real> Context<'_, S> {
    pub(crate) fn view(&self) -> PlatformContext<'_, S> {
        PlatformContext {
            time: self.motion.time,
            geometry: self.geometry,
            pose: &self.motion.pose,
            twist: &self.motion.twist,
            inputs: &self.inputs,
            cable_length: &self.length,
            cable_speed: &self.speed,
            unstretched_length: &self.unstretched,
            unstretched_rate: &self.unstretched_rate,
        }
    }
}

/// `A T` for the prescribed motion (26), (27): the platform's inertia, less disturbance, effects and the cables' transverse
/// forces (22), (25).
pub(crate) fn required<S: Real>(plant: &Plant, p: &Prescribed<S>, cables: &PerCable<CableKinematics<S>>) -> [S; 3] {
    let data = plant.data();
    let omega = p.twist[2];
    let rotation = [p.pose[2].cos(), p.pose[2].sin()];
    let mut wrench = matrix3::product(&plant.platform_mass(rotation).full(), &p.acceleration);
    let [cx, cy] = plant.com_arm(rotation);
    let centrifugal = omega * omega * data.mass;
    wrench[0] -= centrifugal * cx;
    wrench[1] -= centrifugal * cy;
    let weight = plant.weight(rotation);
    for k in 0..3 {
        wrench[k] -= p.disturbance[k] + weight[k];
    }
    // Effects on the platform that the inverse problem admits see neither winch forces nor unstretched lengths.
    let zero = PerCable::filled(plant.cables(), S::from(0.0));
    let context = Context {
        geometry: &data.geometry,
        inputs: Inputs { winch_force: zero, disturbance: p.disturbance },
        length: cables.map(|c| c.length),
        speed: cables.map(|c| c.speed),
        unstretched: cables.map(|c| c.length),
        unstretched_rate: cables.map(|c| c.speed),
        motion: p,
    };
    for kind in &plant.wrench {
        let force = kind.wrench(&context.view());
        for k in 0..3 {
            wrench[k] -= force[k];
        }
    }
    for i in 0..plant.cables() {
        let k = &cables[i];
        let normal = k.normal_row();
        // f α̈ (14) and Q = -ρ/3 (f² α̈ + 3 f ḟ α̇), f the straight part.
        let turning = matrix3::dot(&normal, &p.acceleration) + k.normal_acceleration_bias(omega);
        let density = data.cables[i].straight_density + data.cables[i].swinging_density;
        let mut q = -(k.span * (turning + k.span_rate() * k.angular_rate * 3.0)) * density;
        for kind in &plant.cable[i].transverse {
            q += kind.transverse_force(k.span, k.angular_rate);
        }
        let row = k.jacobian_row();
        let end = k.length * data.cables[i].end_density;
        let along = end * (matrix3::dot(&row, &p.acceleration) + k.length_acceleration_bias(omega));
        for c in 0..3 {
            wrench[c] += along * row[c] - q * normal[c];
        }
    }
    wrench
}

//! Everything known of the plant at one instant, solved for the accelerations.

use crate::effect::{PlatformContext, WinchContext};
use crate::kinematics::CableKinematics;
use crate::parameters::{CABLES, CableModel};
use crate::plant::Plant;
use crate::scalar::Real;

use super::matrix3::{self, Matrix3};
use super::{Inputs, MAX_EFFECT_STATES, elastic};

/// The plant at one instant: kinematics, tensions, accelerations.
///
/// Made by [`Plant::evaluate`]. Units: m, s, N, rad.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<S = f64> {
    /// Kinematics of the cables.
    pub kinematics: [CableKinematics<S>; CABLES],
    /// Accelerations `[ax, ay, φ̈]`.
    pub acceleration: [S; 3],
    /// Tensions `T_i`, zero where the cable is slack.
    pub tension: [S; CABLES],
    /// The tension before it is cut off at zero: negative where the cable is slack.
    pub tension_uncut: [S; CABLES],
    /// Pull of the winch on its cable, effects included.
    pub pull: [S; CABLES],
    /// Unstretched lengths `l_i` (in a rigid cable its length).
    pub unstretched: [S; CABLES],
    /// Rates `l̇_i`.
    pub unstretched_rate: [S; CABLES],
    /// Accelerations `l̈_i`; not defined by `massless_spring`, where it is that of the length.
    pub unstretched_acceleration: [S; CABLES],
    /// Rates of the effect states of each cable.
    pub effect_rate: [[S; MAX_EFFECT_STATES]; CABLES],
    /// Mass matrix of the platform with the cables' inertia that moves with it.
    pub(crate) mass: Matrix3<S>,
    /// Axial mass (kg) of each cable where tension depends on the acceleration (rigid, massless spring).
    pub(crate) platform_axial_mass: [S; CABLES],
}

/// The winch's pull on one cable, and the rates of its command states.
#[inline]
pub(crate) fn winch_pull<S: Real>(
    plant: &Plant,
    cable: usize,
    command: S,
    context: &WinchContext<S>,
    states: &[S],
    rates: &mut [S],
) -> S {
    let effects = &plant.cable[cable];
    let mut force = command;
    for (kind, at) in &effects.command {
        force = kind.command(force, &states[*at..], &mut rates[*at..], context);
    }
    effects.loss.iter().fold(force, |sum, kind| sum + kind.loss(force, context))
}

impl Plant {
    /// Effect states of `cable` within `y`, in a fixed-size array (zero-filled).
    #[inline]
    pub(crate) fn gather_effect_states<S: Real>(&self, cable: usize, y: &[S]) -> [S; MAX_EFFECT_STATES] {
        let mut states = [S::from(0.0); MAX_EFFECT_STATES];
        let range = self.effect_states(cable);
        if !range.is_empty() {
            states[..range.len()].copy_from_slice(&y[range]);
        }
        states
    }

    /// Evaluates the plant at time `time` (s), states `y`, inputs `u` (winch forces after their dead time), with the
    /// cables in `slack` carrying nothing.
    ///
    /// The accelerations solve the implicit system [`Plant::residual`]: it is linear in them, one 3×3 system.
    pub fn evaluate<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: [bool; CABLES]) -> Evaluation<S> {
        let zero = S::from(0.0);
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        let omega = twist[2];
        let rotation = [pose[2].cos(), pose[2].sin()];
        let data = &self.data;
        let kinematics: [CableKinematics<S>; CABLES] = std::array::from_fn(|i| {
            CableKinematics::new(data.geometry.anchor[i], data.geometry.attachment[i], &pose, rotation, &twist)
        });
        let mut e = Evaluation {
            kinematics,
            acceleration: [zero; 3],
            tension: [zero; CABLES],
            tension_uncut: [zero; CABLES],
            pull: [zero; CABLES],
            unstretched: [zero; CABLES],
            unstretched_rate: [zero; CABLES],
            unstretched_acceleration: [zero; CABLES],
            effect_rate: [[zero; MAX_EFFECT_STATES]; CABLES],
            mass: [[zero; 3]; 3],
            platform_axial_mass: [zero; CABLES],
        };
        for i in 0..CABLES {
            let k = &kinematics[i];
            (e.unstretched[i], e.unstretched_rate[i]) = match data.cables[i].model {
                CableModel::Rigid => (k.length, k.speed),
                CableModel::MasslessSpring => (y[self.offset[i]], k.speed),
                CableModel::LumpedMass => (y[self.offset[i]], y[self.offset[i] + 1]),
            };
        }
        let mut force = u.disturbance;
        let mut pull = [zero; CABLES];
        if self.needs_context {
            let lengths = kinematics.map(|k| k.length);
            let speeds = kinematics.map(|k| k.speed);
            let context = PlatformContext {
                time,
                pose: &pose,
                twist: &twist,
                inputs: u,
                cable_length: &lengths,
                cable_speed: &speeds,
                unstretched_length: &e.unstretched,
                unstretched_rate: &e.unstretched_rate,
            };
            for kind in &self.wrench {
                let wrench = kind.wrench(&context);
                for k in 0..3 {
                    force[k] += wrench[k];
                }
            }
            for i in 0..CABLES {
                pull[i] = self.cable[i].pull.iter().fold(zero, |sum, kind| sum + kind.pull(&context));
            }
        }
        e.mass = self.platform_mass(rotation);
        let [cx, cy] = self.com_arm(rotation);
        let centrifugal = omega * omega * data.mass;
        force[0] += centrifugal * cx;
        force[1] += centrifugal * cy;
        let mut mass_taut = e.mass;
        for i in 0..CABLES {
            let cable = &data.cables[i];
            let effects = &self.cable[i];
            let k = &kinematics[i];
            let normal = k.normal_row();
            // Transverse inertia: Q = -ρ/3 (L² α̈ + 3 L L̇ α̇) along N.
            let across = k.length * (cable.acting_density() / 3.0);
            let mut q = -(across * (k.normal_acceleration_bias(omega) + k.speed * k.angular_rate * 3.0));
            for kind in &effects.transverse {
                q += kind.transverse_force(k.length, k.angular_rate);
            }
            matrix3::add_outer(&mut e.mass, &normal, &normal, across);
            for c in 0..3 {
                force[c] += q * normal[c];
            }
            let states = self.gather_effect_states(i, y);
            let context = WinchContext { time, speed: e.unstretched_rate[i] };
            e.pull[i] = pull[i] + winch_pull(self, i, u.winch_force[i], &context, &states, &mut e.effect_rate[i]);
            match cable.model {
                CableModel::LumpedMass => {
                    let elastic = elastic::tension(cable, &effects.law, time, k.length, e.unstretched[i], &states);
                    e.tension_uncut[i] = elastic + (k.speed - e.unstretched_rate[i]) * cable.damping / e.unstretched[i];
                    if !slack[i] {
                        let row = k.jacobian_row();
                        for c in 0..3 {
                            force[c] -= e.tension_uncut[i] * row[c];
                        }
                    }
                }
                CableModel::Rigid | CableModel::MasslessSpring => {
                    let mass = cable.axial_mass(k.length);
                    e.platform_axial_mass[i] = mass;
                    e.tension_uncut[i] = e.pull[i]
                        + cable.axial_bias(k.length, k.speed, k.angular_rate)
                        + mass * k.length_acceleration_bias(omega);
                }
            }
        }
        for r in 0..3 {
            for c in 0..3 {
                mass_taut[r][c] = e.mass[r][c];
            }
        }
        for i in 0..CABLES {
            if data.cables[i].model != CableModel::LumpedMass && !slack[i] {
                let row = kinematics[i].jacobian_row();
                matrix3::add_outer(&mut mass_taut, &row, &row, e.platform_axial_mass[i]);
                for c in 0..3 {
                    force[c] -= e.tension_uncut[i] * row[c];
                }
            }
        }
        e.mass = mass_taut;
        e.acceleration = matrix3::product(&matrix3::inverse(&e.mass), &force);
        self.finish_cables(time, y, slack, &mut e);
        e
    }

    /// What follows from the accelerations: tensions, and the cables' own rates.
    #[inline]
    fn finish_cables<S: Real>(&self, time: S, y: &[S], slack: [bool; CABLES], e: &mut Evaluation<S>) {
        let omega = y[5];
        for i in 0..CABLES {
            let cable = &self.data.cables[i];
            let effects = &self.cable[i];
            let k = e.kinematics[i];
            let along = matrix3::dot(&k.jacobian_row(), &e.acceleration);
            if cable.model != CableModel::LumpedMass {
                e.tension_uncut[i] += e.platform_axial_mass[i] * along;
            }
            if !slack[i] {
                e.tension[i] = e.tension_uncut[i];
            }
            match cable.model {
                CableModel::Rigid => e.unstretched_acceleration[i] = along + k.length_acceleration_bias(omega),
                CableModel::MasslessSpring => {
                    let states = self.gather_effect_states(i, y);
                    let elastic = elastic::tension(cable, &effects.law, time, k.length, e.unstretched[i], &states);
                    e.unstretched_rate[i] = k.speed + (elastic - e.tension[i]) * e.unstretched[i] / cable.damping;
                    e.unstretched_acceleration[i] = along + k.length_acceleration_bias(omega);
                }
                CableModel::LumpedMass => {
                    let (l, rate) = (e.unstretched[i], e.unstretched_rate[i]);
                    e.unstretched_acceleration[i] =
                        (e.tension[i] - e.pull[i] - cable.axial_bias(l, rate, k.angular_rate)) / cable.axial_mass(l);
                }
            }
            if effects.states > 0 {
                let states = self.gather_effect_states(i, y);
                for (kind, at) in &effects.law {
                    kind.strain_rates(e.tension[i], &states[*at..], &mut e.effect_rate[i][*at..]);
                }
            }
        }
    }

    /// Mass matrix of the platform alone about G, with the centre of mass at `G + R(φ) c`.
    #[inline]
    pub(crate) fn platform_mass<S: Real>(&self, rotation: [S; 2]) -> Matrix3<S> {
        let data = &self.data;
        let zero = S::from(0.0);
        let m = S::from(data.mass);
        let [cx, cy] = self.com_arm(rotation);
        let square = data.centre_of_mass[0].powi(2) + data.centre_of_mass[1].powi(2);
        let inertia = S::from(data.inertia + data.mass * square);
        [[m, zero, -(cy * data.mass)], [zero, m, cx * data.mass], [-(cy * data.mass), cx * data.mass, inertia]]
    }

    /// `R(φ) c` (m).
    #[inline]
    pub(crate) fn com_arm<S: Real>(&self, [cos, sin]: [S; 2]) -> [S; 2] {
        let [x, y] = self.data.centre_of_mass;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Rates of all states: the solved-for form of the implicit system.
    #[inline]
    pub fn rates<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: [bool; CABLES], rates: &mut [S]) {
        let e = self.evaluate(time, y, u, slack);
        self.write_rates(y, &e, rates);
    }

    /// Writes the rates of all states out of an evaluation.
    #[inline]
    pub(crate) fn write_rates<S: Real>(&self, y: &[S], e: &Evaluation<S>, rates: &mut [S]) {
        for k in 0..3 {
            rates[k] = y[3 + k];
            rates[3 + k] = e.acceleration[k];
        }
        for i in 0..CABLES {
            let at = self.offset[i];
            match self.data.cables[i].model {
                CableModel::Rigid => {}
                CableModel::MasslessSpring => rates[at] = e.unstretched_rate[i],
                CableModel::LumpedMass => {
                    rates[at] = e.unstretched_rate[i];
                    rates[at + 1] = e.unstretched_acceleration[i];
                }
            }
            let range = self.effect_states(i);
            if !range.is_empty() {
                let n = range.len();
                rates[range].copy_from_slice(&e.effect_rate[i][..n]);
            }
        }
    }

    /// Which cables are slack at this state: those whose tension would be negative.
    ///
    /// With elastic cables this is read off the spring and damper. Where tension depends on the acceleration (rigid,
    /// massless spring) the set is found by iteration; the condition is the minimum of a convex function, so there is
    /// one answer.
    pub fn slack_cables(&self, time: f64, y: &[f64], u: &Inputs) -> [bool; CABLES] {
        let mut slack = [false; CABLES];
        for _ in 0..(1 << CABLES) {
            let e = self.evaluate(time, y, u, slack);
            let next = e.tension_uncut.map(|t| t < 0.0);
            if next == slack {
                break;
            }
            slack = next;
        }
        slack
    }
}

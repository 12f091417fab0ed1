//! The implicit system `F(t, y, ẏ, u, F_D) = 0`: the physics as the paper states it.

use crate::effect::{PlatformContext, StrainContext, SwingContext, WinchContext};
use crate::kinematics;
use crate::parameters::{CableDamper, CableInertia, CableModel};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

use super::{CableData, Held, Inputs, MAX_EFFECT_STATES, swing_tension};

/// The axial force (N) that the motion of an end takes: its length, rate and acceleration (m, m/s, m/s²), (23).
fn axial_force<S: Real>(cable: &CableData, [length, rate, acceleration]: [S; 3], angular_rate: S) -> S {
    let turning = length * angular_rate * angular_rate;
    let own = match cable.inertia {
        CableInertia::Paper => (length * acceleration + rate * rate - length * turning) * (0.5 * cable.density),
        CableInertia::Reeled => length * (acceleration - turning * 0.5) * cable.density,
        CableInertia::None => S::from(0.0),
    };
    own + acceleration * cable.drum_mass
}

/// The damper's force (N), (33): by the rate of length over `l`, or of strain.
fn damper_force<S: Real>(cable: &CableData, [chord, speed]: [S; 2], [l, rate]: [S; 2]) -> S {
    let strain_rate = match cable.damper {
        CableDamper::LengthRate => (speed - rate) / l,
        CableDamper::StrainRate => (speed * l - chord * rate) / (l * l),
    };
    strain_rate * cable.damping
}

impl Plant {
    /// The residual `F(t, y, ẏ, u, F_D)`, equations (23), (25)-(28), (36)-(42), term by term.
    ///
    /// `y` and `rates` (ẏ) are laid out as in [`Plant::rates`]; so is the residual: kinematic rows in m/s, the
    /// platform's rows in N and N m, a cable's rows in m/s and N, effect states in their own rate. The cables in
    /// `slack` carry nothing. [`Plant::rates`] makes it zero.
    pub fn residual<S: Real>(
        &self,
        time: S,
        y: &[S],
        rates: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        residual: &mut [S],
    ) {
        let now = self.at(time.re());
        if !std::ptr::eq(now, self) {
            return now.residual(time, y, rates, u, slack, residual);
        }
        let zero = S::from(0.0);
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        let acceleration = [rates[3], rates[4], rates[5]];
        let (omega, omega_rate) = (twist[2], acceleration[2]);
        let cables = kinematics::cables(&self.data.geometry, &pose, &twist);
        let unstretched: PerCable<[S; 2]> = PerCable::from_fn(self.cables(), |i| match self.data.cables[i].model {
            CableModel::Rigid => [cables[i].length, cables[i].speed],
            CableModel::MasslessSpring => [y[self.offset[i]], cables[i].speed],
            CableModel::LumpedMass => [y[self.offset[i]], y[self.offset[i] + 1]],
        });
        let context = PlatformContext {
            time,
            geometry: &self.data.geometry,
            pose: &pose,
            twist: &twist,
            inputs: u,
            cable_length: &cables.map(|k| k.length),
            cable_speed: &cables.map(|k| k.speed),
            unstretched_length: &unstretched.map(|l| l[0]),
            unstretched_rate: &unstretched.map(|l| l[1]),
        };
        let mut wrench = self.applied_wrench(&context);
        for i in 0..self.cables() {
            let cable = &self.data.cables[i];
            let effects = &self.cable[i];
            let k = &cables[i];
            let [s, n] = [k.direction, [-k.direction[1], k.direction[0]]];
            // (12) and (14)
            let length_acceleration =
                s[0] * acceleration[0] + s[1] * acceleration[1] + omega_rate * k.arm_cross_direction
                    - omega * omega * k.arm_dot_direction
                    + k.span * k.angular_rate * k.angular_rate;
            let angular_acceleration =
                (n[0] * acceleration[0] + n[1] * acceleration[1] + omega_rate * k.arm_dot_direction
                    - omega * omega * k.arm_dot_normal()
                    - (k.speed + k.span_rate()) * k.angular_rate)
                    / k.span;
            let states = self.effect_states_in(i, y);
            let mut effect_rates = [zero; MAX_EFFECT_STATES];
            let winch = WinchContext { time, speed: unstretched[i][1] };
            let (chord, paid_out, chain) = ([k.length, k.speed], unstretched[i], self.chain(i));
            let held = Held { time, chord, paid_out, angular_rate: k.angular_rate, slack: slack[i], states };
            let command = chain.drive(u.winch_force[i], &held);
            let pull = chain.pull(command, chain.added(&context), &winch, states, &mut effect_rates);
            let at = self.offset[i];
            // (23): tension from the motion of the end of the cable.
            let from_motion = |length: S, rate: S, acceleration: S| {
                pull + axial_force(cable, [length, rate, acceleration], k.angular_rate)
            };
            let cut = |tension: S| if slack[i] { zero } else { tension };
            let spring =
                |l: S, rate: S| chain.spring(time, k.length, l, states) + damper_force(cable, chord, [l, rate]);
            let tension = match cable.model {
                CableModel::Rigid => cut(from_motion(k.length, k.speed, length_acceleration)),
                CableModel::MasslessSpring => {
                    let tension = cut(from_motion(k.length, k.speed, length_acceleration));
                    residual[at] = tension - spring(y[at], rates[at]);
                    tension
                }
                CableModel::LumpedMass => {
                    let tension = cut(spring(y[at], y[at + 1]));
                    residual[at] = rates[at] - y[at + 1];
                    residual[at + 1] = from_motion(y[at], y[at + 1], rates[at + 1]) - tension;
                    tension
                }
            };
            // (22), (25) with the sign of (21)
            let mut transverse = -(k.span * k.span * angular_acceleration
                + k.span * k.span_rate() * k.angular_rate * 3.0)
                * cable.straight_density;
            for kind in &effects.transverse {
                transverse += kind.transverse_force(k.span, k.angular_rate);
            }
            let carried = swing_tension(cable.model, tension, pull, slack[i]);
            let swing = SwingContext { length: k.span, angular_rate: k.angular_rate, tension: carried };
            for (kind, start) in &effects.swing {
                transverse += kind.swing(&swing, &states[*start..], &mut effect_rates[*start..]);
            }
            let along = tension + k.length * length_acceleration * cable.end_density;
            let force = [transverse * n[0] - along * s[0], transverse * n[1] - along * s[1]];
            wrench[0] += force[0];
            wrench[1] += force[1];
            wrench[2] += k.arm[0] * force[1] - k.arm[1] * force[0];
            // ε' of ε = L/l - 1, as the rates given have it.
            let paid_out_rate = if cable.model == CableModel::MasslessSpring { rates[at] } else { unstretched[i][1] };
            let strain_rate =
                k.speed / unstretched[i][0] - k.length * paid_out_rate / (unstretched[i][0] * unstretched[i][0]);
            let strained = StrainContext { tension, strain_rate: cut(strain_rate) };
            for (kind, start) in &effects.law {
                kind.strain_rates(&strained, &states[*start..], &mut effect_rates[*start..]);
            }
            for (row, rate) in self.effect_states(i).zip(effect_rates) {
                residual[row] = rates[row] - rate;
            }
        }
        // (26), (27) with the centre of mass at G + c
        let [cx, cy] = self.com_arm([pose[2].cos(), pose[2].sin()]);
        let centre = [
            acceleration[0] - omega_rate * cy - omega * omega * cx,
            acceleration[1] + omega_rate * cx - omega * omega * cy,
        ];
        let m = self.data.mass;
        // What the mass feels: its acceleration less gravity.
        let felt = [centre[0] - self.data.gravity[0], centre[1] - self.data.gravity[1]];
        residual[3] = felt[0] * m - wrench[0];
        residual[4] = felt[1] * m - wrench[1];
        residual[5] = omega_rate * self.data.inertia + (cx * felt[1] - cy * felt[0]) * m - wrench[2];
        for c in 0..3 {
            residual[c] = rates[c] - twist[c];
        }
    }
}

//! Where the energy is and where it goes: a balance that every motion must keep.
//!
//! The rate of [`Energy::total`] along the motion equals [`Power::total`]; both are computed from the states alone, so
//! the balance checks the equations of motion and the integration. What is not obvious in it:
//!
//! - Cable mass that is reeled out carries energy through the winch. From `Q = -ρ/3 (L² α̈ + 3 L L̇ α̇)` the kinetic
//!   energy across, `ρ L³ α̇²/6`, changes by the work of `-Q` and by `-½ ρ L² L̇ α̇²`. The axial equation of the paper's
//!   rod gives `¼ ρ l l̇²` the gain `½ ρ l² α̇² l̇ - ¼ ρ l̇³` beside the work of `T - u`; that of a reeled cable gives
//!   `½ ρ l l̇²` the gain `½ ρ l² α̇² l̇ + ½ ρ l̇³`.
//! - Stretched cable that is reeled out takes its elastic energy along: `EA (L - l)²/(2 l)` changes by the work of the
//!   spring force and by `-½ EA ε² l̇`.
//! - In `massless_spring` the cable's axial inertia is written with `L` although the spring is held by the winch. The
//!   winch then works on both: `-u L̇` moves the inertia, `T (L̇ - l̇)` stretches the spring.

use num_dual::Dual64;

use crate::dynamics::{Evaluation, Inputs, MAX_EFFECT_STATES, swing_tension};
use crate::effect::{PlatformContext, SwingContext};
use crate::kinematics;
use crate::parameters::{CableInertia, CableModel};
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

/// Energy of the plant (J).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy<S = f64> {
    /// Kinetic energy of the platform about and with its centre of mass.
    pub platform: S,
    /// Kinetic energy of the cables across their direction.
    pub cables_across: S,
    /// Kinetic energy of the cables along their direction, and of the drums.
    pub cables_along: S,
    /// Potential energy of the platform in gravity, zero with its centre of mass at the origin.
    pub gravity: S,
    /// Elastic energy of the taut cables; zero for cables with effects on their elastic law, whose work is
    /// [`Power::cable_laws`].
    pub elastic: S,
}

impl<S: Real> Energy<S> {
    /// All of it (J).
    pub fn total(&self) -> S {
        self.platform + self.cables_across + self.cables_along + self.gravity + self.elastic
    }
}

/// What changes the energy of the plant (W); positive adds to it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Power {
    /// Work of the winches, friction and other effects in them included.
    pub winches: f64,
    /// Work of the disturbance.
    pub disturbance: f64,
    /// Work of effects that act on the platform or across the cables, which takes in what the bow of a swinging cable
    /// stores.
    pub effects: f64,
    /// Work of the cables' dampers; never positive where they measure the rate of length, as the paper's do.
    pub damping: f64,
    /// What cables with effects on their elastic law take up, stored or lost, with the sign changed.
    pub cable_laws: f64,
    /// Kinetic and elastic energy carried through the winches with the cable.
    pub reeling: f64,
}

impl Power {
    /// All of it (W).
    pub fn total(&self) -> f64 {
        self.winches + self.disturbance + self.effects + self.damping + self.cable_laws + self.reeling
    }
}

impl Plant {
    /// Energy (J) at states `y` with the cables in `slack` carrying nothing.
    ///
    /// A rigid or massless-spring cable that is slack has no axial motion of its own in the model; its axial energy is
    /// left out, so the total jumps when such a cable goes slack in motion. Where effects begin or end, ask the plant of that
    /// time, [`Plant::at`].
    pub fn energy<S: Real>(&self, y: &[S], slack: &PerCable<bool>) -> Energy<S> {
        let data = &self.data;
        let zero = S::from(0.0);
        let (pose, twist) = ([y[0], y[1], y[2]], [y[3], y[4], y[5]]);
        let (sin, cos) = pose[2].sin_cos();
        let cables = kinematics::cables(&data.geometry, &pose, &twist);
        let [cx, cy] = self.com_arm([cos, sin]);
        let centre = [twist[0] - twist[2] * cy, twist[1] + twist[2] * cx];
        let mut energy = Energy {
            platform: (centre[0] * centre[0] + centre[1] * centre[1]) * (0.5 * data.mass)
                + twist[2] * twist[2] * (0.5 * data.inertia),
            cables_across: zero,
            cables_along: zero,
            gravity: -((pose[0] + cx) * data.gravity[0] + (pose[1] + cy) * data.gravity[1]) * data.mass,
            elastic: zero,
        };
        for i in 0..self.cables() {
            let k = &cables[i];
            let cable = &data.cables[i];
            let at = self.offset[i];
            let turning = k.span * k.angular_rate;
            energy.cables_across += k.span * turning * turning * (0.5 * cable.straight_density);
            if !self.cable[i].swing.is_empty() {
                let states = self.effect_states_in(i, y);
                for (kind, at) in &self.cable[i].swing {
                    energy.cables_across += kind.swing_energy(k.span, &states[*at..]);
                }
            }
            energy.cables_along += k.length * k.speed * k.speed * (0.5 * cable.end_density);
            let (length, rate) = match cable.model {
                CableModel::LumpedMass => (y[at], y[at + 1]),
                CableModel::Rigid | CableModel::MasslessSpring => (k.length, k.speed),
            };
            if cable.model == CableModel::LumpedMass || !slack[i] {
                energy.cables_along += self.chain(i).axial_mass(length) * rate * rate * 0.5;
            }
            if cable.model != CableModel::Rigid && self.cable[i].law.is_empty() && k.length.re() > y[at].re() {
                let stretch = k.length - y[at];
                energy.elastic += stretch * stretch / y[at] * (0.5 * cable.axial_stiffness);
            }
        }
        energy
    }

    /// Power (W) at time `time` (s), states `y`, inputs `u`, with the plant's evaluation `e` there.
    pub fn power(&self, time: f64, y: &[f64], u: &Inputs, e: &Evaluation) -> Power {
        let now = self.at(time);
        if !std::ptr::eq(now, self) {
            return now.power(time, y, u, e);
        }
        let (pose, twist) = ([y[0], y[1], y[2]], [y[3], y[4], y[5]]);
        let dot = |wrench: &[f64; 3]| wrench.iter().zip(&twist).map(|(w, v)| w * v).sum::<f64>();
        let context = PlatformContext {
            time,
            geometry: &self.data.geometry,
            pose: &pose,
            twist: &twist,
            inputs: u,
            cable_length: &e.kinematics.map(|k| k.length),
            cable_speed: &e.kinematics.map(|k| k.speed),
            unstretched_length: &e.unstretched,
            unstretched_rate: &e.unstretched_rate,
        };
        let mut power = Power {
            winches: 0.0,
            disturbance: dot(&u.disturbance),
            effects: self.wrench.iter().map(|kind| dot(&kind.wrench(&context))).sum(),
            damping: 0.0,
            cable_laws: 0.0,
            reeling: 0.0,
        };
        for i in 0..self.cables() {
            let (cable, effects, k) = (&self.data.cables[i], &self.cable[i], &e.kinematics[i]);
            let turning = k.span * k.angular_rate;
            power.effects +=
                effects.transverse.iter().map(|f| f.transverse_force(k.span, k.angular_rate) * turning).sum::<f64>();
            let states = self.effect_states_in(i, y);
            let tension = swing_tension(cable.model, e.tension[i], e.pull[i], e.slack[i]);
            let swing = SwingContext { length: k.span, angular_rate: k.angular_rate, tension };
            for (kind, at) in &effects.swing {
                // What the platform gets, and what the swinging keeps.
                let mut rates = [0.0; MAX_EFFECT_STATES];
                let force = kind.swing(&swing, &states[*at..], &mut rates[*at..]);
                let mut moving = [Dual64::from(0.0); MAX_EFFECT_STATES];
                for (moving, (state, rate)) in moving.iter_mut().zip(states.iter().zip(rates)) {
                    *moving = Dual64::new(*state, rate);
                }
                power.effects += force * turning;
                power.effects += kind.swing_energy(Dual64::new(k.span, k.span_rate()), &moving[*at..]).eps;
            }
            power.reeling += 0.5 * cable.end_density * k.speed.powi(3);
            power.reeling -= 1.5 * cable.straight_density * turning * turning * k.span_rate();
            let opening = k.speed - e.unstretched_rate[i];
            // The cable whose mass the winch moves, and the work on the spring that it does beside that.
            let (length, rate) = match cable.model {
                CableModel::LumpedMass => (e.unstretched[i], e.unstretched_rate[i]),
                CableModel::Rigid | CableModel::MasslessSpring => (k.length, k.speed),
            };
            if cable.model == CableModel::MasslessSpring {
                power.winches += e.tension[i] * opening;
            }
            if cable.model == CableModel::LumpedMass || !e.slack[i] {
                power.winches -= e.pull[i] * rate;
                let turning = length * k.angular_rate;
                power.reeling += match cable.inertia {
                    CableInertia::Paper => cable.density * rate * (0.5 * turning * turning - 0.25 * rate * rate),
                    CableInertia::Reeled => 0.5 * cable.density * rate * (turning * turning + rate * rate),
                    CableInertia::None => 0.0,
                };
            }
            if cable.model == CableModel::Rigid {
                continue;
            }
            if effects.law.is_empty() {
                let strain = ((k.length - e.unstretched[i]) / e.unstretched[i]).max(0.0);
                let spring = cable.axial_stiffness * strain;
                power.damping -= (e.tension[i] - spring) * opening;
                power.reeling -= 0.5 * spring * strain * e.unstretched_rate[i];
            } else {
                power.cable_laws -= e.tension[i] * opening;
            }
        }
        power
    }
}

//! The plant at one instant, solved for the accelerations: where the integrator spends its time.
//!
//! Quantities are arrays over the cables and the arithmetic is in short loops over them, apart from what effects add, so
//! that the compiler can work on several cables at once. The loops have 4, 8 or 12 lanes, as many as the robot needs
//! ([`with_lanes`]); in lanes beyond the last cable all constants are zero, so that they add nothing.

use crate::effect::{PlatformContext, WinchContext};
use crate::kinematics::CableArrays;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::{Has, Plant};
use crate::scalar::Real;

use super::matrix3::Symmetric3;
use super::{Evaluation, Held, Inputs, MAX_EFFECT_STATES};

/// The plant at one instant; the fields mean what they mean in [`super::Evaluation`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Instant<S, const LANES: usize> {
    pub(crate) kinematics: CableArrays<S, LANES>,
    pub(crate) acceleration: [S; 3],
    pub(crate) tension: [S; LANES],
    pub(crate) tension_uncut: [S; LANES],
    pub(crate) pull: [S; LANES],
    pub(crate) unstretched: [S; LANES],
    pub(crate) unstretched_rate: [S; LANES],
    pub(crate) unstretched_acceleration: [S; LANES],
    /// Mass matrix of the platform with the cables' inertia that moves with it.
    pub(crate) mass: Symmetric3<S>,
}

/// Rates of the effect states of each cable.
pub(crate) type EffectRates<S, const LANES: usize> = [[S; MAX_EFFECT_STATES]; LANES];

/// Room for them.
#[inline(always)]
pub(crate) fn no_effect_rates<S: Real, const LANES: usize>() -> EffectRates<S, LANES> {
    [[S::from(0.0); MAX_EFFECT_STATES]; LANES]
}

/// Sum over the lanes, a multiple of four: fours first, then in pairs.
#[inline(always)]
fn over_lanes<S: Real, const LANES: usize>(term: impl Fn(usize) -> S) -> S {
    const { assert!(LANES.is_multiple_of(4)) };
    let mut terms: [S; 4] = std::array::from_fn(&term);
    for lane in 4..LANES {
        terms[lane % 4] += term(lane);
    }
    (terms[0] + terms[2]) + (terms[1] + terms[3])
}

/// Runs `$body` with the constant `$lanes`: 4, 8 or 12, enough for `$plant`'s cables.
macro_rules! with_lanes {
    ($plant:expr, $lanes:ident => $body:expr) => {
        match $plant.cables() {
            0..=4 => {
                const $lanes: usize = 4;
                $body
            }
            5..=8 => {
                const $lanes: usize = 8;
                $body
            }
            _ => {
                const $lanes: usize = $crate::per_cable::MAX_CABLES;
                $body
            }
        }
    };
}
pub(crate) use with_lanes;

impl Plant {
    /// Effect states of `cable` within `y`.
    #[inline]
    pub(crate) fn effect_states_in<'y, S>(&self, cable: usize, y: &'y [S]) -> &'y [S] {
        &y[self.effect_states(cable)]
    }

    /// Solves the implicit system at `time` (s), states `y`, inputs `u`, with the cables in `slack` carrying nothing; writes the
    /// rates of the effects' own states.
    ///
    /// The system is linear in the accelerations: one 3×3 solve.
    #[inline]
    pub(crate) fn instant<S: Real, const LANES: usize>(
        &self,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        effect_rate: &mut EffectRates<S, LANES>,
    ) -> Instant<S, LANES> {
        if self.plain {
            self.instant_here(Has::default(), time, y, u, slack, effect_rate)
        } else {
            self.instant_here(self.has, time, y, u, slack, effect_rate)
        }
    }

    /// What `see` makes of [`Plant::instant`]. Of a plant without effects what it does not read is not computed.
    #[inline(always)]
    pub(crate) fn instant_seen<S: Real, const LANES: usize, R>(
        &self,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        see: impl FnOnce(&Instant<S, LANES>) -> R,
    ) -> R {
        if self.plain {
            see(&self.instant_here(Has::default(), time, y, u, slack, &mut no_effect_rates()))
        } else {
            self.instant_seen_with_effects(time, y, u, slack, see)
        }
    }

    /// Apart for the same reason as [`Plant::rates_with_effects`].
    #[inline(never)]
    fn instant_seen_with_effects<S: Real, const LANES: usize, R>(
        &self,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        see: impl FnOnce(&Instant<S, LANES>) -> R,
    ) -> R {
        see(&self.instant(time, y, u, slack, &mut no_effect_rates()))
    }

    /// Writes the rates of all states. What only others read of the instant is not computed, and a plant without effects is
    /// evaluated as such: the compiler then keeps what is left in registers.
    ///
    /// Returns the tensions before they are cut off at zero.
    #[inline(always)]
    pub(crate) fn rates_here<S: Real, const LANES: usize>(
        &self,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        rates: &mut [S],
    ) -> [S; LANES] {
        if self.plain {
            self.rates_having(Has::default(), time, y, u, slack, rates)
        } else {
            self.rates_with_effects(time, y, u, slack, rates)
        }
    }

    /// Apart, so that what it keeps on the stack is not in the way of the plain plant, nor the other way round.
    #[inline(never)]
    fn rates_with_effects<S: Real, const LANES: usize>(
        &self,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        rates: &mut [S],
    ) -> [S; LANES] {
        self.rates_having(self.has, time, y, u, slack, rates)
    }

    #[inline(always)]
    fn rates_having<S: Real, const LANES: usize>(
        &self,
        has: Has,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        rates: &mut [S],
    ) -> [S; LANES] {
        let mut effect_rate = no_effect_rates();
        let e = self.instant_here::<S, LANES>(has, time, y, u, slack, &mut effect_rate);
        if has.only_pairs()
            && let Some(pairs) = rates[6..].as_chunks_mut().0.first_chunk_mut::<LANES>()
        {
            *pairs = std::array::from_fn(|i| [e.unstretched_rate[i], e.unstretched_acceleration[i]]);
            rates[..3].copy_from_slice(&y[3..6]);
            rates[3..6].copy_from_slice(&e.acceleration);
            return e.tension_uncut;
        }
        // Apart from what is not written, which then is not kept.
        let (first, second) = (e.unstretched_rate, e.unstretched_acceleration);
        self.write(has, y, &e.acceleration, (&first, &second, &effect_rate), rates);
        e.tension_uncut
    }

    /// [`Plant::instant`] made part of the caller, with what there is to compute.
    #[inline(always)]
    fn instant_here<S: Real, const LANES: usize>(
        &self,
        has: Has,
        time: S,
        y: &[S],
        u: &Inputs<S>,
        slack: &PerCable<bool>,
        effect_rate: &mut EffectRates<S, LANES>,
    ) -> Instant<S, LANES> {
        let zero = S::from(0.0);
        let zeros = [zero; LANES];
        let pose = [y[0], y[1], y[2]];
        let twist = [y[3], y[4], y[5]];
        let omega = twist[2];
        let (sin, cos) = pose[2].sin_cos();
        let rotation = [cos, sin];
        let data = &self.data;
        let constants = &self.constants;
        let cables = data.cables.len();
        let slack = slack.padded::<LANES>();
        let any_slack = slack != [false; LANES];
        let k = CableArrays::<S, LANES>::new(&self.ends, has.pulley, &pose, rotation, &twist);
        let (mut unstretched, mut unstretched_rate) = (k.length, k.speed);
        if has.only_pairs()
            && let Some(pairs) = y[6..].as_chunks::<2>().0.first_chunk::<LANES>()
        {
            (unstretched, unstretched_rate) = (pairs.map(|[l, _]| l), pairs.map(|[_, rate]| rate));
        } else {
            for (i, &at) in self.offset.iter().enumerate().take(LANES) {
                if !has.platform_side {
                    (unstretched[i], unstretched_rate[i]) = (y[at], y[at + 1]);
                    continue;
                }
                match data.cables[i].model {
                    CableModel::Rigid => {}
                    CableModel::MasslessSpring => unstretched[i] = y[at],
                    CableModel::LumpedMass => (unstretched[i], unstretched_rate[i]) = (y[at], y[at + 1]),
                }
            }
        }

        // What effects add: a wrench on the platform, forces along the winches.
        let mut force = u.disturbance;
        let mut pull = u.winch_force.padded::<LANES>();
        if has.force {
            let context = PlatformContext {
                time,
                geometry: &data.geometry,
                pose: &pose,
                twist: &twist,
                inputs: u,
                cable_length: &k.length[..cables],
                cable_speed: &k.speed[..cables],
                unstretched_length: &unstretched[..cables],
                unstretched_rate: &unstretched_rate[..cables],
            };
            force = self.applied_wrench(&context);
            for i in 0..cables {
                let (cable, states) = (self.chain(i), self.effect_states_in(i, y));
                let winch = WinchContext { time, speed: unstretched_rate[i] };
                let mut command = u.winch_force[i];
                if has.servo {
                    command = cable.drive(
                        command,
                        &Held::of(
                            &k,
                            i,
                            time,
                            [unstretched[i], unstretched_rate[i]],
                            slack[i],
                            self.effect_states_in(i, y),
                        ),
                    );
                }
                pull[i] = cable.pull(command, cable.added(&context), &winch, states, &mut effect_rate[i]);
            }
        }

        // Elastic tension, of every cable: a rigid one has none.
        let inverse_unstretched = unstretched.map(|l| l.recip());
        let mut spring = zeros;
        for i in 0..LANES {
            spring[i] = (k.length[i] - unstretched[i]) * inverse_unstretched[i] * constants.axial_stiffness[i];
        }
        if has.law {
            for i in (0..cables).filter(|i| data.cables[*i].model != CableModel::Rigid) {
                spring[i] = self.chain(i).spring(time, k.length[i], unstretched[i], self.effect_states_in(i, y));
            }
        }
        let mut tension_uncut = zeros;
        for i in 0..LANES {
            let strain = (k.length[i] - unstretched[i]) * inverse_unstretched[i];
            let opening = constants.opening(i, strain, k.speed[i], unstretched_rate[i]);
            tension_uncut[i] = spring[i] + opening * inverse_unstretched[i] * constants.damping[i];
        }

        let mut across_added = zeros;
        if has.across {
            for i in 0..cables {
                let held =
                    Held::of(&k, i, time, [unstretched[i], unstretched_rate[i]], slack[i], self.effect_states_in(i, y));
                across_added[i] =
                    self.chain(i).across(k.span[i], tension_uncut[i], pull[i], &held, &mut effect_rate[i]);
            }
        }

        // Platform, and the inertia of the cables across: Q = -ρ/3 (L² α̈ + 3 L L̇ α̇) along N.
        let mut mass = self.platform_mass(rotation);
        let own = self.own_load(rotation, omega);
        for c in 0..3 {
            force[c] += own[c];
        }
        let omega_square = omega * omega;
        let mut across = zeros;
        let mut normal_force = zeros;
        for i in 0..LANES {
            // (14) without the accelerations, plus 3 L̇ α̇
            let arm_dot_normal = k.arm_y[i] * k.direction_x[i] - k.arm_x[i] * k.direction_y[i];
            let bias = k.speed[i] * k.angular_rate[i] - omega_square * arm_dot_normal;
            across[i] = k.span[i] * constants.straight_density[i];
            normal_force[i] = across_added[i] - across[i] * bias;
        }
        if has.pulley {
            for i in 0..cables {
                // The straight part changes by its own rate, not by that of the whole length.
                let given_off = k.angular_rate[i] * k.angular_rate[i] * (2.0 * k.pulley_radius[i]);
                normal_force[i] -= across[i] * given_off;
            }
        }
        // along the normal row [-S_y, S_x, E·S]
        let (sx, sy, dot_row) = (&k.direction_x, &k.direction_y, &k.arm_dot_direction);
        mass.0[0] += over_lanes::<S, LANES>(|i| across[i] * sy[i] * sy[i]);
        mass.0[1] -= over_lanes::<S, LANES>(|i| across[i] * sy[i] * sx[i]);
        mass.0[2] -= over_lanes::<S, LANES>(|i| across[i] * sy[i] * dot_row[i]);
        mass.0[3] += over_lanes::<S, LANES>(|i| across[i] * sx[i] * sx[i]);
        mass.0[4] += over_lanes::<S, LANES>(|i| across[i] * sx[i] * dot_row[i]);
        mass.0[5] += over_lanes::<S, LANES>(|i| across[i] * dot_row[i] * dot_row[i]);

        // Where tension depends on the platform's acceleration, the cable's axial mass moves with the platform.
        let mut length_bias = zeros;
        let mut platform_axial_mass = zeros;
        if has.platform_side || has.end_mass {
            for i in 0..LANES {
                let turning = k.span[i] * k.angular_rate[i];
                length_bias[i] = turning * k.angular_rate[i] - omega_square * k.arm_dot_direction[i];
            }
        }
        if has.platform_side {
            for i in 0..cables {
                let turning = k.length[i] * k.angular_rate[i];
                if data.cables[i].model != CableModel::LumpedMass {
                    let moving = constants.axial_mass(i, k.length[i]);
                    platform_axial_mass[i] = moving;
                    tension_uncut[i] = pull[i] + constants.axial_bias(i, k.speed[i], turning) + moving * length_bias[i];
                    if !slack[i] {
                        mass.add_square(&[k.direction_x[i], k.direction_y[i], k.arm_cross_direction[i]], moving);
                    }
                }
            }
        }
        let let_go = |tension: [S; LANES]| -> [S; LANES] {
            if any_slack { std::array::from_fn(|i| if slack[i] { zero } else { tension[i] }) } else { tension }
        };
        let mut pulled = let_go(tension_uncut);
        if has.end_mass {
            for i in 0..cables {
                let end = k.length[i] * data.cables[i].end_density;
                mass.add_square(&[k.direction_x[i], k.direction_y[i], k.arm_cross_direction[i]], end);
                pulled[i] += end * length_bias[i];
            }
        }
        force[0] -= over_lanes::<S, LANES>(|i| pulled[i] * sx[i] + normal_force[i] * sy[i]);
        force[1] += over_lanes::<S, LANES>(|i| normal_force[i] * sx[i] - pulled[i] * sy[i]);
        force[2] += over_lanes::<S, LANES>(|i| normal_force[i] * dot_row[i] - pulled[i] * k.arm_cross_direction[i]);
        let acceleration = mass.solve(&force);

        // What follows from the accelerations: tensions, and the cables' own.
        if has.platform_side {
            for i in 0..LANES {
                let along =
                    sx[i] * acceleration[0] + sy[i] * acceleration[1] + k.arm_cross_direction[i] * acceleration[2];
                length_bias[i] += along;
                tension_uncut[i] += platform_axial_mass[i] * along;
            }
        }
        let tension = let_go(tension_uncut);
        let mut unstretched_acceleration = zeros;
        for i in 0..LANES {
            let moving = constants.axial_mass(i, unstretched[i]);
            let bias = constants.axial_bias(i, unstretched_rate[i], unstretched[i] * k.angular_rate[i]);
            unstretched_acceleration[i] = (tension[i] - pull[i] - bias) / moving;
        }
        if has.platform_side {
            for i in 0..cables {
                if data.cables[i].model != CableModel::LumpedMass {
                    unstretched_acceleration[i] = length_bias[i];
                }
                if data.cables[i].model == CableModel::MasslessSpring {
                    let chord = [k.length[i], k.speed[i]];
                    unstretched_rate[i] = self.chain(i).paid_out_rate(spring[i], tension[i], chord, unstretched[i]);
                }
            }
        }
        // A damper does not pull on a cable without strain: it stays slack until it is taut.
        let lower = |least: f64, s: &S| if s.re() < least { s.re() } else { least };
        let least = spring.iter().fold(f64::INFINITY, lower);
        if least < 0.0 {
            for i in (0..cables).filter(|i| data.cables[*i].model == CableModel::LumpedMass) {
                if spring[i].re() < 0.0 && tension_uncut[i].re() > spring[i].re() {
                    tension_uncut[i] = spring[i];
                }
            }
        }
        if has.law {
            for i in 0..cables {
                let held =
                    Held::of(&k, i, time, [unstretched[i], unstretched_rate[i]], slack[i], self.effect_states_in(i, y));
                self.chain(i).law_rates(tension[i], &held, &mut effect_rate[i]);
            }
        }
        Instant {
            kinematics: k,
            acceleration,
            tension,
            tension_uncut,
            pull,
            unstretched,
            unstretched_rate,
            unstretched_acceleration,
            mass,
        }
    }

    /// Mass matrix of the platform alone about G, with the centre of mass at `G + R(φ) c`.
    #[inline]
    pub(crate) fn platform_mass<S: Real>(&self, rotation: [S; 2]) -> Symmetric3<S> {
        let data = &self.data;
        let zero = S::from(0.0);
        let m = S::from(data.mass);
        let [cx, cy] = self.com_arm(rotation);
        let square = data.centre_of_mass[0].powi(2) + data.centre_of_mass[1].powi(2);
        let inertia = S::from(data.inertia + data.mass * square);
        Symmetric3([m, zero, -(cy * data.mass), m, cx * data.mass, inertia])
    }

    /// Force and torque about G (N, N m) of the platform's weight and of its turning about G at this rate (rad/s).
    #[inline]
    pub(crate) fn own_load<S: Real>(&self, rotation: [S; 2], omega: S) -> [S; 3] {
        let [cx, cy] = self.com_arm(rotation);
        let centrifugal = omega * omega * self.data.mass;
        let [x, y] = self.data.gravity.map(|g| g * self.data.mass);
        [centrifugal * cx + x, centrifugal * cy + y, cx * y - cy * x]
    }

    /// Force and torque (N, N m) of the disturbance and of effects on the platform.
    #[inline]
    pub(crate) fn applied_wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let mut wrench = context.inputs.disturbance;
        for kind in &self.wrench {
            for (sum, added) in wrench.iter_mut().zip(kind.wrench(context)) {
                *sum += added;
            }
        }
        wrench
    }

    /// `R(φ) c` (m).
    #[inline]
    pub(crate) fn com_arm<S: Real>(&self, [cos, sin]: [S; 2]) -> [S; 2] {
        let [x, y] = self.data.centre_of_mass;
        [cos * x - sin * y, sin * x + cos * y]
    }

    /// Writes the rates of all states out of an evaluation.
    #[inline]
    pub(crate) fn write_rates<S: Real>(&self, y: &[S], e: &Evaluation<S>, rates: &mut [S]) {
        let cables = (&e.unstretched_rate[..], &e.unstretched_acceleration[..], &e.effect_rate[..]);
        self.write(self.has, y, &e.acceleration, cables, rates);
    }

    #[inline(always)]
    fn write<S: Real>(
        &self,
        has: Has,
        y: &[S],
        acceleration: &[S; 3],
        (first, second, effect): (&[S], &[S], &[[S; MAX_EFFECT_STATES]]),
        rates: &mut [S],
    ) {
        rates[..3].copy_from_slice(&y[3..6]);
        rates[3..6].copy_from_slice(acceleration);
        for (i, &at) in self.offset.iter().enumerate().take(first.len()) {
            let model = if has.platform_side { self.data.cables[i].model } else { CableModel::LumpedMass };
            match model {
                CableModel::Rigid => {}
                CableModel::MasslessSpring => rates[at] = first[i],
                CableModel::LumpedMass => rates[at..at + 2].copy_from_slice(&[first[i], second[i]]),
            }
            if has.states {
                match &mut rates[self.effect_states(i)] {
                    // Most have one; to copy it takes no call.
                    [only] => *only = effect[i][0],
                    several => several.copy_from_slice(&effect[i][..several.len()]),
                }
            }
        }
    }
}

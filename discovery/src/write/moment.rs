//! The smoothed motion of a trial sample by sample, and what the model as given misses there.

use cdpr::dynamics::Inputs;
use cdpr::effect::{EffectKind, EffectSpec, PlatformContext, Stage, WinchContext};
use cdpr::geometry::Geometry;
use cdpr::kinematics::{CableKinematics, cables};
use cdpr::per_cable::PerCable;

use crate::hypothesis::facts::{Picture, facts};
use crate::outcome::{Compared, Latents};

/// Half the time (s) over which rates of forces and speeds are taken: the latent disturbances change no faster.
const HALF_SLOPE: f64 = 0.5;

/// One sample of the smoothed motion.
pub(super) struct Moment {
    pub(super) time: f64,
    pub(super) pose: [f64; 3],
    pub(super) twist: [f64; 3],
    /// `[ax, ay, φ̈]` (m/s², rad/s²).
    pub(super) acceleration: [f64; 3],
    pub(super) inputs: Inputs,
    /// Rates of the winch forces (N/s).
    pub(super) force_rate: PerCable<f64>,
    /// Speed at which cable leaves each winch (m/s), and its rate (m/s²).
    pub(super) winch_speed: PerCable<f64>,
    pub(super) winch_acceleration: PerCable<f64>,
    pub(super) geometry: Geometry,
    pub(super) cables: PerCable<CableKinematics>,
    /// What the model as given misses: force and torque on the platform (N, N m), pull at each winch (N).
    pub(super) latent: Latents,
}

/// The moments of a trial, about `interval` (s) apart.
pub(super) fn moments(compared: &Compared, geometry: &Geometry, interval: f64) -> Vec<Moment> {
    let trial = &compared.trial;
    let every = ((interval / trial.interval().max(1e-9)).round() as usize).max(1);
    (0..trial.len())
        .step_by(every)
        .map(|k| {
            let time = trial.time[k];
            // The samples about half a slope's time before and after.
            let before = trial.time[..k].iter().rposition(|t| time - t >= HALF_SLOPE).unwrap_or(0);
            let after = trial.time[k..].iter().position(|t| t - time >= HALF_SLOPE).map_or(trial.len() - 1, |n| k + n);
            let span = (trial.time[after] - trial.time[before]).max(1e-9);
            let slope = |value: &dyn Fn(usize) -> f64| (value(after) - value(before)) / span;
            let motion = &compared.motion[k];
            let (pose, twist) = ([motion[0], motion[1], motion[2]], [motion[3], motion[4], motion[5]]);
            let over_cables = |rate: &dyn Fn(usize) -> f64| PerCable::from_fn(geometry.cables(), rate);
            Moment {
                time,
                pose,
                twist,
                acceleration: std::array::from_fn(|a| slope(&|k| compared.motion[k][3 + a])),
                inputs: trial.inputs[k],
                force_rate: over_cables(&|i| slope(&|k| trial.inputs[k].winch_force[i])),
                winch_speed: compared.winch_speed[k],
                winch_acceleration: over_cables(&|i| slope(&|k| compared.winch_speed[k][i])),
                geometry: *geometry,
                cables: cables(geometry, &pose, &twist),
                latent: compared.latents[k],
            }
        })
        .collect()
}

impl Moment {
    /// What the model as given misses on the platform, force and torque (N, N m), wherever it comes from.
    pub(super) fn missing_wrench(&self) -> [f64; 3] {
        let mut wrench = self.latent.wrench;
        for (cable, pull) in self.cables.iter().zip(&self.latent.pull) {
            for (sum, row) in wrench.iter_mut().zip(cable.jacobian_row()) {
                *sum -= pull * row;
            }
        }
        wrench
    }

    /// The pull (N) that an effect adds at winch `i`, as far as its law says it for one instant.
    pub(super) fn pull(&self, spec: &EffectSpec, kind: &EffectKind, i: usize) -> f64 {
        if spec.cable.is_some_and(|cable| cable != i + 1) {
            return 0.0;
        }
        let force = self.inputs.winch_force[i];
        let context = WinchContext { time: self.time, speed: self.winch_speed[i] };
        let picture = facts(&spec.id).picture;
        match kind.stage() {
            Stage::WinchLoss => kind.loss(force, &context),
            // Late by a dead time or a lag: as much behind as the force changes in that time.
            Stage::CommandDelay => -kind.delay() * self.force_rate[i],
            Stage::Command(_) if picture == Picture::Late => -spec.values[0] * self.force_rate[i],
            Stage::Command(_) => kind.command(force, &[], &mut [], &context) - force,
            Stage::WinchPull(at) if at != i => 0.0,
            Stage::WinchPull(_) | Stage::WinchPosition => self.in_context(|context| kind.pull(context, i)),
            Stage::Parameters if picture == Picture::WinchInertia => spec.values[0] * self.winch_acceleration[i],
            _ => 0.0,
        }
    }

    /// The force and torque (N, N m) that an effect adds on the platform, by way of the winches too.
    pub(super) fn wrench(&self, spec: &EffectSpec, kind: &EffectKind) -> [f64; 3] {
        let [ax, ay, spin] = self.acceleration;
        let mut wrench = match (kind.stage(), facts(&spec.id).picture) {
            (Stage::PlatformWrench, _) => self.in_context(|context| kind.wrench(context)),
            (_, Picture::Mass) => [-spec.values[0] * ax, -spec.values[0] * ay, 0.0],
            (_, Picture::Inertia) => [0.0, 0.0, -spec.values[0] * spin],
            _ => [0.0; 3],
        };
        for (i, cable) in self.cables.iter().enumerate() {
            let pull = self.pull(spec, kind, i);
            for (sum, row) in wrench.iter_mut().zip(cable.jacobian_row()) {
                *sum -= pull * row;
            }
        }
        wrench
    }

    /// What a platform-side effect sees here; cables count as unstretched.
    pub(super) fn in_context<T>(&self, use_it: impl FnOnce(&PlatformContext<'_, f64>) -> T) -> T {
        let length = self.cables.map(|cable| cable.length);
        use_it(&PlatformContext {
            time: self.time,
            geometry: &self.geometry,
            pose: &self.pose,
            twist: &self.twist,
            inputs: &self.inputs,
            cable_length: &length,
            cable_speed: &self.cables.map(|cable| cable.speed),
            unstretched_length: &length,
            unstretched_rate: &self.winch_speed,
        })
    }
}

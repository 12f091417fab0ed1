//! The pose at rest under given winch forces.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

use super::StartError;
use super::start::no_given_force;
use crate::dynamics::Inputs;
use crate::effect::PlatformContext;
use crate::kinematics;
use crate::plant::Plant;

/// Displacement of the differences for the stiffness (m, and at the attachment points for a turn).
const DIFFERENCE: f64 = 1e-4;
/// What may be left of the forces, as a share of the largest force given.
const BALANCED: f64 = 1e-9;
/// Orientations tried in the search, one a degree.
const ORIENTATIONS: i32 = 360;

/// The pose at rest near `guess` (m, rad) where the cables carry their winch forces.
///
/// Newton's method with step limits from the guess. Where it fails, a search over the orientation: at a given orientation
/// the potential energy `Σ u_i L_i - f·G` of winches that hold their forces is convex in the position, so there is one
/// position of balanced forces, found from anywhere; equilibria are the orientations at which the torque vanishes there.
/// The one nearest to the guess's orientation is taken.
///
/// # Errors
/// No pose at rest between the anchors; the reason is that of Newton's method.
pub fn static_equilibrium(plant: &Plant, time: f64, guess: [f64; 3], inputs: &Inputs) -> Result<[f64; 3], StartError> {
    let plant = plant.at(time);
    if plant.has.servo {
        return Err(no_given_force(plant.parameters().winch.command).into());
    }
    let balance = Balance::new(plant, time, inputs);
    balance.newton(guess).or_else(|error| balance.by_orientation(guess).ok_or(error))
}

/// Force and torque (N, N m) on the platform at rest that are not the cables': disturbance, weight, effects.
pub fn load_at_rest(plant: &Plant, time: f64, pose: &[f64; 3], inputs: &Inputs) -> [f64; 3] {
    plant.at_rest(time, pose, inputs, |context| load(plant.at(time), context))
}

fn load(plant: &Plant, context: &PlatformContext<'_, f64>) -> [f64; 3] {
    let phi = context.pose[2];
    let (weight, applied) = (plant.own_load([phi.cos(), phi.sin()], 0.0), plant.applied_wrench(context));
    std::array::from_fn(|k| weight[k] + applied[k])
}

/// Force and torque (N, N m) left on the platform at rest at `pose` with every cable carrying its winch's pull.
pub fn wrench_at_rest(plant: &Plant, time: f64, pose: [f64; 3], inputs: &Inputs) -> [f64; 3] {
    let plant = plant.at(time);
    let (mut wrench, pulls) =
        plant.at_rest(time, &pose, inputs, |context| (load(plant, context), plant.pulls_at_rest(context)));
    for (cable, pull) in kinematics::cables(plant.geometry(), &pose, &[0.0; 3]).iter().zip(pulls) {
        for (sum, row) in wrench.iter_mut().zip(cable.jacobian_row()) {
            *sum -= pull.max(0.0) * row;
        }
    }
    wrench
}

/// The balance of forces on the platform at rest.
struct Balance<'a> {
    plant: &'a Plant,
    time: f64,
    inputs: &'a Inputs,
    /// Length that makes torques comparable with forces (m).
    arm: f64,
    /// The largest force that is still balanced (N).
    small: f64,
}

impl<'a> Balance<'a> {
    fn new(plant: &'a Plant, time: f64, inputs: &'a Inputs) -> Self {
        // Pull and disturbance set the size of a balanced force.
        let driven = plant.driven(inputs);
        let size = driven.winch_force.iter().chain(&driven.disturbance).fold(1.0_f64, |a, b| a.max(b.abs()));
        Self { plant, time, inputs, arm: plant.geometry().attachment_scale(), small: BALANCED * size }
    }

    fn unbalanced(&self, pose: [f64; 3]) -> [f64; 3] {
        wrench_at_rest(self.plant, self.time, pose, self.inputs)
    }

    /// Slope of the wrench over coordinate `axis` of the pose.
    fn slope(&self, pose: [f64; 3], axis: usize) -> [f64; 3] {
        let step = if axis == 2 { DIFFERENCE / self.arm } else { DIFFERENCE };
        let (mut ahead, mut behind) = (pose, pose);
        ahead[axis] += step;
        behind[axis] -= step;
        let (a, b) = (self.unbalanced(ahead), self.unbalanced(behind));
        std::array::from_fn(|k| (a[k] - b[k]) / (2.0 * step))
    }

    /// Newton's method from `guess`, at most a fifth of the workspace and 2 rad in one step.
    fn newton(&self, guess: [f64; 3]) -> Result<[f64; 3], StartError> {
        let geometry = self.plant.geometry();
        let mut pose = guess;
        let fail =
            |reason, pose: [f64; 3]| StartError::NoEquilibrium { reason, pose, unbalanced: self.unbalanced(pose) };
        for _ in 0..100 {
            let columns = [0, 1, 2].map(|axis| Vector3::from(self.slope(pose, axis)));
            let Some(step) = Matrix3::from_columns(&columns).lu().solve(&-Vector3::from(self.unbalanced(pose))) else {
                return Err(fail("the stiffness matrix is singular", pose));
            };
            let length = step[0].abs().max(step[1].abs()).max(step[2].abs() * self.arm);
            if !length.is_finite() {
                return Err(fail("the stiffness matrix is singular", pose));
            }
            let limit = (0.2 * geometry.size() / length).min(2.0 / step[2].abs()).min(1.0);
            for k in 0..3 {
                pose[k] += limit * step[k];
            }
            if geometry.check_pose(&pose).is_err() {
                return Err(fail("the search leaves the space between the anchors", pose));
            }
            let left = self.unbalanced(pose);
            let small = left[0].abs().max(left[1].abs()).max(left[2].abs() / self.arm) <= self.small;
            if small && limit == 1.0 && length < 1e-6 * self.arm {
                return Ok(pose);
            }
        }
        Err(fail("the search does not settle", pose))
    }

    /// The equilibrium whose orientation is nearest to that of `guess`: the turning platform is followed both ways round
    /// until the torque changes its sign, or comes to a least size between two equilibria close together.
    fn by_orientation(&self, guess: [f64; 3]) -> Option<[f64; 3]> {
        let step = std::f64::consts::TAU / f64::from(ORIENTATIONS);
        // The last two orientations on each side, the later one last.
        let mut sides = [[None, self.at_orientation(guess)]; 2];
        for k in 1..=ORIENTATIONS / 2 {
            for (sign, [before, last]) in [1.0, -1.0].into_iter().zip(&mut sides) {
                let phi = guess[2] + sign * f64::from(k) * step;
                let from = last.map_or(guess, |found: Turned| found.pose);
                let now = self.at_orientation([from[0], from[1], phi]);
                let found = match (*before, *last, now) {
                    (_, Some(a), Some(b)) if a.side() != b.side() => self.between(a, b),
                    (Some(a), Some(b), Some(c)) if b.size() < a.size() && b.size() <= c.size() => {
                        self.beyond(a, b, c).and_then(|other| self.between(b, other))
                    }
                    _ => None,
                };
                if found.is_some() {
                    return found;
                }
                (*before, *last) = (*last, now);
            }
        }
        None
    }

    /// An orientation from `a` to `c` at which the torque is on the other side of zero than at `b` between them, where it is
    /// smaller than at both: by golden sections towards its least size.
    fn beyond(&self, a: Turned, b: Turned, c: Turned) -> Option<Turned> {
        let golden = 0.5 * (3.0 - 5.0_f64.sqrt());
        let (mut from, mut to) = (a.pose[2], c.pose[2]);
        for _ in 0..60 {
            let at = |phi: f64| self.at_orientation([b.pose[0], b.pose[1], phi]);
            let near = at(from + golden * (to - from))?;
            let far = at(to + golden * (from - to))?;
            if let Some(other) = [near, far].into_iter().find(|found| found.side() != b.side()) {
                return Some(other);
            }
            if near.size() < far.size() {
                to = far.pose[2];
            } else {
                from = near.pose[2];
            }
        }
        None
    }

    /// The equilibrium between two orientations with torques of unlike sign, where it lies between the anchors.
    fn between(&self, mut a: Turned, mut b: Turned) -> Option<[f64; 3]> {
        // Halved until Newton's method settles within the bracket; a jump of the torque is no equilibrium.
        for _ in 0..60 {
            let (low, high) = (a.pose[2].min(b.pose[2]), a.pose[2].max(b.pose[2]));
            if let Ok(found) = self.newton(a.pose)
                && (low..=high).contains(&found[2])
            {
                return Some(found);
            }
            let middle = self.at_orientation([a.pose[0], a.pose[1], 0.5 * (a.pose[2] + b.pose[2])])?;
            if middle.side() == a.side() {
                a = middle;
            } else {
                b = middle;
            }
        }
        None
    }

    /// The position of balanced forces at the orientation of `guess`, and the torque there. Newton's method with halved
    /// steps: in a convex energy it always comes nearer, and where that has no least point it runs away.
    fn at_orientation(&self, guess: [f64; 3]) -> Option<Turned> {
        let far = 2.0 * self.plant.geometry().size();
        let mut pose = guess;
        let mut left = self.unbalanced(pose);
        let size = |w: &[f64; 3]| w[0].hypot(w[1]);
        for _ in 0..100 {
            if size(&left) <= self.small {
                return Some(Turned { pose, torque: left[2] });
            }
            let columns = [0, 1].map(|axis| self.slope(pose, axis)).map(|s| Vector2::new(s[0], s[1]));
            let step = Matrix2::from_columns(&columns).lu().solve(&-Vector2::new(left[0], left[1]))?;
            let mut factor = 1.0;
            loop {
                let next = [pose[0] + factor * step[0], pose[1] + factor * step[1], pose[2]];
                let trial = self.unbalanced(next);
                if next[0].hypot(next[1]) < far && size(&trial) < size(&left) {
                    (pose, left) = (next, trial);
                    break;
                }
                factor *= 0.5;
                if factor < 1e-6 {
                    return None;
                }
            }
        }
        None
    }
}

/// The platform turned to an orientation, its forces balanced.
#[derive(Clone, Copy)]
struct Turned {
    pose: [f64; 3],
    /// Torque left (N m).
    torque: f64,
}

impl Turned {
    fn size(&self) -> f64 {
        self.torque.abs()
    }

    /// On which side of zero the torque is.
    fn side(&self) -> bool {
        self.torque > 0.0
    }
}

//! Everything known of the plant at one instant, as others read it.

use crate::kinematics::CableKinematics;
use crate::parameters::CABLES;
use crate::plant::Plant;
use crate::scalar::Real;

use super::matrix3::Matrix3;
use super::{Inputs, MAX_EFFECT_STATES};

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
    /// Which cables were taken as slack.
    pub slack: [bool; CABLES],
    /// Pull of the winch on its cable, effects included.
    pub pull: [S; CABLES],
    /// Unstretched lengths `l_i` (in a rigid cable its length).
    pub unstretched: [S; CABLES],
    /// Rates `l̇_i`.
    pub unstretched_rate: [S; CABLES],
    /// Accelerations `l̈_i`; where `l̇` is no state (`rigid`, `massless_spring`) those of the length, `L̈_i`.
    pub unstretched_acceleration: [S; CABLES],
    /// Rates of the effect states of each cable.
    pub effect_rate: [[S; MAX_EFFECT_STATES]; CABLES],
    /// Mass matrix of the platform with the cables' inertia that moves with it.
    pub(crate) mass: Matrix3<S>,
}

impl Plant {
    /// Evaluates the plant at time `time` (s), states `y`, inputs `u` (winch forces after their dead time), with the
    /// cables in `slack` carrying nothing.
    ///
    /// The accelerations solve the implicit system [`Plant::residual`]: (26)-(28) with rigid cables, (37)-(42) with massless
    /// springs, Fig. 5(b) with lumped masses.
    pub fn evaluate<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: [bool; CABLES]) -> Evaluation<S> {
        let e = self.instant(time, y, u, slack);
        Evaluation {
            kinematics: std::array::from_fn(|i| e.kinematics.cable(i)),
            acceleration: e.acceleration,
            tension: e.tension,
            tension_uncut: e.tension_uncut,
            slack,
            pull: e.pull,
            unstretched: e.unstretched,
            unstretched_rate: e.unstretched_rate,
            unstretched_acceleration: e.unstretched_acceleration,
            effect_rate: e.effect_rate,
            mass: e.mass.full(),
        }
    }

    /// Rates `ẏ` of all states: the solved-for form of the implicit system (29), (41).
    ///
    /// Layout of `y` and `rates`: pose `[x, y, φ]`, twist `[vx, vy, φ̇]`, then for each cable `l` (not in rigid cables),
    /// `l̇` (lumped mass only) and its effects' states.
    #[inline]
    pub fn rates<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: [bool; CABLES], rates: &mut [S]) {
        let e = self.instant(time, y, u, slack);
        self.write_instant(y, &e, rates);
    }

    /// Which cables are slack at this state: those whose tension would be negative; below (35) the paper asks for
    /// cables under tension.
    ///
    /// With elastic cables this is read off the spring and damper. Where tension depends on the acceleration (rigid,
    /// massless spring) tensions and accelerations form a linear complementarity problem with a positive definite
    /// matrix, so exactly one set is consistent; it is found by iteration, or by trying all sets where that cycles.
    pub fn slack_cables(&self, time: f64, y: &[f64], u: &Inputs) -> [bool; CABLES] {
        let next = |slack| self.instant(time, y, u, slack).tension_uncut.map(|t| t < 0.0);
        let mut slack = [false; CABLES];
        for _ in 0..CABLES {
            let found = next(slack);
            if found == slack {
                return slack;
            }
            slack = found;
        }
        let sets = (0..1_u32 << CABLES).map(|bits| std::array::from_fn(|i| bits >> i & 1 == 1));
        sets.into_iter().find(|set| next(*set) == *set).unwrap_or(slack)
    }
}

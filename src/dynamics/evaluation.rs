//! Everything known of the plant at one instant, as others read it.

use crate::kinematics::CableKinematics;
use crate::per_cable::{MAX_CABLES, PerCable};
use crate::plant::Plant;
use crate::scalar::Real;

use super::instant::{EffectRates, Instant, no_effect_rates, with_lanes};
use super::matrix3::Matrix3;
use super::{Inputs, MAX_EFFECT_STATES};

/// The plant at one instant: kinematics, tensions, accelerations.
///
/// Made by [`Plant::evaluate`]. Units: m, s, N, rad.
#[derive(Clone, Copy, Debug)]
pub struct Evaluation<S = f64> {
    /// Kinematics of the cables.
    pub kinematics: PerCable<CableKinematics<S>>,
    /// Accelerations `[ax, ay, φ̈]`.
    pub acceleration: [S; 3],
    /// Tensions `T_i`, zero where the cable is slack.
    pub tension: PerCable<S>,
    /// The tension before it is cut off at zero: negative where the cable is slack, which is that of the spring alone where
    /// the cable has no strain and its damper would pull.
    pub tension_uncut: PerCable<S>,
    /// Which cables were taken as slack.
    pub slack: PerCable<bool>,
    /// Pull of the winch on its cable, effects included.
    pub pull: PerCable<S>,
    /// Unstretched lengths `l_i` (in a rigid cable its length).
    pub unstretched: PerCable<S>,
    /// Rates `l̇_i`.
    pub unstretched_rate: PerCable<S>,
    /// Accelerations `l̈_i`; where `l̇` is no state (`rigid`, `massless_spring`) those of the length, `L̈_i`.
    pub unstretched_acceleration: PerCable<S>,
    /// Rates of the effect states of each cable.
    pub effect_rate: PerCable<[S; MAX_EFFECT_STATES]>,
    /// Mass matrix of the platform with the cables' inertia that moves with it.
    pub(crate) mass: Matrix3<S>,
}

impl<S: Real> Evaluation<S> {
    /// The evaluation of a plant with `cables` cables and those in `slack` carrying nothing.
    fn new<const LANES: usize>(
        e: &Instant<S, LANES>,
        effect_rate: &EffectRates<S, LANES>,
        cables: usize,
        slack: &PerCable<bool>,
    ) -> Self {
        let per_cable = |values: &[S; LANES]| PerCable::from_fn(cables, |i| values[i]);
        Self {
            kinematics: PerCable::from_fn(cables, |i| e.kinematics.cable(i)),
            acceleration: e.acceleration,
            tension: per_cable(&e.tension),
            tension_uncut: per_cable(&e.tension_uncut),
            slack: *slack,
            pull: per_cable(&e.pull),
            unstretched: per_cable(&e.unstretched),
            unstretched_rate: per_cable(&e.unstretched_rate),
            unstretched_acceleration: per_cable(&e.unstretched_acceleration),
            effect_rate: PerCable::from_fn(cables, |i| effect_rate[i]),
            mass: e.mass.full(),
        }
    }

    /// Takes up another instant of a plant with as many cables, and writes no more than these have; `effect_rate` where effects
    /// have states.
    fn take_up<const LANES: usize>(
        &mut self,
        e: &Instant<S, LANES>,
        effect_rate: Option<&EffectRates<S, LANES>>,
        slack: &PerCable<bool>,
    ) {
        for i in 0..slack.len() {
            self.kinematics[i] = e.kinematics.cable(i);
            self.tension[i] = e.tension[i];
            self.tension_uncut[i] = e.tension_uncut[i];
            self.pull[i] = e.pull[i];
            self.unstretched[i] = e.unstretched[i];
            self.unstretched_rate[i] = e.unstretched_rate[i];
            self.unstretched_acceleration[i] = e.unstretched_acceleration[i];
        }
        if let Some(effect_rate) = effect_rate {
            self.effect_rate.copy_from_slice(&effect_rate[..slack.len()]);
        }
        self.acceleration = e.acceleration;
        self.slack = *slack;
        self.mass = e.mass.full();
    }
}

/// What sensors read of a cable: a part of an [`Evaluation`], for hosts that ask for no more. Fields as there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reading {
    /// `L`.
    pub(crate) length: f64,
    pub(crate) tension: f64,
    pub(crate) unstretched: f64,
    pub(crate) unstretched_rate: f64,
}

/// Geometric strain `(L - l)/l` of a chord and an unstretched length (m).
#[inline]
pub(crate) fn strain<S: Real>(length: S, unstretched: S) -> S {
    (length - unstretched) / unstretched
}

/// The smallest and the largest value, over some evaluations, of each cable's tension before it is cut off (N), taken as
/// negative where the cable counts as slack: below zero a cable that counts as taut pushes, or one that counts as slack pulls.
#[derive(Clone, Debug)]
pub(crate) struct Margins {
    low: [f64; MAX_CABLES],
    high: [f64; MAX_CABLES],
}

impl Margins {
    /// Of no evaluation.
    pub(crate) const NONE: Self = Self { low: [f64::INFINITY; MAX_CABLES], high: [f64::NEG_INFINITY; MAX_CABLES] };

    /// How far below its smallest value a function may fall between the stages of a step, as part of what it varies by over
    /// them: 0.26 for a parabola between the third and the fourth stage of the explicit method, where they are farthest apart,
    /// and 0.20 in the implicit one.
    const BETWEEN_STAGES: f64 = 0.3;

    #[inline(always)]
    fn note<const LANES: usize>(&mut self, tension: &[f64; LANES], slack: &PerCable<bool>) {
        let slack = slack.padded::<LANES>();
        for i in 0..LANES {
            let margin = if slack[i] { -tension[i] } else { tension[i] };
            self.low[i] = if margin < self.low[i] { margin } else { self.low[i] };
            self.high[i] = if margin > self.high[i] { margin } else { self.high[i] };
        }
    }

    /// Whether one may have been below zero, at the evaluations or between them.
    pub(crate) fn may_be_negative(&self, cables: usize) -> bool {
        (0..cables).any(|i| self.low[i] < Self::BETWEEN_STAGES * (self.high[i] - self.low[i]))
    }
}

impl Plant {
    /// Evaluates the plant at time `time` (s), states `y`, inputs `u` (winch forces after their dead time), with the
    /// cables in `slack` carrying nothing.
    ///
    /// The accelerations solve the implicit system [`Plant::residual`]: (26)-(28) with rigid cables, (37)-(42) with massless
    /// springs, Fig. 5(b) with lumped masses.
    pub fn evaluate<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: &PerCable<bool>) -> Evaluation<S> {
        with_lanes!(self, LANES => {
            let mut effect_rate = no_effect_rates();
            let e = self.at(time.re()).instant::<S, LANES>(time, y, u, slack, &mut effect_rate);
            Evaluation::new(&e, &effect_rate, self.cables(), slack)
        })
    }

    /// As [`Plant::evaluate`], in place of an evaluation of a plant with as many cables.
    pub(crate) fn evaluate_into(&self, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>, out: &mut Evaluation) {
        with_lanes!(self, LANES => {
            let plant = self.at(time);
            let mut effect_rate = no_effect_rates();
            let e = plant.instant::<f64, LANES>(time, y, u, slack, &mut effect_rate);
            out.take_up(&e, plant.has.states.then_some(&effect_rate), slack);
        });
    }

    /// Hands what sensors read of each cable to `see`: as [`Plant::evaluate`], but where nothing of it follows from the accelerations
    /// these are not computed.
    #[inline(always)]
    pub(crate) fn see_cables(
        &self,
        time: f64,
        y: &[f64],
        u: &Inputs,
        slack: &PerCable<bool>,
        mut see: impl FnMut(usize, Reading),
    ) {
        with_lanes!(self, LANES => {
            let readings = self.at(time).instant_seen::<f64, LANES, _>(time, y, u, slack, |e| {
                std::array::from_fn::<_, LANES, _>(|i| {
                    let (length, tension) = (e.kinematics.length[i], e.tension[i]);
                    Reading { length, tension, unstretched: e.unstretched[i], unstretched_rate: e.unstretched_rate[i] }
                })
            });
            for (i, reading) in readings.into_iter().enumerate().take(self.cables()) {
                see(i, reading);
            }
        });
    }

    /// Rates `ẏ` of all states: the solved-for form of the implicit system (29), (41).
    ///
    /// Layout of `y` and `rates`: pose `[x, y, φ]`, twist `[vx, vy, φ̇]`, then for each cable `l` (not in rigid cables),
    /// `l̇` (lumped mass only) and its effects' states.
    #[inline]
    pub fn rates<S: Real>(&self, time: S, y: &[S], u: &Inputs<S>, slack: &PerCable<bool>, rates: &mut [S]) {
        with_lanes!(self, LANES => {
            self.at(time.re()).rates_here::<S, LANES>(time, y, u, slack, rates);
        });
    }

    /// As [`Plant::rates`], for the integrator, of a plant of one time ([`Plant::at`]); `margins` take note of how near each cable
    /// comes to going slack or taut.
    #[inline]
    pub(crate) fn rates_and_margins(
        &self,
        time: f64,
        y: &[f64],
        u: &Inputs,
        slack: &PerCable<bool>,
        rates: &mut [f64],
        margins: &mut Margins,
    ) {
        with_lanes!(self, LANES => {
            let tension = self.rates_here::<f64, LANES>(time, y, u, slack, rates);
            margins.note(&tension, slack);
        });
    }

    /// Changes the rates at `y` by what a change of the winch forces (N) does where it pulls apart ([`Plant::pulls_apart`]).
    #[inline]
    pub(crate) fn pull_harder(&self, y: &[f64], change: impl Fn(usize) -> f64, rates: &mut [f64]) {
        for (i, &at) in self.offset.iter().enumerate() {
            rates[at + 1] -= change(i) / self.constants.axial_mass(i, y[at]);
        }
    }

    /// Tensions (N) before they are cut off at zero.
    pub(crate) fn uncut_tensions(&self, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> PerCable<f64> {
        with_lanes!(self, LANES => {
            let e = self.at(time).instant::<f64, LANES>(time, y, u, slack, &mut no_effect_rates());
            PerCable::from_fn(self.cables(), |i| e.tension_uncut[i])
        })
    }

    /// Which cables are slack at this state: those whose tension would be negative; below (35) the paper asks for
    /// cables under tension.
    ///
    /// With elastic cables this is read off the spring and damper. Where tension depends on the acceleration (rigid,
    /// massless spring) tensions and accelerations form a linear complementarity problem with a positive definite
    /// matrix, so exactly one set is consistent; it is found by iteration, or by trying all sets where that cycles.
    pub fn slack_cables(&self, time: f64, y: &[f64], u: &Inputs) -> PerCable<bool> {
        let cables = self.cables();
        let next = |slack: &PerCable<bool>| self.uncut_tensions(time, y, u, slack).map(|t| t < 0.0);
        let mut slack = PerCable::filled(cables, false);
        for _ in 0..cables {
            let found = next(&slack);
            if found == slack {
                return slack;
            }
            slack = found;
        }
        let mut sets = (0..1_u32 << cables).map(|bits| PerCable::from_fn(cables, |i| bits >> i & 1 == 1));
        sets.find(|set| next(set) == *set).unwrap_or(slack)
    }
}

//! Exact derivatives of everything that a simulation shows, by dual numbers.

use num_dual::{Dual, Dual64};

use super::{Outputs, Shown, Simulation};
use crate::dynamics::{Evaluation, Inputs};
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;
use crate::scalar::Real;

/// A direction in which to differentiate: how fast time, states and commanded inputs change along it.
///
/// What a dead time holds back (the command of a delayed winch, the pose of a delayed sensor) is a given function of
/// time: it changes along `time` only.
#[derive(Clone, Copy, Debug)]
pub struct Direction<'a> {
    /// Of time.
    pub time: f64,
    /// Of the states, laid out as in [`crate::plant::Plant::rates`].
    pub states: &'a [f64],
    /// Of the inputs as commanded.
    pub inputs: Inputs,
}

/// Values (`re`) and derivatives along a [`Direction`] (`eps`), with each cable slack or taut as it is.
#[derive(Clone, Debug)]
pub struct Tangent {
    time: f64,
    inputs: Inputs,
    pose: [Dual64; 3],
    evaluation: Evaluation<Dual64>,
    /// The states.
    pub states: Vec<Dual64>,
    /// Rates of the states.
    pub rates: Vec<Dual64>,
    /// Accelerations of the true unstretched lengths (m/s²).
    pub unstretched_acceleration: PerCable<Dual64>,
}

impl Tangent {
    /// Whether it was made along this direction.
    pub(crate) fn is_along(&self, direction: &Direction<'_>) -> bool {
        self.time == direction.time
            && self.inputs == direction.inputs
            && self.states.iter().map(|state| &state.eps).eq(direction.states)
    }

    /// What the sensors of `plant` show.
    pub fn outputs(&self, plant: &Plant) -> Outputs<Dual64> {
        self.shown(plant).all()
    }

    /// The same, each value made when it is asked for.
    pub(crate) fn shown<'a>(&'a self, plant: &'a Plant) -> Shown<'a, Dual64> {
        let y = &self.states;
        Shown { plant, pose: self.pose, twist: [y[3], y[4], y[5]], e: &self.evaluation }
    }
}

impl Simulation {
    /// Values and derivatives along `direction`, now.
    pub fn tangent(&self, direction: &Direction<'_>) -> Tangent {
        let segment = self.inputs_felt();
        let time = Dual64::new(self.time, direction.time);
        let y: Vec<Dual64> = self.y.iter().zip(direction.states).map(|(y, d)| Dual64::new(*y, *d)).collect();
        let commanded = self.plant.driven(&direction.inputs);
        let winch = |i: usize| {
            let held_back = self.plant.cable[i].delay > 0.0;
            if held_back { direction.time * segment.slope.winch_force[i] } else { commanded.winch_force[i] }
        };
        let value = segment.value;
        let inputs = Inputs {
            winch_force: PerCable::from_fn(self.plant.cables(), |i| Dual64::new(value.winch_force[i], winch(i))),
            disturbance: std::array::from_fn(|k| Dual64::new(value.disturbance[k], direction.inputs.disturbance[k])),
        };
        let slack = self.slack_under(&value);
        let e = self.plant.evaluate(time, &y, &inputs, &slack);
        let mut rates = vec![Dual64::from(0.0); y.len()];
        self.plant.write_rates(&y, &e, &mut rates);
        let then = self.time - self.plant.pose_delay;
        let pose = match (self.poses.at(then), self.poses.rate_at(then)) {
            (Some(pose), Some(rate)) => std::array::from_fn(|k| Dual64::new(pose[k], direction.time * rate[k])),
            _ => [y[0], y[1], y[2]],
        };
        Tangent {
            time: direction.time,
            inputs: direction.inputs,
            pose,
            unstretched_acceleration: self.unstretched_acceleration(time, &y, &inputs, &rates, &e),
            evaluation: e,
            states: y,
            rates,
        }
    }

    /// Accelerations of the unstretched lengths now (m/s²).
    ///
    /// In a massless spring the rate follows from the other states; its own rate is the exact derivative along the
    /// motion.
    pub fn unstretched_accelerations(&self, e: &Evaluation) -> PerCable<f64> {
        if self.plant.data().cables.iter().all(|cable| cable.model != CableModel::MasslessSpring) {
            return e.unstretched_acceleration;
        }
        self.unstretched_acceleration(self.time, &self.y, &self.inputs_felt().value, &self.rates(), e)
    }

    fn unstretched_acceleration<S: Real>(
        &self,
        time: S,
        y: &[S],
        inputs: &Inputs<S>,
        rates: &[S],
        e: &Evaluation<S>,
    ) -> PerCable<S> {
        let data = &self.plant.data().cables;
        if data.iter().all(|cable| cable.model != CableModel::MasslessSpring) {
            return e.unstretched_acceleration;
        }
        let slope = self.inputs_felt().slope;
        let moving = |value: S, rate: f64| Dual::new(value, S::from(rate));
        let y: Vec<Dual<S>> = y.iter().zip(rates).map(|(y, rate)| Dual::new(*y, *rate)).collect();
        let inputs = Inputs {
            winch_force: PerCable::from_fn(data.len(), |i| moving(inputs.winch_force[i], slope.winch_force[i])),
            disturbance: std::array::from_fn(|k| moving(inputs.disturbance[k], slope.disturbance[k])),
        };
        let along = self.plant.evaluate(moving(time, 1.0), &y, &inputs, &e.slack);
        PerCable::from_fn(data.len(), |i| match data[i].model {
            CableModel::MasslessSpring => along.unstretched_rate[i].eps,
            _ => e.unstretched_acceleration[i],
        })
    }
}

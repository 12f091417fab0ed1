//! The force of a winch that follows a speed or a length, out of what its cable carries.

use crate::plant::Plant;
use crate::scalar::Real;
use crate::winch::{Reeled, servo_force};

use crate::per_cable::PerCable;

use super::{Inputs, elastic};

/// A cable as its servo sees it: length and speed of the chord, paid-out length and its rate, angular rate (m, m/s, rad/s).
pub(super) struct Held<S> {
    pub(super) chord: [S; 2],
    pub(super) paid_out: [S; 2],
    pub(super) angular_rate: S,
    pub(super) slack: bool,
}

impl Plant {
    /// The forces (N) that the drives make of their commands.
    pub(crate) fn drive_forces(&self, time: f64, y: &[f64], u: &Inputs, slack: &PerCable<bool>) -> PerCable<f64> {
        if !self.has.servo {
            return u.winch_force;
        }
        let e = self.evaluate(time, y, u, slack);
        PerCable::from_fn(self.cables(), |i| {
            let k = &e.kinematics[i];
            let (chord, paid_out) = ([k.length, k.speed], [e.unstretched[i], e.unstretched_rate[i]]);
            let held = Held { chord, paid_out, angular_rate: k.angular_rate, slack: slack[i] };
            self.servo(i, time, u.winch_force[i], &held, self.effect_states_in(i, y))
        })
    }

    /// The force (N) that the servo of `cable` makes of its command. Out of the way of the evaluation, which few models
    /// interrupt by it.
    #[inline(never)]
    pub(super) fn servo<S: Real>(&self, cable: usize, time: S, command: S, held: &Held<S>, states: &[S]) -> S {
        let (data, law) = (&self.data.cables[cable], &self.cable[cable].law);
        let tension = elastic::carried(data, law, time, held.chord, held.paid_out, states, held.slack);
        let [length, rate] = held.paid_out;
        servo_force(data, command, &Reeled { length, rate, angular_rate: held.angular_rate, tension })
    }
}

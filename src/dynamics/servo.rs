//! The force of a winch that follows a speed or a length, out of what its cable carries.

use crate::plant::Plant;
use crate::scalar::Real;
use crate::winch::{Reeled, servo_force};

use super::{MAX_EFFECT_STATES, elastic};

/// A cable as its servo sees it: length and speed of the chord, paid-out length and its rate, angular rate (m, m/s, rad/s).
pub(super) struct Held<S> {
    pub(super) chord: [S; 2],
    pub(super) paid_out: [S; 2],
    pub(super) angular_rate: S,
    pub(super) slack: bool,
}

impl Plant {
    /// The force (N) that the servo of `cable` makes of its command. Out of the way of the evaluation, which few models
    /// interrupt by it.
    #[inline(never)]
    pub(super) fn servo<S: Real>(
        &self,
        cable: usize,
        time: S,
        command: S,
        held: &Held<S>,
        states: &[S; MAX_EFFECT_STATES],
    ) -> S {
        let (data, law) = (&self.data.cables[cable], &self.cable[cable].law);
        let tension = elastic::carried(data, law, time, held.chord, held.paid_out, states, held.slack);
        let [length, rate] = held.paid_out;
        servo_force(data, command, &Reeled { length, rate, angular_rate: held.angular_rate, tension })
    }
}

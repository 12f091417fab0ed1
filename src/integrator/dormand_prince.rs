//! One explicit step: the pair of orders 5 and 4 of J. R. Dormand and P. J. Prince, *J. Comput. Appl. Math.* 6 (1980).
//!
//! Step size control, dense output and the test for stiffness follow E. Hairer, S. P. Nørsett, G. Wanner, *Solving Ordinary
//! Differential Equations I*, 2nd ed., 1993, sections II.4 to II.6, and *II*, 1996, section IV.2.

use super::radau::Outcome;
use super::vector::{Group, Vector, Work, root_mean};
use super::{Integrator, System};

/// Places of the stages in the step; those of the sixth and the seventh are both its end.
const C: [f64; 7] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];

/// Weights of the rates before it in the second to the sixth stage.
const A2: [f64; 1] = [1.0 / 5.0];
const A3: [f64; 2] = [3.0 / 40.0, 9.0 / 40.0];
const A4: [f64; 3] = [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0];
const A5: [f64; 4] = [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0];
const A6: [f64; 5] = [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0];

/// Weights of the step, order 5. Its end is the seventh stage, whose rates begin the next step. The second stage and the seventh
/// have none.
const B: [f64; 7] = [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0];

/// What they differ by from the weights of the embedded method of order 4.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Weights of the highest term of the dense output, order 4.
const D: [f64; 7] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

/// A step is made longer by so much at most, and shorter by so much at most (Hairer's values, as all of the control).
const LONGER: f64 = 10.0;
const SHORTER: f64 = 0.2;
const SAFETY: f64 = 0.9;
/// Error of the step before that counts at least, in units of the tolerance.
const LEAST_ERROR: f64 = 1e-4;
/// An error so small makes the next step [`LONGER`] whatever the one before was; most steps that a communication point cuts
/// short are such, and need no powers.
const TINY_ERROR: f64 = 1e-8;

/// Step size times the fastest rate at the end of the method's stability. On the negative real axis that is 3.3; steps that
/// it bounds settle a little below.
const END_OF_STABILITY: f64 = 3.0;
/// So many steps of one call at the end of stability make the equations stiff, and so many within it without a break make up
/// for them (Hairer's numbers). An implicit step after a jump of the inputs, with a new Jacobian, costs no more than those steps.
const STIFF_STEPS: u32 = 15;
const SMOOTH_STEPS: u32 = 6;

/// Whether it is stability that bounds the steps of a call.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stiffness {
    /// Steps at the end of stability.
    at_the_end: u32,
    /// Steps within it, without a break.
    within: u32,
}

impl Stiffness {
    /// Takes note of a step. Returns whether the equations are stiff.
    pub(super) fn note(&mut self, at_the_end: bool) -> bool {
        if at_the_end {
            self.within = 0;
            self.at_the_end += 1;
        } else if self.at_the_end > 0 {
            self.within += 1;
            if self.within == SMOOTH_STEPS {
                *self = Self::default();
            }
        }
        self.at_the_end >= STIFF_STEPS
    }
}

/// `to = start + h Σ weight k`.
#[inline(always)]
fn along<const GROUPS: usize, const N: usize>(
    to: &mut Vector<GROUPS>,
    start: &Vector<GROUPS>,
    h: f64,
    weights: [f64; N],
    k: [&Vector<GROUPS>; N],
) {
    let weights = weights.map(|w| w * h);
    let to = to.groups_mut();
    let count = to.len();
    let start = &start.groups()[..count];
    let k = k.map(|k| &k.groups()[..count]);
    for g in 0..count {
        let mut sum = start[g];
        for s in 0..N {
            sum += k[s][g] * weights[s];
        }
        to[g] = sum;
    }
}

/// Weights of the rates in the increment up to `fraction` of the step.
fn dense_weights(fraction: f64) -> [f64; 7] {
    let (theta, rest) = (fraction, 1.0 - fraction);
    std::array::from_fn(|s| {
        let (first, last) = (f64::from(u8::from(s == 0)), f64::from(u8::from(s == 6)));
        let bend = first - B[s];
        theta * (B[s] + rest * (bend + theta * (B[s] - last - bend + rest * D[s])))
    })
}

impl Integrator {
    /// One explicit step from `y`, with the rates there in `work`, to `arrival` (s). The end goes where the last implicit stage goes.
    pub(super) fn explicit_step<const GROUPS: usize>(
        &mut self,
        work: &mut Work<GROUPS>,
        system: &mut impl System,
        [t, arrival]: [f64; 2],
        y: &[f64],
        h: f64,
        rejected: bool,
    ) -> Outcome {
        work.start.copy_from_slice(y);
        let Work { rates: k1, stage, start, full, f: [k2, k3, k4, k5, k6, k7], .. } = work;
        let end = &mut full[2];
        along(stage, start, h, A2, [k1]);
        system.rates(t + C[1] * h, stage, k2);
        along(stage, start, h, A3, [k1, k2]);
        system.rates(t + C[2] * h, stage, k3);
        along(stage, start, h, A4, [k1, k2, k3]);
        system.rates(t + C[3] * h, stage, k4);
        along(stage, start, h, A5, [k1, k2, k3, k4]);
        system.rates(t + C[4] * h, stage, k5);
        along(stage, start, h, A6, [k1, k2, k3, k4, k5]);
        system.rates(arrival, stage, k6);
        along(end, start, h, [B[0], B[2], B[3], B[4], B[5]], [k1, k3, k4, k5, k6]);
        system.rates(arrival, end, k7);
        self.count_evaluations(6);
        let error = work.explicit_estimate(h);
        self.explicit_control(h, error, rejected)
    }

    /// Step size control with a share of the error before.
    fn explicit_control(&mut self, h: f64, error: f64, rejected: bool) -> Outcome {
        if !error.is_finite() {
            return Outcome::TooInaccurate(SHORTER * h);
        }
        if error >= 1.0 {
            return Outcome::TooInaccurate(h * (SAFETY / error.powf(0.17)).max(SHORTER));
        }
        let (last_step, last_error) = self.last;
        let before = if last_step == 0.0 {
            LEAST_ERROR
        } else if last_error > 0.0 {
            last_error
        } else {
            error.max(LEAST_ERROR)
        };
        let factor = if error < TINY_ERROR {
            LONGER
        } else {
            // Hairer's `before^0.04 / error^0.17`.
            (SAFETY * (before.powi(4) / error.powi(17)).powf(0.01)).clamp(SHORTER, LONGER)
        };
        self.last = (h, error.max(LEAST_ERROR));
        self.next_step = if rejected { h * factor.min(1.0) } else { h * factor };
        Outcome::Accepted
    }
}

impl<const GROUPS: usize> Work<GROUPS> {
    /// The embedded error estimate, in units of the tolerance.
    fn explicit_estimate(&self, h: f64) -> f64 {
        let weights = E.map(|e| e * h);
        let [_, k3, k4, k5, k6, k7] = self.f.each_ref().map(Vector::groups);
        let k1 = self.rates.groups();
        let mut sum = Group::ZERO;
        for ((((((k1, k3), k4), k5), k6), k7), weight) in
            k1.iter().zip(k3).zip(k4).zip(k5).zip(k6).zip(k7).zip(self.weight.groups())
        {
            let early = *k1 * weights[0] + *k3 * weights[2] + *k4 * weights[3];
            let error = (early + *k5 * weights[4] + *k6 * weights[5] + *k7 * weights[6]) * *weight;
            sum += error * error;
        }
        root_mean(sum, self.start.len())
    }

    /// Whether the explicit step of `h` (s) just computed is at the end of stability: by what its last two stages, at the same
    /// time, differ by in their rates and in their states.
    pub(super) fn is_at_end_of_stability(&self, h: f64) -> bool {
        let [.., k6, k7] = self.f.each_ref().map(Vector::groups);
        let (sixth, end) = (self.stage.groups(), self.full[2].groups());
        let (mut rates, mut states) = (Group::ZERO, Group::ZERO);
        for ((((k6, k7), sixth), end), weight) in k6.iter().zip(k7).zip(sixth).zip(end).zip(self.weight.groups()) {
            let rate = (*k7 - *k6) * *weight;
            rates += rate * rate;
            let state = (*end - *sixth) * *weight;
            states += state * state;
        }
        let count = self.start.len();
        h * root_mean(rates, count) > END_OF_STABILITY * root_mean(states, count)
    }

    /// State at `fraction` of the explicit step of `h` (s) just computed, on its dense output, into `stage`.
    pub(super) fn explicit_at(&mut self, h: f64, fraction: f64) {
        let Self { rates: k1, stage, start, f: [k2, k3, k4, k5, k6, k7], .. } = self;
        along(stage, start, h, dense_weights(fraction), [k1, k2, k3, k4, k5, k6, k7]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_have_their_orders() {
        let rows: [&[f64]; 6] = [&A2, &A3, &A4, &A5, &A6, &B];
        for (row, c) in rows.iter().zip(&C[1..]) {
            assert!((row.iter().sum::<f64>() - c).abs() < 1e-14, "row of {c}");
        }
        let moment =
            |weights: &[f64; 7], power: i32| weights.iter().zip(C).map(|(w, c)| w * c.powi(power)).sum::<f64>();
        for power in 0..5 {
            assert!((moment(&B, power) - 1.0 / f64::from(power + 1)).abs() < 1e-14, "B, {power}");
        }
        for power in 0..4 {
            assert!(moment(&E, power).abs() < 1e-14, "E, {power}");
            for fraction in [0.0, 0.2, 0.5, 0.9, 1.0_f64] {
                let wanted = fraction.powi(power + 1) / f64::from(power + 1);
                assert!((moment(&dense_weights(fraction), power) - wanted).abs() < 1e-13, "dense, {power}, {fraction}");
            }
        }
        assert!(moment(&E, 4).abs() > 1e-4, "the embedded method is of order 4");
    }
}

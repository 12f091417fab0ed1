//! One step: simplified Newton in the transformed stages, error estimate, step size.

use super::radau_coefficients::{
    ALPHA, BETA, C, E, END_RATES, GAMMA, T, T_INVERSE, T_INVERSE_C, T_INVERSE_SUM, transformed,
};
use super::vector::{Group, Vector, Work, root_mean};
use super::{Complex64, Integrator, System};

/// Most Newton iterations of one step.
const NEWTON_LIMIT: u32 = 8;
/// Defect that a step may leave: as the change that it would make without the Jacobian, in units of the tolerance.
///
/// A correction is small where the solution is near, but also where the Jacobian takes the equations for stiffer than they are:
/// friction that has begun to slide would be held as if it still stuck. Then the defect stays as large as it was.
const DEFECT: f64 = 0.01;
/// From one iteration to the next, the contraction of a larger defect that shows that the Jacobian is right.
const DEFECT_CONTRACTION: f64 = 0.1;
/// Contraction that is taken for granted after a single iteration.
const LEAST_CONTRACTION: f64 = 1e-3;
/// Iterations beyond the fewest that a step took with a Jacobian after which it is taken anew. It costs two to six of them, and is
/// worth it when as many were wasted. No more: the error estimate is made with it, too, and one that takes cables for held by friction
/// that slide no longer hides their error.
const JACOBIAN_PRICE: u32 = 2;
/// Newton's method is believed to contract less well by so much with each step that does not measure how well it does. A measured
/// contraction lasts for some ten steps where it was a thousandth of what suffices.
const GROWTH: f64 = 1.5;
/// Defect, in units of the tolerance, up to which a contraction that an earlier step measured is believed of it: one that the error
/// estimate might let pass as well. Friction may have begun to slide since.
const MOST_BELIEVED: f64 = 1.0;
/// Relative change of step size up to which the factors are kept.
const SAME_STEP: f64 = 1e-6;

/// What became of a step.
pub(super) enum Outcome {
    /// The stages are in `z`.
    Accepted,
    /// The error estimate asks for this step size (s).
    TooInaccurate(f64),
    /// Newton's method did not converge.
    NotConverged,
}

/// Factors the system for steps of `h` (s).
pub(super) fn factor(system: &mut impl System, h: f64) {
    system.factor(GAMMA / h, Complex64::new(ALPHA / h, BETA / h));
}

/// Whether no more than [`DEFECT`] is left of a defect after its correction, going by its contraction from `before`.
fn settles(defect: f64, before: f64) -> bool {
    defect * defect <= DEFECT * (before - defect)
}

/// How Newton's method contracts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contraction {
    /// Of correction and defect from the first iteration to the second, the larger one, as last measured with the Jacobian in use
    /// and grown since; 0 where it is not known.
    pub rate: f64,
    /// Sizes of the first correction and its defect when it was measured, in units of the tolerance.
    pub first: [f64; 2],
}

impl Contraction {
    /// What a first correction and its defect of these sizes contract by at most: larger ones than those at which it was measured
    /// say that the equations bend more, or are others. Infinite where it is not known.
    fn of(&self, sizes: [f64; 2]) -> f64 {
        let [correction, defect] = std::array::from_fn(|k| sizes[k] / self.first[k]);
        if self.rate > 0.0 { self.rate * correction.max(defect).max(1.0) } else { f64::INFINITY }
    }

    fn measured(rate: f64, first: [f64; 2]) -> Self {
        // None is no contraction.
        if rate < 1.0 && first.iter().all(|size| *size > 0.0) {
            Self { rate: rate.max(f64::EPSILON), first }
        } else {
            Self::default()
        }
    }

    /// After so much `growth`.
    fn grown(self, growth: f64) -> Self {
        Self::measured(self.rate * growth, self.first)
    }
}

impl Integrator {
    fn prepare(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64) {
        if !self.has_jacobian || self.jacobian_excess >= JACOBIAN_PRICE {
            system.linearise(t, y);
            self.statistics.jacobians += 1;
            self.jacobian_time = t;
            self.jacobian_state.copy_from_slice(y);
            self.has_jacobian = true;
            self.jacobian_least = 0;
            self.jacobian_excess = 0;
            self.factored_step = 0.0;
        }
        if (h - self.factored_step).abs() > SAME_STEP * h {
            factor(system, h);
            self.statistics.factorisations += 1;
            let longer = if self.factored_step > 0.0 { h / self.factored_step } else { f64::INFINITY };
            self.contraction = self.contraction.grown(longer.max(1.0));
            self.has_lead = false;
            self.factored_step = h;
        }
    }

    /// One step attempt from `y` with the rates there in `work`.
    pub(super) fn implicit_step<const GROUPS: usize>(
        &mut self,
        work: &mut Work<GROUPS>,
        system: &mut impl System,
        t: f64,
        y: &[f64],
        h: f64,
        rejected: bool,
    ) -> Outcome {
        self.prepare(system, t, y, h);
        work.start.copy_from_slice(y);
        let led = std::mem::take(&mut self.has_lead);
        work.follow_trend(led);
        let mut last_change = work.guess(system, h);
        let mut last_defect = f64::NAN;
        let mut iterations = 0;
        // The first iteration has solved the step as far as its defect tells, and the second found nothing left to correct.
        let mut solved_at_once = false;
        let mut needless = 0;
        loop {
            if iterations == NEWTON_LIMIT {
                return Outcome::NotConverged;
            }
            let defect = work.correct(system, t, h);
            self.count_evaluations(3);
            let [change, lead] = work.apply_correction();
            iterations += 1;
            self.statistics.newton_iterations += 1;
            if !change.is_finite() {
                return Outcome::NotConverged;
            }
            // The first iteration is told by all that the guess lacked, what is known from the last step included.
            let corrected = if iterations == 1 { lead } else { change };
            let contraction = if last_change > 0.0 { corrected / last_change } else { 0.0 };
            let known = if iterations == 1 { self.contraction.of([change, defect]) } else { f64::INFINITY };
            // Large parts of the motion that the guess has right may hide a small part that converges slowly.
            let theta = if iterations == 1 { contraction.max(LEAST_CONTRACTION).min(known) } else { contraction };
            let small = change == 0.0 || theta < 0.99 && theta / (1.0 - theta) * change <= self.newton_tolerance;
            if iterations == 2 {
                let rate = contraction.max(defect / last_defect);
                self.contraction = Contraction::measured(rate, [last_change, last_defect]);
                needless = u32::from(solved_at_once && change <= self.newton_tolerance && defect <= DEFECT);
            }
            last_change = change;
            let mut before = if iterations == 1 { work.first_defect(h) } else { last_defect };
            if iterations == 1 && led {
                // A lead makes the defect smaller and says nothing of the Jacobian: what the last step without one has shown counts too.
                before = if self.settling > 0.0 { before.min(defect / (self.settling * contraction)) } else { defect };
            } else if iterations == 1 {
                let settling = defect / before / contraction;
                self.settling = if settling.is_finite() { settling } else { 0.0 };
            }
            if defect <= MOST_BELIEVED {
                before = before.max(defect / known);
            }
            let settled = settles(defect, before);
            let solved = defect <= DEFECT || settled || iterations > 1 && defect <= DEFECT_CONTRACTION * last_defect;
            solved_at_once = iterations == 1 && solved;
            last_defect = defect;
            if small && solved {
                break;
            }
            if iterations > 1 {
                if theta >= 0.99 {
                    // At the level of rounding the iteration no longer contracts, and need not.
                    if change < self.newton_tolerance && solved {
                        break;
                    }
                    return Outcome::NotConverged;
                }
                let left = (NEWTON_LIMIT - iterations) as i32;
                if theta.powi(left) / (1.0 - theta) * change > self.newton_tolerance {
                    return Outcome::NotConverged;
                }
            }
        }
        if iterations == 1 {
            self.contraction = self.contraction.grown(GROWTH);
        }
        self.has_lead = self.contraction.rate > 0.0 || self.settling > 0.0;
        if !led {
            work.rise.iter_mut().for_each(|rise| rise.groups_mut().fill(Group::ZERO));
        }
        self.charge(iterations - needless);
        let error = self.estimate(work, system, t, h, rejected);
        self.control(h, error, iterations, rejected)
    }

    /// Counts what a step has cost beyond the cheapest one with this Jacobian.
    fn charge(&mut self, iterations: u32) {
        if self.jacobian_least == 0 || iterations < self.jacobian_least {
            self.jacobian_least = iterations;
        }
        self.jacobian_excess = self.jacobian_excess.saturating_add(iterations - self.jacobian_least);
    }

    /// The embedded error estimate, in units of the tolerance.
    fn estimate<const GROUPS: usize>(
        &mut self,
        work: &mut Work<GROUPS>,
        system: &mut impl System,
        t: f64,
        h: f64,
        rejected: bool,
    ) -> f64 {
        let weights = const { transformed(E) }.map(|e| e / h);
        // The stage holds the difference for a second pass.
        let Work { stage, error, rates, w, .. } = work;
        let (error, rates) = (error.groups_mut(), rates.groups());
        weighed(stage, weights, w, |k, difference| {
            error[k] = difference + rates[k];
            difference
        });
        system.solve_real(&mut work.error);
        let mut error = work.norm(&work.error);
        if error >= 1.0 && (rejected || self.last.0 == 0.0) {
            let moved = work.f[0].iter_mut().zip(&*work.start).zip(&*work.error);
            moved.for_each(|((moved, start), error)| *moved = start + error);
            system.rates(t, &work.f[0], &mut work.error);
            self.count_evaluations(1);
            work.error.iter_mut().zip(&*work.stage).for_each(|(error, difference)| *error += difference);
            system.solve_real(&mut work.error);
            error = work.norm(&work.error);
        }
        if error.is_finite() { error.max(1e-10) } else { f64::INFINITY }
    }

    /// Step size control after Gustafsson.
    fn control(&mut self, h: f64, error: f64, iterations: u32, rejected: bool) -> Outcome {
        let limit = f64::from(NEWTON_LIMIT);
        let safety = 0.8 * (2.0 * limit + 1.0) / (2.0 * limit + f64::from(iterations));
        // The fourth root of the error over the safety factor, its bounds without a root.
        let bounded = |fourth: f64| {
            let over = fourth / safety.powi(4);
            let bounds = (0.125_f64.powi(4), 5.0_f64.powi(4));
            if over <= bounds.0 {
                0.125
            } else if over >= bounds.1 {
                5.0
            } else {
                over.sqrt().sqrt()
            }
        };
        let mut quotient = bounded(error);
        if error >= 1.0 || !error.is_finite() {
            return Outcome::TooInaccurate(if error.is_finite() { h / quotient } else { 0.1 * h });
        }
        let (last_step, last_error) = self.last;
        if last_step > 0.0 && last_error > 0.0 {
            quotient = quotient.max(bounded((last_step / h).powi(4) * (error * error / last_error)));
        }
        self.last = (h, error.max(1e-2));
        // A step a little longer is not worth new factors.
        let keep = (1.0..1.2).contains(&(1.0 / quotient));
        let next = if keep { h } else { h / quotient };
        self.next_step = if rejected { next.min(h) } else { next };
        Outcome::Accepted
    }
}

impl<const GROUPS: usize> Work<GROUPS> {
    /// Places the stages by the answer from the start of the step, where the rates are known, were the system linear; and by what
    /// that answer lacked in the last step, as far as this is known. Inputs may have jumped since: then that is no more than a guess,
    /// and Newton's method has that much more to correct.
    ///
    /// Returns the size of the answer beside steady rates: the part of it that the Jacobian made, by which its error is to be judged.
    /// A large steady motion would hide how slowly a small rest converges.
    fn guess(&mut self, system: &mut impl System, h: f64) -> f64 {
        let [re, im] = self.complex.each_mut().map(Vector::groups_mut);
        for (rates, (real, (re, im))) in
            self.rates.groups().iter().zip(self.error.groups_mut().iter_mut().zip(re.iter_mut().zip(im)))
        {
            *real = *rates * T_INVERSE_SUM[0];
            *re = *rates * T_INVERSE_SUM[1];
            *im = *rates * T_INVERSE_SUM[2];
        }
        system.solve_real(&mut self.error);
        self.solve_complex(system);
        let steady = T_INVERSE_C.map(|c| c * h);
        let mut sum = Group::ZERO;
        for k in 0..self.start.groups().len() {
            let [a, b, c] = self.correction(k);
            let rates = self.rates.groups()[k];
            let beside = [a - rates * steady[0], b - rates * steady[1], c - rates * steady[2]];
            sum += self.squares(k, beside);
            let lead = self.lead.each_ref().map(|lead| lead.groups()[k]);
            self.place_stages(k, [a + lead[0], b + lead[1], c + lead[2]]);
        }
        root_mean(sum, 3 * self.error.len())
    }

    /// What the guess will lack, going by the last two steps, where there is a lead; nothing otherwise.
    fn follow_trend(&mut self, led: bool) {
        for (lead, rise) in self.lead.iter_mut().zip(&self.rise) {
            for (lead, rise) in lead.groups_mut().iter_mut().zip(rise.groups()) {
                *lead = if led { *lead + *rise } else { Group::ZERO };
            }
        }
    }

    fn solve_complex(&mut self, system: &mut impl System) {
        let [re, im] = &mut self.complex;
        system.solve_complex(re, im);
    }

    /// Size of the defect of stages that all stand at the start of the step.
    fn first_defect(&self, h: f64) -> f64 {
        self.norm(&self.rates) * T_INVERSE_SUM[0] * h / GAMMA
    }

    /// The correction of the stages by one Newton iteration, into `error` and `complex`. Returns the size of the defect, what the
    /// stages lack of solving the step.
    fn correct(&mut self, system: &mut impl System, t: f64, h: f64) -> f64 {
        for s in 0..3 {
            system.rates(t + C[s] * h, &self.full[s], &mut self.f[s]);
        }
        let (gamma, alpha, beta) = (GAMMA / h, ALPHA / h, BETA / h);
        let [f0, f1, f2, ..] = self.f.each_ref().map(Vector::groups);
        let [w0, w1, w2] = self.w.each_ref().map(Vector::groups);
        let weights = self.weight.groups();
        let [re, im] = self.complex.each_mut().map(Vector::groups_mut);
        let right = self.error.groups_mut().iter_mut().zip(re.iter_mut().zip(im));
        let mut sum = Group::ZERO;
        for (((((((real, (re, im)), f0), f1), f2), w0), w1), (w2, weight)) in
            right.zip(f0).zip(f1).zip(f2).zip(w0).zip(w1).zip(w2.iter().zip(weights))
        {
            let g = |s: usize| *f0 * T_INVERSE[s][0] + *f1 * T_INVERSE[s][1] + *f2 * T_INVERSE[s][2];
            *real = g(0) - *w0 * gamma;
            *re = g(1) - *w1 * alpha + *w2 * beta;
            *im = g(2) - *w2 * alpha - *w1 * beta;
            let weighed = *real * *weight;
            sum += weighed * weighed;
        }
        system.solve_real(&mut self.error);
        self.solve_complex(system);
        // The real part of it stands for all.
        root_mean(sum, self.error.len()) * h / GAMMA
    }

    /// Adds the correction to the transformed stages and places the stages anew. Returns the sizes of the correction and of all
    /// corrections, in units of the tolerance.
    fn apply_correction(&mut self) -> [f64; 2] {
        let (mut of_this, mut of_all) = (Group::ZERO, Group::ZERO);
        for k in 0..self.start.groups().len() {
            let correction = self.correction(k);
            let (mut w, mut all) = ([Group::ZERO; 3], [Group::ZERO; 3]);
            for s in 0..3 {
                w[s] = self.w[s].groups()[k] + correction[s];
                all[s] = self.lead[s].groups()[k] + correction[s];
                self.lead[s].groups_mut()[k] = all[s];
                self.rise[s].groups_mut()[k] += correction[s];
            }
            of_this += self.squares(k, correction);
            of_all += self.squares(k, all);
            self.place_stages(k, w);
        }
        [of_this, of_all].map(|sum| root_mean(sum, 3 * self.error.len()))
    }

    /// Group `k` of the correction.
    #[inline(always)]
    fn correction(&self, k: usize) -> [Group; 3] {
        [self.error.groups()[k], self.complex[0].groups()[k], self.complex[1].groups()[k]]
    }

    /// The squares of values of group `k` in the transformed stages, in units of the tolerance, summed over the stages.
    #[inline(always)]
    fn squares(&self, k: usize, [a, b, c]: [Group; 3]) -> Group {
        let weight = self.weight.groups()[k];
        (a * a + b * b + c * c) * (weight * weight)
    }

    /// Takes up group `k` of the transformed increments and places the stages there, `Z = T W`.
    #[inline(always)]
    fn place_stages(&mut self, k: usize, w: [Group; 3]) {
        let start = self.start.groups()[k];
        let stages = [
            start + (w[0] * T[0][0] + w[1] * T[0][1] + w[2] * T[0][2]),
            start + (w[0] * T[1][0] + w[1] * T[1][1] + w[2] * T[1][2]),
            start + (w[0] * T[2][0] + w[1] * T[2][1]),
        ];
        for s in 0..3 {
            self.w[s].groups_mut()[k] = w[s];
            self.full[s].groups_mut()[k] = stages[s];
        }
    }

    /// Rates at the end of the step: the collocation polynomial's slope there, which is what Newton's method made of them.
    pub(super) fn end_rates(&mut self, h: f64) {
        let weights = const { transformed(END_RATES) }.map(|w| w / h);
        let Self { rates, w, .. } = self;
        weighed(rates, weights, w, |_, sum| sum);
    }

    /// The state on the collocation polynomial at these weights of the transformed increments, into `stage`.
    pub(super) fn place(&mut self, weights: [f64; 3]) {
        let Self { stage, start, w, .. } = self;
        weighed(stage, weights, w, |k, sum| start.groups()[k] + sum);
    }
}

/// Writes what `value` makes of each group's place and its sum of the transformed increments `w`, weighed.
#[inline(always)]
fn weighed<const GROUPS: usize>(
    to: &mut Vector<GROUPS>,
    weights: [f64; 3],
    w: &[Vector<GROUPS>; 3],
    mut value: impl FnMut(usize, Group) -> Group,
) {
    let [w0, w1, w2] = w.each_ref().map(Vector::groups);
    for (k, to) in to.groups_mut().iter_mut().enumerate() {
        *to = value(k, w0[k] * weights[0] + w1[k] * weights[1] + w2[k] * weights[2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contraction_holds_where_it_was_measured() {
        let contraction = Contraction::measured(1e-4, [2.0, 3.0]);
        assert_eq!(contraction.of([1.0, 1.0]), 1e-4);
        // A larger correction, or a larger defect, contracts less.
        assert_eq!(contraction.of([8.0, 3.0]), 4e-4);
        assert_eq!(contraction.of([1.0, 30.0]), 1e-3);
        assert_eq!(contraction.grown(4.0).of([2.0, 3.0]), 4e-4);
    }

    #[test]
    fn what_does_not_contract_is_not_known() {
        for unknown in [
            Contraction::default(),
            Contraction::measured(1.0, [1.0, 1.0]),
            Contraction::measured(f64::NAN, [1.0, 1.0]),
            Contraction::measured(1e-3, [0.0, 1.0]),
            Contraction::measured(0.5, [1.0, 1.0]).grown(2.0),
            Contraction::default().grown(f64::INFINITY),
        ] {
            assert_eq!(unknown, Contraction::default());
            assert_eq!(unknown.of([1.0, 1.0]), f64::INFINITY);
        }
        // A linear system leaves nothing of a correction: that much is taken for rounding.
        assert!(Contraction::measured(0.0, [1.0, 1.0]).rate > 0.0);
    }
}

//! One step: simplified Newton in the transformed stages, error estimate, step size.

use super::radau_coefficients::{ALPHA, BETA, C, E, GAMMA, T, T_INVERSE, T_INVERSE_C, T_INVERSE_SUM};
use super::vector::{Vector, Work, each, root_mean};
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
/// What a new Jacobian and its factors cost, in Newton iterations. When an old one has cost that much more than it did at its
/// best, it is taken anew: then neither choice would have saved more than half.
const JACOBIAN_PRICE: u32 = 1;
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
        let mut last_change = work.guess(system, h);
        let mut last_defect = f64::NAN;
        let mut iterations = 0;
        loop {
            if iterations == NEWTON_LIMIT {
                return Outcome::NotConverged;
            }
            let defect = work.correct(system, t, h);
            self.count_evaluations(3);
            let change = work.apply_correction([0.0; 3]);
            iterations += 1;
            self.statistics.newton_iterations += 1;
            if !change.is_finite() {
                return Outcome::NotConverged;
            }
            let mut theta = if last_change > 0.0 { change / last_change } else { 0.0 };
            if iterations == 1 {
                // Large parts of the motion that the guess has right may hide a small part that converges slowly.
                theta = theta.max(LEAST_CONTRACTION);
            }
            last_change = change;
            let small = change == 0.0 || theta < 0.99 && theta / (1.0 - theta) * change <= self.newton_tolerance;
            let solved = defect <= DEFECT
                || settles(defect, if iterations == 1 { work.first_defect(h) } else { last_defect })
                || iterations > 1 && defect <= DEFECT_CONTRACTION * last_defect;
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
        self.charge(iterations);
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
        let weights = E.map(|e| e / h);
        let [z0, z1, z2] = work.z.each_ref().map(Vector::groups);
        let rates = work.rates.groups();
        // `w[0]` is done with; it keeps the difference for a second pass.
        let out = work.error.groups_mut().iter_mut().zip(work.w[0].groups_mut());
        for ((((error, kept), rates), z0), (z1, z2)) in out.zip(rates).zip(z0).zip(z1.iter().zip(z2)) {
            *kept = each(|l| weights[0] * z0[l] + weights[1] * z1[l] + weights[2] * z2[l]);
            *error = each(|l| kept[l] + rates[l]);
        }
        system.solve_real(&mut work.error);
        let mut error = work.norm(&work.error);
        if error >= 1.0 && (rejected || self.last.0 == 0.0) {
            for ((stage, start), error) in work.stage.iter_mut().zip(&*work.start).zip(&*work.error) {
                *stage = start + error;
            }
            system.rates(t, &work.stage, &mut work.error);
            self.count_evaluations(1);
            for (error, kept) in work.error.iter_mut().zip(&*work.w[0]) {
                *error += kept;
            }
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
        if last_step > 0.0 {
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
    /// The correction of stages that all stand at the start of the step, where the rates are known: the answer, were the
    /// system linear. Nothing older than this step is used, since the inputs may have jumped.
    ///
    /// Returns its size beside steady rates: the part of it that the Jacobian made, by which its error is to be judged. A large
    /// steady motion would hide how slowly a small rest converges.
    fn guess(&mut self, system: &mut impl System, h: f64) -> f64 {
        let [re, im] = self.complex.each_mut().map(Vector::groups_mut);
        for (rates, (real, (re, im))) in
            self.rates.groups().iter().zip(self.error.groups_mut().iter_mut().zip(re.iter_mut().zip(im)))
        {
            *real = rates.map(|rate| T_INVERSE_SUM[0] * rate);
            *re = rates.map(|rate| T_INVERSE_SUM[1] * rate);
            *im = rates.map(|rate| T_INVERSE_SUM[2] * rate);
        }
        system.solve_real(&mut self.error);
        self.solve_complex(system);
        for w in &mut self.w {
            w.groups_mut().fill([0.0; 4]);
        }
        self.apply_correction(T_INVERSE_C.map(|c| c * h))
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
        let mut sum = [0.0; 4];
        for (((((((real, (re, im)), f0), f1), f2), w0), w1), (w2, weight)) in
            right.zip(f0).zip(f1).zip(f2).zip(w0).zip(w1).zip(w2.iter().zip(weights))
        {
            let g = |s: usize| each(|l| T_INVERSE[s][0] * f0[l] + T_INVERSE[s][1] * f1[l] + T_INVERSE[s][2] * f2[l]);
            let [g0, g1, g2] = [g(0), g(1), g(2)];
            *real = each(|l| g0[l] - gamma * w0[l]);
            *re = each(|l| g1[l] - alpha * w1[l] + beta * w2[l]);
            *im = each(|l| g2[l] - alpha * w2[l] - beta * w1[l]);
            sum = each(|l| sum[l] + (real[l] * weight[l]) * (real[l] * weight[l]));
        }
        system.solve_real(&mut self.error);
        self.solve_complex(system);
        // The real part of it stands for all.
        root_mean(sum, self.error.len()) * h / GAMMA
    }

    /// Adds the correction to the transformed stages and places the stages anew, `Z = T W`. Returns the size of the correction
    /// less `steady` times the rates, in units of the tolerance.
    fn apply_correction(&mut self, steady: [f64; 3]) -> f64 {
        let [w0, w1, w2] = self.w.each_mut().map(Vector::groups_mut);
        let [z0, z1, z2] = self.z.each_mut().map(Vector::groups_mut);
        let [full0, full1, full2] = self.full.each_mut().map(Vector::groups_mut);
        let (real, [re, im]) = (self.error.groups(), self.complex.each_ref().map(Vector::groups));
        let (start, rates, weight) = (self.start.groups(), self.rates.groups(), self.weight.groups());
        let mut sum = [0.0; 4];
        for k in 0..start.len() {
            let (real, re, im) = (real[k], re[k], im[k]);
            let part = |correction: [f64; 4], s: usize| each(|l| correction[l] - steady[s] * rates[k][l]);
            let (a, b, c) = (part(real, 0), part(re, 1), part(im, 2));
            let square = each(|l| a[l] * a[l] + b[l] * b[l] + c[l] * c[l]);
            sum = each(|l| sum[l] + square[l] * (weight[k][l] * weight[k][l]));
            let (a, b, c) = (each(|l| w0[k][l] + real[l]), each(|l| w1[k][l] + re[l]), each(|l| w2[k][l] + im[l]));
            (w0[k], w1[k], w2[k]) = (a, b, c);
            let (za, zb, zc) = (
                each(|l| T[0][0] * a[l] + T[0][1] * b[l] + T[0][2] * c[l]),
                each(|l| T[1][0] * a[l] + T[1][1] * b[l] + T[1][2] * c[l]),
                each(|l| T[2][0] * a[l] + T[2][1] * b[l]),
            );
            (z0[k], z1[k], z2[k]) = (za, zb, zc);
            full0[k] = each(|l| start[k][l] + za[l]);
            full1[k] = each(|l| start[k][l] + zb[l]);
            full2[k] = each(|l| start[k][l] + zc[l]);
        }
        root_mean(sum, 3 * self.error.len())
    }
}

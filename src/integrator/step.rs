//! One step: simplified Newton in the transformed stages, error estimate, step size.

use super::coefficients::{ALPHA, BETA, C, E, GAMMA, T, T_INVERSE, T_INVERSE_C, T_INVERSE_SUM};
use super::{Complex64, Radau, System};

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

// The loops below stand in functions of their own, whose arguments the compiler knows to be separate.

/// Adds a correction to the transformed stages.
#[inline(never)]
fn add(real: &[f64], complex: &[Complex64], w0: &mut [f64], w1: &mut [f64], w2: &mut [f64]) {
    let n = real.len();
    let (complex, w0, w1, w2) = (&complex[..n], &mut w0[..n], &mut w1[..n], &mut w2[..n]);
    for k in 0..n {
        w0[k] += real[k];
        w1[k] += complex[k].re;
        w2[k] += complex[k].im;
    }
}

/// Transforms the stages back: `Z = T W`.
#[inline(never)]
fn transform(w0: &[f64], w1: &[f64], w2: &[f64], z0: &mut [f64], z1: &mut [f64], z2: &mut [f64]) {
    let n = w0.len();
    let (w1, w2, z0, z1, z2) = (&w1[..n], &w2[..n], &mut z0[..n], &mut z1[..n], &mut z2[..n]);
    for k in 0..n {
        z0[k] = T[0][0] * w0[k] + T[0][1] * w1[k] + T[0][2] * w2[k];
        z1[k] = T[1][0] * w0[k] + T[1][1] * w1[k] + T[1][2] * w2[k];
        z2[k] = T[2][0] * w0[k] + T[2][1] * w1[k];
    }
}

/// What the stages with rates `f` lack of solving the step of `h` (s): the right-hand sides of the correction.
#[inline(never)]
fn defect(h: f64, f: [&[f64]; 3], w: [&[f64]; 3], real: &mut [f64], complex: &mut [Complex64]) {
    let n = real.len();
    let ([f0, f1, f2], [w0, w1, w2]) = (f.map(|f| &f[..n]), w.map(|w| &w[..n]));
    let complex = &mut complex[..n];
    let (gamma, alpha, beta) = (GAMMA / h, ALPHA / h, BETA / h);
    for k in 0..n {
        let g = |s: usize| T_INVERSE[s][0] * f0[k] + T_INVERSE[s][1] * f1[k] + T_INVERSE[s][2] * f2[k];
        real[k] = g(0) - gamma * w0[k];
        complex[k].re = g(1) - alpha * w1[k] + beta * w2[k];
        complex[k].im = g(2) - alpha * w2[k] - beta * w1[k];
    }
}

/// Whether no more than [`DEFECT`] is left of a defect after its correction, going by its contraction from `before`.
fn settles(defect: f64, before: f64) -> bool {
    defect * defect <= DEFECT * (before - defect)
}

impl Radau {
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

    /// One step attempt from `y` with the rates there in `rates`.
    pub(super) fn step(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64, rejected: bool) -> Outcome {
        self.prepare(system, t, y, h);
        self.guess(system);
        let mut last_change = self.curved(h);
        self.apply_correction();
        let mut last_defect = f64::NAN;
        let mut iterations = 0;
        loop {
            if iterations == NEWTON_LIMIT {
                return Outcome::NotConverged;
            }
            let defect = self.correct(system, t, y, h);
            let change = self.apply_correction();
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
                || settles(defect, if iterations == 1 { self.first_defect(h) } else { last_defect })
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
        let error = self.estimate(system, t, y, h, rejected);
        self.control(h, error, iterations, rejected)
    }

    /// Counts what a step has cost beyond the cheapest one with this Jacobian.
    fn charge(&mut self, iterations: u32) {
        if self.jacobian_least == 0 || iterations < self.jacobian_least {
            self.jacobian_least = iterations;
        }
        self.jacobian_excess = self.jacobian_excess.saturating_add(iterations - self.jacobian_least);
    }

    /// The correction of stages that all stand at the start of the step, where the rates are known: the answer, were the
    /// system linear. Nothing older than this step is used, since the inputs may have jumped.
    fn guess(&mut self, system: &mut impl System) {
        for s in 0..3 {
            self.w[s].fill(0.0);
        }
        for ((rate, error), complex) in self.rates.iter().zip(&mut self.error).zip(&mut self.complex) {
            *error = T_INVERSE_SUM[0] * rate;
            *complex = Complex64::new(T_INVERSE_SUM[1] * rate, T_INVERSE_SUM[2] * rate);
        }
        system.solve_real(&mut self.error);
        system.solve_complex(&mut self.complex);
    }

    /// Size of the guess beside steady rates: the part of it that the Jacobian made, by which its error is to be judged. A large
    /// steady motion would hide how slowly a small rest converges.
    fn curved(&self, h: f64) -> f64 {
        let mut sum = 0.0;
        for (k, rate) in self.rates.iter().enumerate() {
            let steady = h * rate;
            let real = self.error[k] - T_INVERSE_C[0] * steady;
            let re = self.complex[k].re - T_INVERSE_C[1] * steady;
            let im = self.complex[k].im - T_INVERSE_C[2] * steady;
            sum += (real * real + re * re + im * im) * (self.weight[k] * self.weight[k]);
        }
        (sum / (3 * self.rates.len()) as f64).sqrt()
    }

    /// Size of the [`defect`] of stages that all stand at the start of the step.
    fn first_defect(&self, h: f64) -> f64 {
        self.norm(&self.rates) * T_INVERSE_SUM[0] * h / GAMMA
    }

    /// The correction of the stages by one Newton iteration, into `error` and `complex`; returns the size of the [`defect`].
    fn correct(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64) -> f64 {
        for s in 0..3 {
            for ((stage, y), z) in self.stage.iter_mut().zip(y).zip(&self.z[s]) {
                *stage = y + z;
            }
            system.rates(t + C[s] * h, &self.stage, &mut self.f[s]);
        }
        self.count_evaluations(3);
        let [f0, f1, f2] = &self.f;
        let [w0, w1, w2] = &self.w;
        defect(h, [f0, f1, f2], [w0, w1, w2], &mut self.error, &mut self.complex);
        // Its real part stands for all of it.
        let size = self.norm(&self.error) * h / GAMMA;
        system.solve_real(&mut self.error);
        system.solve_complex(&mut self.complex);
        size
    }

    /// Adds the correction to the stages; returns its size in units of the tolerance.
    fn apply_correction(&mut self) -> f64 {
        let [w0, w1, w2] = &mut self.w;
        let [z0, z1, z2] = &mut self.z;
        add(&self.error, &self.complex, w0, w1, w2);
        transform(w0, w1, w2, z0, z1, z2);
        let mut sums = [0.0; 2];
        for (k, (error, (complex, weight))) in self.error.iter().zip(self.complex.iter().zip(&self.weight)).enumerate()
        {
            sums[k & 1] += (error * error + complex.norm_sqr()) * (weight * weight);
        }
        ((sums[0] + sums[1]) / (3 * self.error.len()) as f64).sqrt()
    }

    /// The embedded error estimate, in units of the tolerance.
    fn estimate(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64, rejected: bool) -> f64 {
        let n = y.len();
        for k in 0..n {
            let weighted = (E[0] * self.z[0][k] + E[1] * self.z[1][k] + E[2] * self.z[2][k]) / h;
            // `w[0]` is done with; it keeps the difference for a second pass.
            self.w[0][k] = weighted;
            self.error[k] = weighted + self.rates[k];
        }
        system.solve_real(&mut self.error);
        let mut error = self.norm(&self.error);
        if error >= 1.0 && (rejected || self.last.0 == 0.0) {
            for k in 0..n {
                self.stage[k] = y[k] + self.error[k];
            }
            system.rates(t, &self.stage, &mut self.error);
            self.count_evaluations(1);
            for k in 0..n {
                self.error[k] += self.w[0][k];
            }
            system.solve_real(&mut self.error);
            error = self.norm(&self.error);
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

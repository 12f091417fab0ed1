//! The method: simplified Newton in the transformed stages, error estimate, step control, switches.

use super::coefficients::{ALPHA, BETA, C, E, GAMMA, T, T_INVERSE};
use super::{Complex64, System};

/// Most Newton iterations of one step.
const NEWTON_LIMIT: u32 = 8;
/// Contraction above which the Jacobian is taken anew before the next step.
const FRESH_CONTRACTION: f64 = 0.02;
/// Relative change of step size up to which the factors are kept.
const SAME_STEP: f64 = 1e-6;
/// Most switches within one call, against endless chatter.
const SWITCH_LIMIT: u64 = 10_000;

/// What the integration has cost so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Steps accepted.
    pub steps: u64,
    /// Steps rejected by the error estimate.
    pub rejections: u64,
    /// Steps given up because Newton's method did not converge.
    pub newton_failures: u64,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Evaluations of the right-hand side.
    pub evaluations: u64,
    /// Jacobians.
    pub jacobians: u64,
    /// Factorisations (one real and one complex together).
    pub factorisations: u64,
    /// Switches located.
    pub switches: u64,
}

/// Why the integration stopped, with the time reached; the state handed in is the one at that time.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RadauError {
    /// The step size became too small.
    #[error("{reason} down to a step of {step:e} s at t = {time} s; state {state:?}")]
    StepTooSmall {
        /// What failed at the smallest step.
        reason: &'static str,
        /// Last step size tried (s).
        step: f64,
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// The equations give no finite rates.
    #[error("the equations give no finite rates at t = {time} s; state {state:?}")]
    NotFinite {
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
    /// Switches follow each other without end.
    #[error("more than {SWITCH_LIMIT} switches up to t = {time} s; state {state:?}")]
    Chatter {
        /// Time reached (s).
        time: f64,
        /// State there.
        state: Vec<f64>,
    },
}

impl RadauError {
    /// Time reached (s).
    pub fn time(&self) -> f64 {
        match self {
            Self::StepTooSmall { time, .. } | Self::NotFinite { time, .. } | Self::Chatter { time, .. } => *time,
        }
    }
}

/// What must be kept between calls for a continuation to be bit for bit the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Memory {
    /// Step size the error estimate asks for (s); 0 before the first step.
    pub next_step: f64,
    /// Contraction `θ/(1-θ)` of the last Newton iteration.
    pub contraction: f64,
    /// Step size that the factors are for (s); 0 where there are none.
    pub factored_step: f64,
    /// Point `(t, y)` that the Jacobian was taken at; empty where there is none.
    pub jacobian_time: f64,
    /// See `jacobian_time`.
    pub jacobian_state: Vec<f64>,
    /// Last step size and error, for predictive control.
    pub last: (f64, f64),
}

/// The integrator: workspace and memory. No allocation after [`Radau::new`] but in errors.
#[derive(Clone, Debug)]
pub struct Radau {
    n: usize,
    tolerance: f64,
    newton_tolerance: f64,
    next_step: f64,
    contraction: f64,
    factored_step: f64,
    jacobian_time: f64,
    jacobian_state: Vec<f64>,
    has_jacobian: bool,
    /// The last Newton iteration contracted too slowly.
    stale: bool,
    last: (f64, f64),
    scale: Vec<f64>,
    rates: Vec<f64>,
    z: [Vec<f64>; 3],
    w: [Vec<f64>; 3],
    f: [Vec<f64>; 3],
    complex: Vec<Complex64>,
    stage: Vec<f64>,
    error: Vec<f64>,
    switch_values: Vec<f64>,
    switch_end: Vec<f64>,
    statistics: Statistics,
}

enum Outcome {
    Accepted,
    TooInaccurate(f64),
    NotConverged,
}

impl Radau {
    /// An integrator for `dimension` states and `switches` switching functions.
    ///
    /// `relative_tolerance` is that of the solution over one step; the embedded estimate is of order 3, so it is held to
    /// `0.1 tol^(2/3)` as in RADAU5.
    pub fn new(dimension: usize, switches: usize, relative_tolerance: f64) -> Self {
        let zeros = || vec![0.0; dimension];
        let mut radau = Self {
            n: dimension,
            tolerance: 0.0,
            newton_tolerance: 0.0,
            next_step: 0.0,
            contraction: 1.0,
            factored_step: 0.0,
            jacobian_time: 0.0,
            jacobian_state: zeros(),
            has_jacobian: false,
            stale: false,
            last: (0.0, 0.0),
            scale: zeros(),
            rates: zeros(),
            z: std::array::from_fn(|_| zeros()),
            w: std::array::from_fn(|_| zeros()),
            f: std::array::from_fn(|_| zeros()),
            complex: vec![Complex64::default(); dimension],
            stage: zeros(),
            error: zeros(),
            switch_values: vec![0.0; switches],
            switch_end: vec![0.0; switches],
            statistics: Statistics::default(),
        };
        radau.set_tolerance(relative_tolerance);
        radau
    }

    /// Changes the relative tolerance, see [`Radau::new`].
    pub fn set_tolerance(&mut self, relative_tolerance: f64) {
        self.tolerance = 0.1 * relative_tolerance.powf(2.0 / 3.0);
        // The iteration error must stay below the discretisation error that the tolerance asks for, not only below the
        // estimate's coarser one.
        self.newton_tolerance =
            (0.1 * relative_tolerance / self.tolerance).max(10.0 * f64::EPSILON / self.tolerance).min(0.03);
    }

    /// What it has cost so far.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Forgets step size and Jacobian.
    pub fn restart(&mut self) {
        self.next_step = 0.0;
        self.contraction = 1.0;
        self.factored_step = 0.0;
        self.has_jacobian = false;
        self.last = (0.0, 0.0);
    }

    /// What a bit-identical continuation needs.
    pub fn memory(&self) -> Memory {
        Memory {
            next_step: self.next_step,
            contraction: self.contraction,
            factored_step: self.factored_step,
            jacobian_time: self.jacobian_time,
            jacobian_state: if self.has_jacobian { self.jacobian_state.clone() } else { Vec::new() },
            last: self.last,
        }
    }

    /// Takes up a memory; the system must be set to the equations that were in force at the Jacobian's point.
    pub fn restore(&mut self, memory: &Memory, system: &mut impl System) {
        self.next_step = memory.next_step;
        self.contraction = memory.contraction;
        self.last = memory.last;
        self.factored_step = memory.factored_step;
        self.jacobian_time = memory.jacobian_time;
        self.has_jacobian = memory.jacobian_state.len() == self.n && self.n > 0;
        if self.has_jacobian {
            self.jacobian_state.copy_from_slice(&memory.jacobian_state);
            system.linearise(self.jacobian_time, &self.jacobian_state);
            if self.factored_step != 0.0 {
                factor(system, self.factored_step);
            }
        }
    }

    /// Advances `y` from `time` by `duration`, locating switches on the way.
    ///
    /// # Errors
    /// When no step size gives convergence, or the rates are not finite. `y` is then the state at the time in the error.
    pub fn advance(
        &mut self,
        system: &mut impl System,
        time: f64,
        y: &mut [f64],
        duration: f64,
    ) -> Result<(), RadauError> {
        let end = time + duration;
        let mut t = time;
        let mut remaining = duration;
        let switches_before = self.statistics.switches;
        let smallest = 1e-13 * duration.max(1e-3) + 4.0 * f64::EPSILON * end.abs();
        system.scale(y, &mut self.scale);
        let mut rates_known = false;
        let mut rejected = false;
        while remaining > 0.0 {
            if !rates_known {
                system.rates(t, y, &mut self.rates);
                self.statistics.evaluations += 1;
                if self.rates.iter().any(|r| !r.is_finite()) {
                    return Err(RadauError::NotFinite { time: t, state: y.to_vec() });
                }
                rates_known = true;
            }
            if self.next_step <= 0.0 {
                self.next_step = self.first_step(remaining);
            }
            // A last step a little longer than asked for is better than a tiny one after it.
            let mut h = if self.next_step >= 0.9 * remaining { remaining } else { self.next_step };
            if h < 0.5 * remaining && 2.0 * h > remaining {
                h = 0.5 * remaining;
            }
            let outcome = self.step(system, t, y, h, rejected);
            match outcome {
                Outcome::NotConverged => {
                    self.statistics.newton_failures += 1;
                    if self.has_jacobian && self.jacobian_time == t && self.jacobian_state == *y {
                        self.next_step = 0.25 * h;
                    }
                    self.has_jacobian = false;
                    if h < smallest {
                        let reason = "Newton's method did not converge";
                        return Err(RadauError::StepTooSmall { reason, step: h, time: t, state: y.to_vec() });
                    }
                    rejected = true;
                }
                Outcome::TooInaccurate(next) => {
                    self.statistics.rejections += 1;
                    self.next_step = next;
                    if h < smallest {
                        let reason = "the error estimate was not met";
                        return Err(RadauError::StepTooSmall { reason, step: h, time: t, state: y.to_vec() });
                    }
                    rejected = true;
                }
                Outcome::Accepted => {
                    let crossing = self.first_crossing(system, t, y, h);
                    if let Some(fraction) = crossing {
                        self.statistics.switches += 1;
                        if self.statistics.switches - switches_before > SWITCH_LIMIT {
                            return Err(RadauError::Chatter { time: t, state: y.to_vec() });
                        }
                        let part = fraction * h;
                        self.stage_at(y, fraction);
                        y.copy_from_slice(&self.stage);
                        t += part;
                        remaining -= part;
                        system.switch(t, y);
                        self.has_jacobian = false;
                        self.last = (0.0, 0.0);
                    } else {
                        for (value, z) in y.iter_mut().zip(&self.z[2]) {
                            *value += z;
                        }
                        self.statistics.steps += 1;
                        remaining = if h == remaining { 0.0 } else { remaining - h };
                        t = if remaining == 0.0 { end } else { end - remaining };
                    }
                    if std::mem::take(&mut self.stale) {
                        self.has_jacobian = false;
                    }
                    rates_known = false;
                    rejected = false;
                }
            }
        }
        Ok(())
    }

    /// A careful first step from the size of the rates.
    fn first_step(&self, remaining: f64) -> f64 {
        let speed = norm(&self.rates, &self.scale);
        let guess = if speed > 0.0 { 0.1 * self.tolerance.powf(0.25) / speed.max(1e-300) } else { remaining };
        // The first error estimate corrects a guess that is too long at the price of one step.
        guess.max(0.01).min(remaining)
    }

    fn prepare(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64) {
        if !self.has_jacobian {
            system.linearise(t, y);
            self.statistics.jacobians += 1;
            self.jacobian_time = t;
            self.jacobian_state.copy_from_slice(y);
            self.has_jacobian = true;
            self.factored_step = 0.0;
        }
        if (h - self.factored_step).abs() > SAME_STEP * h {
            factor(system, h);
            self.statistics.factorisations += 1;
            self.factored_step = h;
        }
    }

    /// One step attempt; on acceptance the stages are in `z`.
    fn step(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64, rejected: bool) -> Outcome {
        self.prepare(system, t, y, h);
        let n = self.n;
        // Straight-line start values: the inputs may have jumped, so nothing older than this step is used.
        for k in 0..n {
            let slope = h * self.rates[k];
            let z = [C[0] * slope, C[1] * slope, slope];
            for s in 0..3 {
                self.z[s][k] = z[s];
                self.w[s][k] = T_INVERSE[s][0] * z[0] + T_INVERSE[s][1] * z[1] + T_INVERSE[s][2] * z[2];
            }
        }
        let (real, alpha, beta) = (GAMMA / h, ALPHA / h, BETA / h);
        let mut contraction = self.contraction.max(f64::EPSILON).powf(0.8);
        let mut theta = 0.0;
        let mut last_change = 0.0;
        let mut iterations = 0;
        loop {
            if iterations == NEWTON_LIMIT {
                return Outcome::NotConverged;
            }
            for s in 0..3 {
                for k in 0..n {
                    self.stage[k] = y[k] + self.z[s][k];
                }
                system.rates(t + C[s] * h, &self.stage, &mut self.f[s]);
            }
            self.statistics.evaluations += 3;
            for k in 0..n {
                let f = [self.f[0][k], self.f[1][k], self.f[2][k]];
                let g = |s: usize| T_INVERSE[s][0] * f[0] + T_INVERSE[s][1] * f[1] + T_INVERSE[s][2] * f[2];
                let (w1, w2, w3) = (self.w[0][k], self.w[1][k], self.w[2][k]);
                self.error[k] = g(0) - real * w1;
                self.complex[k] = Complex64::new(g(1) - alpha * w2 + beta * w3, g(2) - alpha * w3 - beta * w2);
            }
            system.solve_real(&mut self.error);
            system.solve_complex(&mut self.complex);
            iterations += 1;
            let mut sum = 0.0;
            for k in 0..n {
                let scale = 1.0 / (self.scale[k] * self.tolerance);
                let (d1, d2, d3) = (self.error[k] * scale, self.complex[k].re * scale, self.complex[k].im * scale);
                sum += d1 * d1 + d2 * d2 + d3 * d3;
                self.w[0][k] += self.error[k];
                self.w[1][k] += self.complex[k].re;
                self.w[2][k] += self.complex[k].im;
                let w = [self.w[0][k], self.w[1][k], self.w[2][k]];
                for s in 0..3 {
                    self.z[s][k] = T[s][0] * w[0] + T[s][1] * w[1] + T[s][2] * w[2];
                }
            }
            let change = (sum / (3 * n) as f64).sqrt();
            if !change.is_finite() {
                return Outcome::NotConverged;
            }
            if iterations > 1 {
                theta = if last_change > 0.0 { change / last_change } else { 0.0 };
                if theta >= 0.99 {
                    // At the level of rounding the iteration no longer contracts, and need not.
                    if change < self.newton_tolerance {
                        break;
                    }
                    return Outcome::NotConverged;
                }
                contraction = theta / (1.0 - theta);
            }
            last_change = change;
            if contraction * change <= self.newton_tolerance || change == 0.0 {
                break;
            }
            if iterations > 1 {
                let left = (NEWTON_LIMIT - iterations) as i32;
                if theta.powi(left) / (1.0 - theta) * change > self.newton_tolerance {
                    return Outcome::NotConverged;
                }
            }
        }
        self.statistics.newton_iterations += u64::from(iterations);
        self.contraction = contraction;
        if theta > FRESH_CONTRACTION {
            self.stale = true;
        }
        let error = self.estimate(system, t, y, h, rejected);
        self.control(h, error, iterations, rejected)
    }

    /// The embedded error estimate, in units of the tolerance.
    fn estimate(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64, rejected: bool) -> f64 {
        let n = self.n;
        for k in 0..n {
            let weighted = (E[0] * self.z[0][k] + E[1] * self.z[1][k] + E[2] * self.z[2][k]) / h;
            // `w[0]` is done with; it keeps the difference for a second pass.
            self.w[0][k] = weighted;
            self.error[k] = weighted + self.rates[k];
        }
        system.solve_real(&mut self.error);
        let mut error = norm(&self.error, &self.scale) / self.tolerance;
        if error >= 1.0 && (rejected || self.last.0 == 0.0) {
            for k in 0..n {
                self.stage[k] = y[k] + self.error[k];
            }
            system.rates(t, &self.stage, &mut self.error);
            self.statistics.evaluations += 1;
            for k in 0..n {
                self.error[k] += self.w[0][k];
            }
            system.solve_real(&mut self.error);
            error = norm(&self.error, &self.scale) / self.tolerance;
        }
        if error.is_finite() { error.max(1e-10) } else { f64::INFINITY }
    }

    /// Step size control after Gustafsson.
    fn control(&mut self, h: f64, error: f64, iterations: u32, rejected: bool) -> Outcome {
        let limit = f64::from(NEWTON_LIMIT);
        let safety = 0.9 * (2.0 * limit + 1.0) / (2.0 * limit + f64::from(iterations));
        let bound = |quotient: f64| quotient.clamp(0.125, 5.0);
        let mut quotient = bound(error.powf(0.25) / safety);
        if error >= 1.0 || !error.is_finite() {
            return Outcome::TooInaccurate(if error.is_finite() { h / quotient } else { 0.1 * h });
        }
        let (last_step, last_error) = self.last;
        if last_step > 0.0 {
            let predicted = (last_step / h) * (error * error / last_error).powf(0.25) / safety;
            quotient = quotient.max(bound(predicted));
        }
        self.last = (h, error.max(1e-2));
        let next = h / quotient;
        self.next_step = if rejected { next.min(h) } else { next };
        Outcome::Accepted
    }

    /// State at `fraction` of the step just computed, on its collocation polynomial, into `stage`.
    fn stage_at(&mut self, y: &[f64], fraction: f64) {
        let nodes = [0.0, C[0], C[1], C[2]];
        let mut weight = [0.0; 3];
        for s in 0..3 {
            let mut product = 1.0;
            for (m, node) in nodes.iter().enumerate() {
                if m != s + 1 {
                    product *= (fraction - node) / (nodes[s + 1] - node);
                }
            }
            weight[s] = product;
        }
        for k in 0..self.n {
            self.stage[k] = y[k] + weight[0] * self.z[0][k] + weight[1] * self.z[1][k] + weight[2] * self.z[2][k];
        }
    }

    /// Fraction of the step at which a switching function first turns negative, to rounding.
    fn first_crossing(&mut self, system: &mut impl System, t: f64, y: &[f64], h: f64) -> Option<f64> {
        if !system.suspects_switch() {
            return None;
        }
        let mut values = std::mem::take(&mut self.switch_values);
        let mut start = std::mem::take(&mut self.switch_end);
        // One that is negative from the start, by rounding right after its own switch, must first rise.
        system.switching_functions(t, y, &mut start);
        let mut check = |radau: &mut Self, fraction: f64| {
            radau.stage_at(y, fraction);
            system.switching_functions(t + fraction * h, &radau.stage, &mut values);
            values.iter().zip(&start).any(|(v, s)| *v < 0.0 && *s >= 0.0)
        };
        let mut low = 0.0;
        let mut high = None;
        for fraction in [C[0], 0.4, C[1], 0.85, 1.0] {
            if check(self, fraction) {
                high = Some(fraction);
                break;
            }
            low = fraction;
        }
        let result = high.map(|mut high| {
            while high - low > 1e-12 && high * h - low * h > 1e-13 {
                let middle = 0.5 * (low + high);
                if check(self, middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            high
        });
        self.switch_values = values;
        self.switch_end = start;
        result
    }
}

fn factor(system: &mut impl System, h: f64) {
    system.factor(GAMMA / h, Complex64::new(ALPHA / h, BETA / h));
}

fn norm(values: &[f64], scale: &[f64]) -> f64 {
    let sum: f64 = values.iter().zip(scale).map(|(v, s)| (v / s) * (v / s)).sum();
    (sum / values.len() as f64).sqrt()
}

//! The integrator: its memory, and the way from one communication point to the next.

use super::allowance::Allowance;
use super::choice::{Choice, Prices};
use super::dormand_prince::Stiffness;
use super::radau::{Contraction, Outcome};
use super::switching::Looks;
use super::vector::{FEW, FEW_AND_ONE, Kept, MORE, MOST, MOST_STATES, SOME, Work};
use super::{IntegrationError, Solver, Statistics, System};

/// Of the estimate's tolerance, `factor tol^(2/3)`: 0.1 in RADAU5. Here a Newton iteration less makes the steps longer; with this,
/// the errors of all steps together stay below ten times the tolerance in the motions that are tested.
const ESTIMATE_FACTOR: f64 = 0.05;
/// Share of the tolerance that an explicit step may err by: errors of steps add up.
const EXPLICIT_SHARE: f64 = 0.5;
/// Share of the tolerance that Newton's method may leave in a step.
const NEWTON_SHARE: f64 = 0.07;

/// What must be kept between calls for a continuation to be bit for bit the same.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Memory {
    /// Step size the error estimate asks for (s); 0 before the first step.
    pub next_step: f64,
    /// Step size that the factors are for (s); 0 where there are none.
    pub factored_step: f64,
    /// Point `(t, y)` that the Jacobian was taken at; empty where there is none.
    pub jacobian_time: f64,
    /// See `jacobian_time`.
    pub jacobian_state: Vec<f64>,
    /// Fewest Newton iterations that a step took with the Jacobian; 0 before the first.
    pub jacobian_least: u32,
    /// Iterations beyond that, of all steps with it.
    pub jacobian_excess: u32,
    /// What Newton's method added to its guess in the last step, three values for each state, and how much more that was than in the
    /// step before; empty where that says nothing of the next.
    pub trend: Vec<f64>,
    /// How much the defect contracted, over how much the correction did, in the last step that began without a lead; 0 where that is
    /// not known.
    pub settling: f64,
    /// What is known of the contraction with the Jacobian.
    pub contraction: Contraction,
    /// Last step size and error, for predictive control; an error of 0 where the equations have changed since.
    pub last: (f64, f64),
    /// Rates at the end of the last step, with which the next begins: after an implicit step the slope of its polynomial. Empty where
    /// the equations have changed since.
    pub rates: Vec<f64>,
    /// Time (s) at which the equations were first found to be stiff.
    pub stiff_since: Option<f64>,
    /// Where the choice of the method is the integrator's.
    pub choice: Choice,
}

/// The integrator: workspace and memory. No allocation after [`Integrator::new`] but in errors.
#[derive(Clone, Debug)]
pub struct Integrator {
    solver: Solver,
    relative_tolerance: f64,
    /// What the error estimate of the method in use is held to.
    pub(super) tolerance: f64,
    pub(super) newton_tolerance: f64,
    pub(super) next_step: f64,
    pub(super) factored_step: f64,
    pub(super) jacobian_time: f64,
    pub(super) jacobian_state: Vec<f64>,
    pub(super) has_jacobian: bool,
    /// As in [`Memory`].
    pub(super) jacobian_least: u32,
    pub(super) jacobian_excess: u32,
    /// As in [`Memory`], with whether it is there.
    trend: [Kept; 6],
    pub(super) has_lead: bool,
    pub(super) settling: f64,
    pub(super) contraction: Contraction,
    pub(super) last: (f64, f64),
    /// What an error in each state weighs: one over its scale and the tolerance.
    weight: Kept,
    /// The weights are of the tolerance in use.
    weighed: bool,
    /// Rates at the state where the last call ended.
    rates: Kept,
    /// They still are.
    rates_known: bool,
    stiffness: Stiffness,
    stiff_since: Option<f64>,
    choice: Choice,
    pub(super) looks: Looks,
    pub(super) statistics: Statistics,
    pub(super) allowance: Allowance,
    /// Where the steps of a call have led, where that is asked for: a time (s) and the states there, one step after the other.
    path: Option<Vec<f64>>,
}

impl Integrator {
    /// An integrator for `dimension` states and `switches` switching functions, by [`Solver::Radau`].
    ///
    /// `relative_tolerance` is that of the solution over one step. The implicit method's embedded estimate is of order 3, so it is
    /// held to `0.05 tol^(2/3)`.
    ///
    /// # Panics
    /// When there are more than [`MOST_STATES`] states.
    pub fn new(dimension: usize, switches: usize, relative_tolerance: f64) -> Self {
        assert!(dimension <= MOST_STATES, "{dimension} states, expected {MOST_STATES} or fewer");
        let mut integrator = Self {
            solver: Solver::Radau,
            relative_tolerance,
            tolerance: 0.0,
            newton_tolerance: 0.0,
            next_step: 0.0,
            factored_step: 0.0,
            jacobian_time: 0.0,
            jacobian_state: vec![0.0; dimension],
            has_jacobian: false,
            jacobian_least: 0,
            jacobian_excess: 0,
            trend: std::array::from_fn(|_| Kept::zeros(dimension)),
            has_lead: false,
            settling: 0.0,
            contraction: Contraction::default(),
            last: (0.0, 0.0),
            weight: Kept::zeros(dimension),
            weighed: false,
            rates: Kept::zeros(dimension),
            rates_known: false,
            stiffness: Stiffness::default(),
            stiff_since: None,
            choice: Choice::default(),
            looks: Looks::new(switches),
            statistics: Statistics::default(),
            allowance: Allowance::full(0.0),
            path: None,
        };
        integrator.hold_to_tolerance();
        integrator
    }

    /// Changes the relative tolerance, see [`Integrator::new`].
    pub fn set_tolerance(&mut self, relative_tolerance: f64) {
        self.relative_tolerance = relative_tolerance;
        self.hold_to_tolerance();
    }

    /// Changes the method; the integration starts afresh.
    pub fn set_solver(&mut self, solver: Solver) {
        self.solver = solver;
        self.restart();
    }

    /// The method as chosen.
    pub fn solver(&self) -> Solver {
        self.solver
    }

    /// Time (s) at which explicit steps first found the equations to be stiff: stability bounds their size.
    pub fn stiff_since(&self) -> Option<f64> {
        self.stiff_since
    }

    /// Whether the next step is an explicit one.
    pub(super) fn is_explicit(&self) -> bool {
        match self.solver {
            Solver::Radau => false,
            Solver::DormandPrince => true,
            Solver::Auto => self.choice.explicit,
        }
    }

    /// Takes up what the estimates of the method in use are held to.
    fn hold_to_tolerance(&mut self) {
        let relative_tolerance = self.relative_tolerance;
        self.weighed = false;
        if self.is_explicit() {
            self.tolerance = EXPLICIT_SHARE * relative_tolerance;
            return;
        }
        self.tolerance = ESTIMATE_FACTOR * relative_tolerance.powf(2.0 / 3.0);
        // The iteration error must stay below the discretisation error that the tolerance asks for, not only below the
        // estimate's coarser one, and short steps add up their errors.
        self.newton_tolerance =
            (NEWTON_SHARE * relative_tolerance / self.tolerance).max(10.0 * f64::EPSILON / self.tolerance).min(0.03);
    }

    /// What it has cost so far.
    pub fn statistics(&self) -> Statistics {
        self.statistics
    }

    /// Forgets step size, Jacobian and what is known of stiffness.
    pub fn restart(&mut self) {
        self.next_step = 0.0;
        self.factored_step = 0.0;
        self.has_jacobian = false;
        self.last = (0.0, 0.0);
        self.rates_known = false;
        self.stiff_since = None;
        self.choice = Choice::default();
        self.hold_to_tolerance();
    }

    /// The equations have changed since the last call, and what that does to the rates is known: those at the present state, where
    /// they are known, to be changed with them.
    pub(crate) fn rates_to_change(&mut self) -> Option<&mut [f64]> {
        self.last.1 = 0.0;
        self.rates_known.then_some(&mut self.rates)
    }

    /// The equations have changed since the last call: rates are to be evaluated anew, and how the error grew from step to step says
    /// nothing of the next one.
    pub fn equations_changed(&mut self) {
        self.last.1 = 0.0;
        self.state_changed();
    }

    /// The state has changed a little since the last call: rates are to be evaluated anew.
    pub(crate) fn state_changed(&mut self) {
        self.rates_known = false;
    }

    /// What a bit-identical continuation needs.
    pub fn memory(&self) -> Memory {
        Memory {
            next_step: self.next_step,
            factored_step: self.factored_step,
            jacobian_time: self.jacobian_time,
            jacobian_state: if self.has_jacobian { self.jacobian_state.clone() } else { Vec::new() },
            jacobian_least: self.jacobian_least,
            jacobian_excess: self.jacobian_excess,
            trend: if self.has_lead {
                self.trend.iter().flat_map(|kept| &**kept).copied().collect()
            } else {
                Vec::new()
            },
            settling: self.settling,
            contraction: self.contraction,
            last: self.last,
            rates: if self.rates_known { self.rates.to_vec() } else { Vec::new() },
            stiff_since: self.stiff_since,
            choice: self.choice,
        }
    }

    /// Takes up a memory; the system must be set to the equations that were in force at the Jacobian's point.
    pub fn restore(&mut self, memory: &Memory, system: &mut impl System) {
        let n = self.jacobian_state.len();
        self.next_step = memory.next_step;
        self.last = memory.last;
        self.rates_known = memory.rates.len() == n && n > 0;
        if self.rates_known {
            self.rates.copy_from_slice(&memory.rates);
        }
        self.has_lead = memory.trend.len() == 6 * n && n > 0;
        for (kept, values) in self.trend.iter_mut().zip(memory.trend.chunks_exact(n.max(1))) {
            kept.copy_from_slice(values);
        }
        self.settling = memory.settling;
        self.contraction = memory.contraction;
        self.stiff_since = memory.stiff_since;
        self.choice = memory.choice;
        self.hold_to_tolerance();
        self.jacobian_least = memory.jacobian_least;
        self.jacobian_excess = memory.jacobian_excess;
        self.factored_step = memory.factored_step;
        self.jacobian_time = memory.jacobian_time;
        self.has_jacobian = memory.jacobian_state.len() == n && n > 0;
        if self.has_jacobian {
            self.jacobian_state.copy_from_slice(&memory.jacobian_state);
            system.linearise(self.jacobian_time, &self.jacobian_state);
            if self.factored_step != 0.0 {
                super::radau::factor(system, self.factored_step);
            }
        }
    }

    /// Advances `y` from `time` by `duration`, locating switches on the way. It begins with the rates that the last call ended with,
    /// unless [`Integrator::equations_changed`] was called since.
    ///
    /// # Errors
    /// When no step size gives convergence, the equations do not hold, or the work does not get anywhere. `y` is then the
    /// state at the time in the error.
    pub fn advance(
        &mut self,
        system: &mut impl System,
        time: f64,
        y: &mut [f64],
        duration: f64,
    ) -> Result<(), IntegrationError> {
        self.begin(time);
        self.advance_part(system, time, y, duration)
    }

    /// From now on the points that the steps of a call lead to are kept until the next one.
    pub fn keep_path(&mut self) {
        self.path = Some(Vec::new());
    }

    /// Where the steps of the last call have led, the last of them to its end: a time (s) and the states there, one step after the
    /// other. Empty where it was not asked for.
    pub fn path(&self) -> &[f64] {
        self.path.as_deref().unwrap_or_default()
    }

    /// Begins a call that is made up of parts; the work that it may be is for all of them together.
    pub(crate) fn begin(&mut self, time: f64) {
        self.allowance = Allowance::full(time);
        self.stiffness = Stiffness::default();
        self.choice.calls = self.choice.calls.saturating_add(1);
        if let Some(path) = &mut self.path {
            path.clear();
        }
    }

    /// [`Integrator::advance`] as a part of a call.
    pub(crate) fn advance_part(
        &mut self,
        system: &mut impl System,
        time: f64,
        y: &mut [f64],
        duration: f64,
    ) -> Result<(), IntegrationError> {
        if !(duration >= 0.0 && duration.is_finite()) {
            return Err(IntegrationError::Duration { duration, time });
        }
        let groups = y.len().div_ceil(4);
        if groups <= FEW {
            self.advance_with::<FEW>(system, time, y, duration)
        } else if groups <= FEW_AND_ONE {
            self.advance_with::<FEW_AND_ONE>(system, time, y, duration)
        } else if groups <= SOME {
            self.advance_with::<SOME>(system, time, y, duration)
        } else if groups <= MORE {
            self.advance_with::<MORE>(system, time, y, duration)
        } else {
            self.advance_with::<MOST>(system, time, y, duration)
        }
    }

    fn advance_with<const GROUPS: usize>(
        &mut self,
        system: &mut impl System,
        time: f64,
        y: &mut [f64],
        duration: f64,
    ) -> Result<(), IntegrationError> {
        let work = &mut Work::<GROUPS>::new(y.len());
        let end = time + duration;
        let mut t = time;
        let mut remaining = duration;
        let smallest = 1e-13 * duration.max(1e-3) + 4.0 * f64::EPSILON * end.abs();
        self.weigh(work, system, y);
        let mut rates_known = std::mem::take(&mut self.rates_known);
        if rates_known {
            work.rates.take_up(&self.rates);
        }
        if self.has_lead {
            for (vector, kept) in work.lead.iter_mut().chain(&mut work.rise).zip(&self.trend) {
                vector.take_up(kept);
            }
        }
        let prices = Prices::of(system.cost(), y.len());
        let mut rejected = false;
        // Where a switch was seen: a step is made to end there before the switch is believed.
        let mut limit = f64::INFINITY;
        while remaining > 0.0 {
            self.allowance.check(t, y)?;
            if !rates_known {
                system.rates(t, y, &mut work.rates);
                self.count_evaluations(1);
                if work.rates.iter().any(|r| !r.is_finite()) {
                    return Err(IntegrationError::NotFinite { time: t, state: y.to_vec() });
                }
                rates_known = true;
            }
            if self.next_step <= 0.0 {
                self.next_step = self.first_step(work, remaining);
            }
            let planned = self.next_step;
            let explicit = self.is_explicit();
            let h = step_size(planned, remaining, explicit).min(limit);
            let left = if h == remaining { 0.0 } else { remaining - h };
            let arrival = if left == 0.0 { end } else { end - left };
            let before = self.statistics;
            let outcome = if explicit {
                self.explicit_step(work, system, [t, arrival], y, h, rejected)
            } else {
                self.implicit_step(work, system, t, y, h, rejected)
            };
            if self.solver == Solver::Auto {
                self.choice.count(&before, &self.statistics, &prices);
            }
            match outcome {
                Outcome::NotConverged => {
                    self.statistics.newton_failures += 1;
                    if self.has_jacobian && self.jacobian_time == t && self.jacobian_state == *y {
                        self.next_step = 0.25 * h;
                    }
                    self.has_jacobian = false;
                    if h < smallest {
                        let reason = "Newton's method did not converge";
                        return Err(IntegrationError::StepTooSmall { reason, step: h, time: t, state: y.to_vec() });
                    }
                    rejected = true;
                }
                Outcome::TooInaccurate(next) => {
                    self.statistics.rejections += 1;
                    self.next_step = next;
                    if h < smallest {
                        let reason = "the error estimate was not met";
                        return Err(IntegrationError::StepTooSmall { reason, step: h, time: t, state: y.to_vec() });
                    }
                    rejected = true;
                }
                Outcome::Accepted => {
                    // Before anything else is put where its stages are. The last step of a call is as long as the caller has it.
                    let at_the_end = explicit && left > 0.0 && work.is_at_end_of_stability(h);
                    let crossing = self.first_crossing(work, system, t, h);
                    if let Some(fraction) = crossing
                        && (1e-3..0.999).contains(&fraction)
                        && h * fraction > smallest
                    {
                        // Between its nodes the dense output is two orders less accurate than the step.
                        limit = fraction * h;
                        continue;
                    }
                    self.statistics.steps += 1;
                    if h < 0.1 * planned && !rejected {
                        // Cut very short by the end or a switch, which says little of the steps to come.
                        self.next_step = self.next_step.max(planned);
                    }
                    limit = f64::INFINITY;
                    rejected = false;
                    if let Some(fraction) = crossing {
                        self.statistics.switches += 1;
                        self.allowance.count_switch();
                        let part = fraction * h;
                        self.stage_at(work, h, fraction);
                        y.copy_from_slice(&work.stage);
                        t += part;
                        remaining -= part;
                        self.allowance.earn(part, t);
                        system.switch(t, y);
                        self.has_jacobian = false;
                        self.last = (0.0, 0.0);
                        rates_known = false;
                    } else {
                        for (value, end) in y.iter_mut().zip(&*work.full[2]) {
                            *value = *end;
                        }
                        (remaining, t) = (left, arrival);
                        self.allowance.earn(h, t);
                        if explicit {
                            work.rates.copy_from_slice(&work.f[5]);
                            self.note_stiffness(at_the_end, t);
                        } else {
                            work.end_rates(h);
                        }
                    }
                    if let Some(path) = &mut self.path {
                        path.push(t);
                        path.extend_from_slice(y);
                    }
                    if self.solver == Solver::Auto
                        && self.is_explicit() == explicit
                        && self.choice.note(crossing.map_or(h, |fraction| fraction * h), &prices)
                    {
                        // An explicit step takes its rates for exact, and the polynomial's slope is not quite what the equations say.
                        rates_known &= explicit;
                        self.begin_with_the_other();
                    }
                    if remaining > 0.0 {
                        self.weigh(work, system, y);
                    }
                    if let Some(reason) = system.out_of_bounds(y) {
                        return Err(IntegrationError::OutOfBounds { reason, time: t, state: y.to_vec() });
                    }
                }
            }
        }
        self.rates_known = rates_known;
        if rates_known {
            self.rates.keep(&work.rates);
        }
        if self.has_lead {
            for (vector, kept) in work.lead.iter().chain(&work.rise).zip(&mut self.trend) {
                kept.keep(vector);
            }
        }
        Ok(())
    }

    /// Takes note of an explicit step that was taken to `time` (s).
    fn note_stiffness(&mut self, at_the_end: bool, time: f64) {
        if !self.stiffness.note(at_the_end) {
            return;
        }
        self.stiff_since = self.stiff_since.or(Some(time));
        if self.solver == Solver::Auto {
            self.choice.leave_stiff_equations();
            self.stiffness = Stiffness::default();
            self.begin_with_the_other();
        }
    }

    /// After the change from one method to the other, which begins with the step that the first would have taken: a guess that is
    /// too long passes the implicit method's coarse estimate where inputs have jumped.
    fn begin_with_the_other(&mut self) {
        self.last = (0.0, 0.0);
        self.has_lead = false;
        self.hold_to_tolerance();
    }

    pub(super) fn count_evaluations(&mut self, count: u64) {
        self.statistics.evaluations += count;
        self.allowance.spend(count);
    }

    /// Takes up what errors weigh at `y`.
    fn weigh<const GROUPS: usize>(&mut self, work: &mut Work<GROUPS>, system: &impl System, y: &[f64]) {
        if !self.weighed || system.scale_changes() {
            self.weighed = true;
            system.scale(y, &mut self.weight);
            for weight in &mut *self.weight {
                *weight = 1.0 / (*weight * self.tolerance);
            }
        }
        work.weight.take_up(&self.weight);
    }

    /// A careful first step from the size of the rates.
    fn first_step<const GROUPS: usize>(&self, work: &Work<GROUPS>, remaining: f64) -> f64 {
        // In units of the tolerance per second; the step may change the state by 0.1 tol^(1/4) of its scale.
        let speed = self.tolerance * work.norm(&work.rates);
        let guess = if speed > 0.0 { 0.1 * self.tolerance.sqrt().sqrt() / speed } else { remaining };
        // The first error estimate corrects a guess that is too long at the price of one step.
        guess.max(0.01).min(remaining)
    }
}

/// The step to take where the error estimate asks for `next` and `remaining` is left: no tiny one at the end. Implicit steps are
/// parts of the same size, so that factors serve for several.
fn step_size(next: f64, remaining: f64, explicit: bool) -> f64 {
    if next >= 0.9 * remaining {
        remaining
    } else if !explicit {
        // What rounding has left of parts before is none by itself.
        remaining / (remaining / next - 1e-6).ceil()
    } else if next > 0.5 * remaining {
        0.5 * remaining
    } else {
        next
    }
}

//! Which of the two methods goes on, where the choice is left to the integrator: the one that has cost less for each second.
//!
//! What a method costs is counted, not timed, so that a run can be repeated bit for bit. The method in use is looked at every few
//! steps; from time to time, and only where the other one could cost less at its best, that one has a trial of as many steps, or
//! until it has cost as much as those did, and goes on if it did cost less. After a trial that it lost, the next is twice as far away.

use super::Statistics;

/// Costs for each state, in evaluations of the rates of a plant without effects (65 ns), fitted to the times and counts of the
/// motions that are tested: what each explicit step takes beyond its evaluations, each implicit one, each of its iterations and new
/// factors.
const EXPLICIT_STEP: f64 = 0.25;
const IMPLICIT_STEP: f64 = 0.26;
const ITERATION: f64 = 0.2;
const FACTORS: f64 = 0.31;
/// Evaluations of the cheapest step: the explicit one begins with the rates that the last one ended with.
const EXPLICIT_EVALUATIONS: f64 = 6.0;
const IMPLICIT_EVALUATIONS: f64 = 4.0;

/// Steps between two looks, and of a trial: several periods of what alternates from step to step, few beside a motion.
const STEPS: u32 = 20;
/// Looks from one trial to the next: at first, and at most. Then trials cost no more than a thirtieth.
const FIRST_PAUSE: u32 = 16;
const LONGEST_PAUSE: u32 = 32;

/// What a system's equations cost, in evaluations of the rates of a plant without effects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// An evaluation of the rates.
    pub evaluation: f64,
    /// Their derivatives.
    pub derivatives: f64,
}

impl Default for Cost {
    /// Those of a plant without effects.
    fn default() -> Self {
        Self { evaluation: 1.0, derivatives: 12.0 }
    }
}

/// What the parts of a step cost, in the same unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prices {
    equations: Cost,
    explicit_step: f64,
    implicit_step: f64,
    iteration: f64,
    factors: f64,
}

impl Prices {
    /// Those of a system with so many states.
    pub(super) fn of(equations: Cost, states: usize) -> Self {
        let states = states as f64;
        Self {
            equations,
            explicit_step: EXPLICIT_STEP * states,
            implicit_step: IMPLICIT_STEP * states,
            iteration: ITERATION * states,
            factors: FACTORS * states,
        }
    }
}

/// What is known of both methods.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// The explicit method is in use.
    pub explicit: bool,
    /// The method in use is on trial.
    pub trial: bool,
    /// Accepted steps, calls, cost and time (s) since the last look.
    pub steps: u32,
    /// See `steps`.
    pub calls: u32,
    /// See `steps`.
    pub cost: f64,
    /// See `steps`.
    pub time: f64,
    /// During a trial cost and time (s) of the other method between the two looks before.
    pub rival: [f64; 2],
    /// Looks until the next trial, and from the last one to it.
    pub wait: u32,
    /// See `wait`.
    pub pause: u32,
}

impl Default for Choice {
    fn default() -> Self {
        Self {
            explicit: true,
            trial: false,
            steps: 0,
            calls: 0,
            cost: 0.0,
            time: 0.0,
            rival: [0.0; 2],
            wait: FIRST_PAUSE,
            pause: FIRST_PAUSE,
        }
    }
}

impl Choice {
    /// Whether it could have come about.
    pub(crate) fn is_possible(&self) -> bool {
        let numbers = [self.cost, self.time, self.rival[0], self.rival[1]];
        numbers.iter().all(|number| number.is_finite() && *number >= 0.0)
            && self.steps < STEPS
            && (1..=LONGEST_PAUSE).contains(&self.pause)
            && (1..=self.pause).contains(&self.wait)
    }

    /// Counts what was done from `before` to `now`.
    pub(super) fn count(&mut self, before: &Statistics, now: &Statistics, prices: &Prices) {
        let [evaluations, iterations, factorisations, jacobians] = [
            now.evaluations - before.evaluations,
            now.newton_iterations - before.newton_iterations,
            now.factorisations - before.factorisations,
            now.jacobians - before.jacobians,
        ]
        .map(|count| count as f64);
        let step = if self.explicit { prices.explicit_step } else { prices.implicit_step };
        self.cost += evaluations * prices.equations.evaluation
            + step
            + iterations * prices.iteration
            + factorisations * prices.factors
            + jacobians * prices.equations.derivatives;
    }

    /// The least that a step of the other method costs.
    fn least_of_the_other(&self, prices: &Prices) -> f64 {
        let evaluation = prices.equations.evaluation;
        if self.explicit {
            IMPLICIT_EVALUATIONS * evaluation + prices.implicit_step + prices.iteration
        } else {
            EXPLICIT_EVALUATIONS * evaluation + prices.explicit_step
        }
    }

    /// Takes note of an accepted step of `h` (s). Returns whether the other method goes on from here.
    pub(super) fn note(&mut self, h: f64, prices: &Prices) -> bool {
        self.steps += 1;
        self.time += h;
        let [rival_cost, rival_time] = self.rival;
        if self.steps < STEPS && !(self.trial && self.cost >= rival_cost) {
            return false;
        }
        // Each call takes a step at least.
        let could_be = self.least_of_the_other(prices) * f64::from(self.calls);
        let change = if self.trial {
            self.trial = false;
            let lost = self.cost * rival_time > rival_cost * self.time;
            self.pause = if lost { (2 * self.pause).min(LONGEST_PAUSE) } else { FIRST_PAUSE };
            self.wait = self.pause;
            lost
        } else {
            self.wait -= 1;
            let due = self.wait == 0;
            self.wait = if due { self.pause } else { self.wait };
            self.trial = due && could_be < self.cost;
            self.rival = [self.cost, self.time];
            self.trial
        };
        self.explicit ^= change;
        (self.steps, self.calls, self.cost, self.time) = (0, 0, 0.0, 0.0);
        change
    }

    /// The implicit method goes on from stiff equations. It is not on trial; the explicit one has a trial later, as after one lost.
    pub(super) fn leave_stiff_equations(&mut self) {
        let pause = (2 * self.pause).min(LONGEST_PAUSE);
        *self = Self { explicit: false, wait: pause, pause, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of 10 ms in calls of one step; `cost` is that of a step by the explicit method and by the other. Returns the share of
    /// explicit steps among the last hundred, and the cost of all over that of the cheaper method.
    fn driven(steps: u32, cost: impl Fn(u32) -> [f64; 2]) -> (f64, f64) {
        let mut choice = Choice::default();
        let (mut explicit, mut spent, mut least) = (0, 0.0, 0.0);
        for k in 0..steps {
            let [a, b] = cost(k);
            explicit += u32::from(choice.explicit && k + 100 >= steps);
            let now = if choice.explicit { a } else { b };
            (spent, least) = (spent + now, least + f64::min(a, b));
            choice.calls += 1;
            choice.cost += now;
            choice.note(0.01, &Prices::of(Cost::default(), 14));
            assert!(choice.is_possible(), "{choice:?}");
        }
        (f64::from(explicit) / 100.0, spent / least)
    }

    #[test]
    fn the_cheaper_method_goes_on_and_trials_cost_little() {
        let (share, ratio) = driven(20_000, |_| [30.0, 20.0]);
        assert!(share < 0.5 && ratio < 1.05, "{share}, {ratio}");
        let (share, ratio) = driven(20_000, |_| [30.0, 60.0]);
        assert!(share > 0.5 && ratio < 1.05, "{share}, {ratio}");
    }

    #[test]
    fn the_explicit_method_comes_back_when_it_is_the_cheaper_one_again() {
        let (share, ratio) = driven(40_000, |k| if k < 20_000 { [200.0, 20.0] } else { [15.0, 20.0] });
        assert!(share > 0.5 && ratio < 1.15, "{share}, {ratio}");
    }

    #[test]
    fn what_cannot_cost_less_has_no_trial() {
        let (share, ratio) = driven(1000, |_| [10.0, 30.0]);
        assert_eq!((share, ratio), (1.0, 1.0));
    }
}

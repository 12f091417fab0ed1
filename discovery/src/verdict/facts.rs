//! What a verdict is reached from.

use cdpr::effect::{EffectSpec, ParameterInfo};
use cdpr::model_file::Model;

use super::growth::Reach;
use super::policy::Policy;
use crate::data::Trial;
use crate::filter::estimate::Fit;
use crate::hypothesis::correction::leaves_enough;
use crate::hypothesis::parameter::range_of_shape;
use crate::hypothesis::term;
use crate::model::sizes::Sizes;
use crate::outcome::{BeforeAfter, Found, HorizonGap, NullTest};
use crate::strategy::fitted::Evidence;

/// Gaps over one horizon on held-out data, to which no parameter was fitted, in units of the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HorizonFacts {
    /// The horizon, with the gap that a model without fault would leave.
    pub(crate) reach: Reach,
    pub(crate) holdout: BeforeAfter,
    /// Standard error of the change of its square, as a share of what it was before.
    pub(crate) scatter: f64,
}

impl HorizonFacts {
    /// Those of all horizons.
    pub(crate) fn all(horizons: &[HorizonGap]) -> Vec<Self> {
        let of = |gap: &HorizonGap| Self {
            reach: Reach { horizon: gap.horizon, attainable: gap.attainable },
            holdout: gap.holdout,
            scatter: gap.scatter,
        };
        horizons.iter().map(of).collect()
    }

    /// Whether the growth of errors lets a run of this length say something.
    pub(crate) fn tells(&self, policy: &Policy) -> bool {
        self.reach.attainable <= policy.farthest
    }

    /// Change of the square of the gap, as a share of what it was before.
    pub(crate) fn change(&self) -> f64 {
        (self.holdout.after / self.holdout.before).powi(2) - 1.0
    }

    /// The gap of the model as given in multiples of what a model without fault would leave; the largest where there is none.
    pub(crate) fn before(&self) -> f64 {
        self.of_attainable(self.holdout.before)
    }

    /// The same of the gap that is left.
    pub(crate) fn after(&self) -> f64 {
        self.of_attainable(self.holdout.after)
    }

    fn of_attainable(&self, gap: f64) -> f64 {
        let gap = gap / self.reach.attainable;
        if gap.is_nan() { f64::INFINITY } else { gap }
    }

    /// What is left of the gap on held-out data, without the noise, as a share of what was there before.
    pub(crate) fn share_left(&self) -> f64 {
        left(self.holdout.after / self.reach.attainable) / left(self.holdout.before / self.reach.attainable)
    }
}

/// Share of the squared gap `before`, without the noise, that is no longer there `after`; all of it where what is left is noise.
pub(crate) fn share_taken(before: f64, after: f64, policy: &Policy) -> f64 {
    if after <= policy.at_noise {
        return 1.0;
    }
    1.0 - (left(after) / left(before)).powi(2)
}

/// A gap without the noise in it.
pub(crate) fn left(gap: f64) -> f64 {
    (gap * gap - 1.0).max(0.0).sqrt()
}

/// Forces that the model needs at random to follow the data (root mean square), and what such forces are measured by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Disturbance {
    /// On the platform and at the winches (N).
    pub(crate) force: f64,
    /// On the platform (N m).
    pub(crate) torque: f64,
    /// Mean winch force (N).
    pub(crate) winch_force: f64,
    /// Lever between the two (m).
    pub(crate) arm: f64,
    /// Whether there is any: else the sizes are the smallest considered.
    pub(crate) any: bool,
}

impl Disturbance {
    /// What `fit` needs at random to follow `trials`.
    pub(crate) fn of(fit: &Fit, trials: &[Trial]) -> Self {
        let randomness = &fit.randomness;
        let forces: Vec<f64> =
            trials.iter().flat_map(|t| &t.inputs).flat_map(|i| i.winch_force).map(f64::abs).collect();
        Self {
            force: randomness.force.hypot(randomness.winch),
            torque: randomness.force * randomness.arm,
            winch_force: forces.iter().sum::<f64>() / forces.len().max(1) as f64,
            arm: randomness.arm,
            any: randomness.has_latents(),
        }
    }

    /// Whether it is below a share of the winch forces, and its torque below that at their lever.
    pub(crate) fn is_below(&self, share: f64) -> bool {
        let limit = share * self.winch_force;
        self.force <= limit && self.torque <= limit * self.arm
    }
}

/// What decides whether an effect found carries its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EffectFacts {
    /// What chance did in the weighing that brought it up.
    pub(crate) chance: Option<NullTest>,
    /// Standard error of its size in multiples of the size.
    pub(crate) relative_error: f64,
    /// Whether a shape or a size of it has left the range in which the law is itself.
    pub(crate) out_of_range: bool,
    /// Whether it acts at a time that was held out.
    pub(crate) held_out: bool,
    /// Whether another explanation is as good.
    pub(crate) has_twin: bool,
    /// Share of the squared gap, without the noise, that it takes away, at most of all horizons.
    pub(crate) share: f64,
    /// What the information criterion falls by with it.
    pub(crate) explains: f64,
    /// Spread of its size over blocks of time, beyond its errors, where that is no chance.
    pub(crate) varies: f64,
}

impl EffectFacts {
    /// Those of an effect in a model that takes away this share of the gap, of which data were held out.
    pub(crate) fn of(found: &Found, share: f64, model: &Model, evidence: &Evidence, policy: &Policy) -> Self {
        Self {
            chance: found.null_test,
            relative_error: relative_error(&found.effect, &found.standard_error),
            out_of_range: out_of_range(&found.effect, &found.standard_error, model, policy),
            held_out: evidence.holds_out(model, &found.effect),
            has_twin: found.alternatives.iter().any(|a| a.indistinguishable),
            share,
            explains: -found.delta_bic,
            varies: found.stability.as_ref().filter(|stability| stability.varies()).map_or(0.0, |s| s.spread),
        }
    }
}

/// Everything that a verdict is reached from.
#[derive(Clone, Debug)]
pub(crate) struct Facts {
    pub(crate) horizons: Vec<HorizonFacts>,
    /// Channels whose innovations are not white.
    pub(crate) coloured: Vec<String>,
    /// What stays unexplained with everything found.
    pub(crate) disturbance: Disturbance,
    /// Share of the winch forces' variance that acts at random and was not recorded.
    pub(crate) unrecorded: f64,
    pub(crate) effects: Vec<EffectFacts>,
    /// Whether the held-out data contradict a law that explains most of what is left in the training data.
    pub(crate) contradicted: bool,
    /// Whether the model misses some recordings and agrees with others that were fitted, each by itself.
    pub(crate) unlike: bool,
    /// Whether the search left something undone because its time was over.
    pub(crate) ended_early: bool,
    /// Terms outside the catalogue.
    pub(crate) terms: usize,
    /// What chance did in the last weighing, after which nothing more was taken up.
    pub(crate) chance: Option<NullTest>,
}

/// Standard error of an effect's size in multiples of the size: of the size parameter that is known best, for an effect
/// may well be zero along one axis. A law that is all shape is as well known as its best shape, a term as the number before it.
pub(crate) fn relative_error(effect: &EffectSpec, standard_error: &[Option<f64>]) -> f64 {
    let values = term::values(effect);
    let extends = |k: usize| effect.info().is_ok_and(|info| info.parameters.get(k).is_some_and(|p| p.extension));
    let is_size = |k: &usize| !term::is_shape(effect, *k) && !extends(*k);
    let mut sizes: Vec<usize> = (0..values.len()).filter(is_size).collect();
    if sizes.is_empty() {
        sizes = (0..values.len()).collect();
    }
    let of = |k: usize| standard_error.get(k).copied().flatten().filter(|e| e.is_finite()).map(|e| e / values[k].abs());
    sizes.into_iter().filter_map(of).fold(f64::INFINITY, f64::min)
}

/// Whether an effect has run out of the range in which it is itself, by more than its errors: its shape, for creep that is done
/// within a sample is only a softer spring, or its size, where it takes most of what it corrects in the model, or no robot has as much
/// of it. A sharp turn of
/// friction is the ideal law, and a shape that is not known, as where what it shapes has no size, is nowhere.
pub(crate) fn out_of_range(
    effect: &EffectSpec,
    standard_error: &[Option<f64>],
    model: &Model,
    policy: &Policy,
) -> bool {
    let Ok(info) = effect.info() else { return false };
    let sizes = Sizes::of(&model.parameters);
    let beyond = info.parameters.iter().zip(&effect.values).enumerate().any(|(k, (parameter, value))| {
        // A phase is the same after every turn, and what is zero in practice may be so.
        let (low, is_place) = (parameter.typical.0, matches!(parameter.unit, "m" | "m/s"));
        let of_itself = if parameter.shape && (low > 0.0 || low < 0.0 && is_place) {
            let (low, high) = range_of_shape(parameter, &sizes, policy.out_of_range);
            Some((if parameter.name == "transition_speed" { 0.0 } else { low }, high))
        } else {
            most_of_any_robot(parameter).map(|most| (parameter.min, policy.out_of_range * most))
        };
        let error = standard_error.get(k).copied().flatten().filter(|error| error.is_finite()).unwrap_or(0.0);
        let doubt = policy.out_by * error;
        effect.takes_part(k) && of_itself.is_some_and(|(low, high)| !(low - doubt..=high + doubt).contains(value))
    });
    beyond || !leaves_enough(effect, &sizes)
}

/// The largest size met in practice, where it is that of any robot, large or small: of a share, as of a force that is lost, and
/// of the thickness of a cable.
fn most_of_any_robot(parameter: &ParameterInfo) -> Option<f64> {
    let is_any = !parameter.shape && parameter.min == 0.0 && matches!(parameter.unit, "1" | "m");
    is_any.then_some(parameter.typical.1)
}

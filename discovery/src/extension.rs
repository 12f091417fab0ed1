//! The form of friction that was found: which law it is, how its force turns its sign, and presliding.
//!
//! A law is looked for in its plain form. Where it stands, each shape that the catalogue has for it is added and kept if the
//! information criterion falls; where something is left, the other laws of friction and presliding are tried, which makes
//! the friction force a state of its own. All this on the beginnings of the trials, where it costs little; the form chosen
//! is then fitted to the whole, and kept if the criterion falls by what counts.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::candidates::Situation;
use crate::estimate::FitError;
use crate::fitted::{Fitted, Trained};
use crate::search::{EVIDENCE, ROUNDS, Search, Taken};
use crate::verify;

/// Rounds of a refinement by which a start is judged.
const FIRST_ROUNDS: usize = 3;
/// Moves by which a trajectory settles where friction has become a state.
const SETTLING: usize = 3;
/// Most refinements one after the other.
const MOST_REFINEMENTS: usize = 3;
/// Deflections (m) at which friction may begin to slide.
const DEFLECTIONS: [f64; 2] = [1e-3, 2e-2];
/// Ratio of damping and stiffness (s) before sliding from which the search starts.
const DAMPING_TIME: f64 = 0.03;
/// Speeds (m/s) at which that damping may fade.
const DAMPING_SPEEDS: [f64; 2] = [0.02, 0.1];
/// Transition speed (m/s) of a law that no longer has to stand for presliding.
const SHARP: f64 = 1e-3;

/// A law without presliding, from where it is refined.
const STATIC: [(&str, f64); 4] =
    [("presliding_stiffness", 0.0), ("presliding_damping", 0.0), ("damping_speed", 0.0), ("transition_speed", 0.01)];

/// Parameters that shape how friction turns its sign, with the value from which each is refined.
const SHAPES: [(&str, f64); 3] = [("transition_speed", 0.01), ("tail", 0.2), ("algebraic", 0.2)];

/// Whether a parameter is in use: not one of an extension that is left out.
pub(crate) fn in_use(spec: &EffectSpec, parameter: usize) -> bool {
    spec.info().is_ok_and(|info| !info.parameters[parameter].leaves_out(spec.values[parameter]))
}

/// The number of parameters in use.
pub(crate) fn count_in_use(spec: &EffectSpec) -> usize {
    (0..spec.values.len()).filter(|parameter| in_use(spec, *parameter)).count()
}

/// `law` with the extensions that `other` has in use, where it knows them.
pub(crate) fn extended_like(law: &EffectSpec, other: &EffectSpec) -> EffectSpec {
    let mut extended = law.clone();
    let Ok(info) = other.info() else { return extended };
    for (k, parameter) in info.parameters.iter().enumerate() {
        if parameter.extension
            && in_use(other, k)
            && let Some(at) = index_of(&extended, parameter.name)
        {
            extended.values[at] = other.values[k];
        }
    }
    extended
}

/// The law of friction `id` where it contains the law `standing`, from where it can show that it is more.
pub(crate) fn containing(id: &str, standing: &EffectSpec) -> Option<EffectSpec> {
    let plain = ["tail", "algebraic"].iter().all(|shape| value_of(standing, shape) == Some(0.0));
    if id != "winch_stribeck_friction" || standing.id != "winch_coulomb_friction" || !plain {
        return None;
    }
    let (force, transition) = (value_of(standing, "force")?, value_of(standing, "transition_speed")?);
    let law = EffectSpec::new(id, standing.cable, &[force, 1.05 * force, 0.1, 0.0, transition]).ok()?;
    Some(extended_like(&law, standing))
}

fn index_of(spec: &EffectSpec, name: &str) -> Option<usize> {
    spec.info().ok()?.parameters.iter().position(|parameter| parameter.name == name)
}

fn value_of(spec: &EffectSpec, name: &str) -> Option<f64> {
    index_of(spec, name).map(|at| spec.values[at])
}

/// `model` with parameters of effect `at` set, those that the effect has.
fn with(model: &Model, at: usize, values: &[(&str, f64)]) -> Model {
    let mut model = model.clone();
    for (name, value) in values {
        if let Some(parameter) = index_of(&model.effects[at], name) {
            model.effects[at].values[parameter] = *value;
        }
    }
    model
}

/// Laws of friction in a winch and its pulley.
const FRICTION: [&str; 3] = ["winch_coulomb_friction", "winch_stribeck_friction", "pulley_capstan_loss"];

pub(crate) fn is_friction(effect: &EffectSpec) -> bool {
    is_friction_law(&effect.id)
}

pub(crate) fn is_friction_law(id: &str) -> bool {
    FRICTION.contains(&id)
}

/// The other laws of friction at the place of `effect`, of its size, at a mean tension (N).
fn kin_of(effect: &EffectSpec, tension: f64) -> Vec<EffectSpec> {
    let force = value_of(effect, "force").or(value_of(effect, "coulomb"));
    let Some(force) = force.or(value_of(effect, "loss").map(|loss| loss * tension)) else { return Vec::new() };
    let values: [&[f64]; 3] = [&[force, 0.02], &[force, 1.3 * force, 0.1, 10.0], &[force / tension, 0.02]];
    let others = FRICTION.into_iter().zip(values).filter(|(id, _)| *id != effect.id);
    others.filter_map(|(id, values)| EffectSpec::new(id, effect.cable, values).ok()).collect()
}

/// How far a law's presliding has got.
fn stage(effect: &EffectSpec) -> Stage {
    match (value_of(effect, "presliding_stiffness"), value_of(effect, "presliding_damping")) {
        (Some(stiffness), Some(damping)) if stiffness > 0.0 && damping > 0.0 => Stage::Complete,
        (Some(stiffness), _) if stiffness > 0.0 => Stage::Undamped,
        _ => Stage::Static,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// No presliding.
    Static,
    /// Presliding without damping.
    Undamped,
    /// Presliding with all that belongs to it.
    Complete,
}

impl Search<'_> {
    /// `fitted` with effect `at`, if that is friction, as the law of friction and with the extensions that earn their place:
    /// chosen by the beginnings of the trials, then fitted to the whole. As it is where that cannot be simulated.
    pub(crate) fn extend(&mut self, fitted: Fitted, at: usize) -> Fitted {
        let effect = &fitted.train.model.effects[at];
        if !is_friction(effect) || stage(effect) == Stage::Complete {
            return fitted;
        }
        let among = fitted.train.model.effects.len();
        if self.taken[at - self.given].formed_among.replace(among) == Some(among) {
            return fitted;
        }
        (self.progress)("fitting the shape of friction", 0.2);
        let Ok(begun) = self.formed(&fitted, at) else { return fitted };
        self.as_begun(fitted, &begun, at)
    }

    /// The form of friction `at` that the beginnings of the trials ask for.
    fn formed(&self, fitted: &Fitted, at: usize) -> Result<Trained, FitError> {
        let mut begun = self.on_beginnings(fitted)?;
        if stage(&fitted.train.model.effects[at]) == Stage::Undamped {
            return self.damped(begun, at);
        }
        begun = self.shaped(begun, at);
        if self.something_left(&begun) {
            let mut laws = self.kin(begun, at);
            // Presliding of the best law that knows it, even where a law without it is better as long as there is none.
            let preslides = |law: &&Trained| index_of(&law.fit.model.effects[at], "presliding_stiffness").is_some();
            let presliding = laws.iter().find(preslides).and_then(|law| self.presliding(law, at).ok().flatten());
            begun = match presliding {
                Some(next) if next.score < laws[0].score => next,
                _ => laws.swap_remove(0),
            };
        }
        Ok(begun)
    }

    /// `fitted` with the law of effect `at` that was chosen by the beginnings of the trials, if it earns its place.
    fn as_begun(&mut self, fitted: Fitted, begun: &Trained, at: usize) -> Fitted {
        let (old, new) = (fitted.train.model.effects[at].clone(), &begun.fit.model.effects[at]);
        if old.id == new.id && count_in_use(&old) == count_in_use(new) {
            return fitted;
        }
        let Ok(Some(next)) = self.on_whole(&fitted, begun) else { return fitted };
        self.taken.iter_mut().for_each(Taken::changed);
        self.taken[at - self.given].formed_among = Some(next.train.model.effects.len());
        let change = next.score - fitted.score;
        let new = next.train.model.effects[at].clone();
        let taken = &mut self.taken[at - self.given];
        taken.delta_bic += change;
        taken.rivals.retain(|rival| rival.id != new.id);
        if old.id == new.id {
            self.note(&new, "extended", change, "");
        } else {
            let reason = format!("in place of {}", old.id);
            taken.rivals.insert(0, old);
            self.note(&new, "replaced", change, &reason);
        }
        next
    }

    /// The model that was chosen by the beginnings of the trials on the whole, if it is better than `fitted` by what counts.
    fn on_whole(&self, fitted: &Fitted, begun: &Trained) -> Result<Option<Fitted>, FitError> {
        // Where friction becomes a state, the trajectory must settle before anything is refined.
        let mut start = self.started(&begun.fit.model, &fitted.train, &self.evidence.train)?;
        start.settle(&self.evidence.train, SETTLING)?;
        let trained = self.train(&begun.fit.model, &start, &self.evidence.train, ROUNDS, None)?;
        if trained.score >= fitted.score - EVIDENCE {
            return Ok(None);
        }
        self.verified(trained, fitted).map(|next| Self::helps(fitted, &next).then_some(next))
    }

    /// The form that friction found before needs once another effect stands beside it.
    pub(crate) fn form(&mut self, mut fitted: Fitted) -> Fitted {
        for at in self.given..fitted.train.model.effects.len() {
            fitted = self.extend(fitted, at);
        }
        fitted
    }

    /// Once all effects stand: extensions that were too much as long as other effects were missing, and no presliding that
    /// stood for one of these.
    pub(crate) fn settle_extensions(&mut self, mut fitted: Fitted) -> Fitted {
        for at in self.given..fitted.train.model.effects.len() {
            if stage(&fitted.train.model.effects[at]) != Stage::Static
                && let Ok(Some(next)) = self.without_presliding(&fitted, at)
            {
                self.note(&next.train.model.effects[at].clone(), "simplified", next.score - fitted.score, "");
                fitted = next;
            }
            fitted = self.extend(fitted, at);
        }
        fitted
    }

    /// `fitted` with effect `at` as a static law, if that is as good.
    fn without_presliding(&self, fitted: &Fitted, at: usize) -> Result<Option<Fitted>, FitError> {
        let begun = self.on_beginnings(fitted)?;
        let model = with(&begun.fit.model, at, &STATIC);
        let start = self.loosened(&model, &begun.fit, &self.beginnings)?;
        let fixed = self.train(&model, &start, &self.beginnings, ROUNDS, None)?;
        if fixed.score >= begun.score + EVIDENCE {
            return Ok(None);
        }
        let next = self.fit_without(&fixed.fit.model, fitted, ROUNDS)?;
        Ok((next.score < fitted.score + EVIDENCE).then_some(next))
    }

    /// `fitted` on the beginnings of the trials, with its parameters fitted to them.
    fn on_beginnings(&self, fitted: &Fitted) -> Result<Trained, FitError> {
        let begun = fitted.train.begun(&self.beginnings)?;
        self.train(&fitted.train.model, &begun, &self.beginnings, FIRST_ROUNDS, None)
    }

    /// Whether the model leaves residuals on the beginnings of the trials that are not white.
    fn something_left(&self, begun: &Trained) -> bool {
        let noise = &begun.fit.randomness.noise;
        verify::whiteness(&begun.fit, &self.beginnings, noise).iter().any(|w| w.statistic > w.limit)
    }

    /// The law of effect `at` with the shapes that it needs on the beginnings of the trials; as it is where it has presliding
    /// or is none of friction.
    pub(crate) fn shaped(&self, mut begun: Trained, at: usize) -> Trained {
        if stage(&begun.fit.model.effects[at]) != Stage::Static {
            return begun;
        }
        for (name, value) in SHAPES {
            let effect = &begun.fit.model.effects[at];
            if index_of(effect, name).is_none_or(|k| in_use(effect, k)) {
                continue;
            }
            let model = with(&begun.fit.model, at, &[(name, value)]);
            let next = self.train(&model, &begun.fit, &self.beginnings, ROUNDS, None);
            let Some(next) = next.ok().filter(|next| next.score < begun.score) else { break };
            begun = next;
        }
        begun
    }

    /// The laws of friction, each in the shape it needs on the beginnings of the trials, in place of effect `at`; the best
    /// first. A richer law than that effect must be better by what counts.
    fn kin(&self, begun: Trained, at: usize) -> Vec<Trained> {
        let laws = kin_of(&begun.fit.model.effects[at], Situation::of(&self.beginnings).mean_tension);
        let own = count_in_use(&begun.fit.model.effects[at]);
        let handicap = |law: &Trained| {
            let richer = count_in_use(&law.fit.model.effects[at]) > own;
            law.score + if richer { 2.0 * EVIDENCE } else { 0.0 }
        };
        let tried = laws.into_par_iter().filter_map(|law| {
            let mut model = begun.fit.model.clone();
            model.effects[at] = law;
            let start = self.loosened(&model, &begun.fit, &self.beginnings).ok()?;
            let law = self.train(&model, &start, &self.beginnings, ROUNDS, None).ok()?;
            Some(self.shaped(law, at))
        });
        let mut all: Vec<Trained> = tried.collect();
        all.push(begun);
        all.sort_by(|a, b| handicap(a).total_cmp(&handicap(b)));
        all
    }

    /// The law of effect `at` with presliding, first without damping, in place of the shapes of a static law; on the
    /// beginnings of the trials, where it is better.
    fn presliding(&self, begun: &Trained, at: usize) -> Result<Option<Trained>, FitError> {
        let effect = &begun.fit.model.effects[at];
        let Some(force) = value_of(effect, "force").or(value_of(effect, "coulomb")) else { return Ok(None) };
        let sharp = with(&begun.fit.model, at, &[("transition_speed", SHARP), ("tail", 0.0), ("algebraic", 0.0)]);
        let starts = DEFLECTIONS.map(|deflection| vec![("presliding_stiffness", force / deflection)]);
        let Some(dahl) = self.tried(&sharp, at, &starts, begun) else { return Ok(None) };
        self.damped(self.refined_once(&dahl)?, at).map(Some)
    }

    /// Presliding of effect `at` with the damping that it needs on the beginnings of the trials.
    fn damped(&self, dahl: Trained, at: usize) -> Result<Trained, FitError> {
        let stiffness = value_of(&dahl.fit.model.effects[at], "presliding_stiffness").unwrap_or_default();
        let starts = DAMPING_SPEEDS
            .map(|speed| vec![("presliding_damping", DAMPING_TIME * stiffness), ("damping_speed", speed)]);
        let model = with(&dahl.fit.model, at, &[("transition_speed", 0.1 * SHARP)]);
        let damped = self.tried(&model, at, &starts, &dahl);
        self.refined(damped.unwrap_or(dahl))
    }

    /// Effect `at` from several starts, as far as a few rounds bring it: the best, if better than `from`.
    fn tried(&self, model: &Model, at: usize, starts: &[Vec<(&str, f64)>], from: &Trained) -> Option<Trained> {
        let tried = starts.par_iter().filter_map(|start| {
            self.train(&with(model, at, start), &from.fit, &self.beginnings, FIRST_ROUNDS, None).ok()
        });
        let best = tried.min_by(|a, b| a.score.total_cmp(&b.score))?;
        (best.score < from.score - EVIDENCE).then_some(best)
    }

    /// `begun` refined until nothing is gained.
    fn refined(&self, mut begun: Trained) -> Result<Trained, FitError> {
        for _ in 0..MOST_REFINEMENTS {
            let next = self.refined_once(&begun)?;
            let gained = begun.score - next.score;
            if gained > 0.0 {
                begun = next;
            }
            if gained < EVIDENCE {
                break;
            }
        }
        Ok(begun)
    }

    /// `begun` refined from a trajectory that has settled: where friction has just become a state, one round of smoothing
    /// is too little, and steps from there fail.
    fn refined_once(&self, begun: &Trained) -> Result<Trained, FitError> {
        let mut start = begun.fit.clone();
        start.settle(&self.beginnings, SETTLING)?;
        self.train(&begun.fit.model, &start, &self.beginnings, ROUNDS, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn effect(id: &str, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, Some(2), values).unwrap()
    }

    #[test]
    fn what_is_left_out_does_not_count() {
        let id = "winch_coulomb_friction";
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01])), 2);
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01, -0.1])), 3);
        assert_eq!(count_in_use(&effect(id, &[100.0, 0.01, 0.0, 0.0, 2e4])), 3);
        // A size of zero is a value, not an extension left out.
        assert_eq!(count_in_use(&effect("winch_stribeck_friction", &[100.0, 150.0, 0.1, 0.0])), 4);
    }

    #[test]
    fn kin_have_the_same_force_at_the_same_place() {
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        let kin = kin_of(&capstan, 15e3);
        let ids: Vec<&str> = kin.iter().map(|law| law.id.as_str()).collect();
        assert_eq!(ids, ["winch_coulomb_friction", "winch_stribeck_friction"]);
        assert!(kin.iter().all(|law| law.values[0] == 150.0 && law.cable == Some(2)), "{kin:?}");
        assert_eq!(kin_of(&kin[0], 15e3)[1].values, capstan.values);
        assert!(kin_of(&effect("winch_force_gain", &[0.01]), 15e3).is_empty());
    }

    #[test]
    fn presliding_has_three_stages() {
        let law =
            |stiffness, damping| effect("winch_coulomb_friction", &[100.0, 0.01, 0.0, 0.0, stiffness, damping, 0.05]);
        assert_eq!(stage(&law(0.0, 0.0)), Stage::Static);
        assert_eq!(stage(&law(2e4, 0.0)), Stage::Undamped);
        assert_eq!(stage(&law(2e4, 500.0)), Stage::Complete);
        assert_eq!(stage(&effect("pulley_capstan_loss", &[0.01, 0.02])), Stage::Static);
    }

    #[test]
    fn a_rival_gets_the_extensions_that_it_knows() {
        let standing = effect("winch_coulomb_friction", &[100.0, 0.01, 0.3, 0.0, 2e4, 500.0]);
        let stribeck = extended_like(&effect("winch_stribeck_friction", &[90.0, 150.0, 0.1, 5.0]), &standing);
        assert_eq!(stribeck.values, [90.0, 150.0, 0.1, 5.0, 0.0, 2e4, 500.0, 0.0]);
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        assert_eq!(extended_like(&capstan, &standing), capstan);
    }
}

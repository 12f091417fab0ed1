//! Extensions of a friction law that was found: how its force turns its sign, and presliding.
//!
//! A law is looked for in its plain form. Where it stands, each extension that the catalogue has for it is added, refined
//! with everything else, and kept if the information criterion falls by what counts. Presliding makes the friction force a
//! state of its own, and is tried only where something is left to explain.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::estimate::FitError;
use crate::search::{EVIDENCE, Fitted, NOTHING_LEFT, ROUNDS, Search};
use crate::verify;

/// Rounds of a refinement by which a start is judged.
const FIRST_ROUNDS: usize = 3;
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

impl Search<'_> {
    /// `fitted` with the extensions of the law of effect `at` that earn their place.
    pub(crate) fn extend(&mut self, mut fitted: Fitted, at: usize) -> Result<Fitted, FitError> {
        let effect = fitted.train.model.effects[at].clone();
        let plain = |name: &str| index_of(&effect, name).is_some_and(|k| !in_use(&effect, k));
        if !plain("presliding_stiffness") {
            return Ok(fitted);
        }
        (self.progress)("fitting the shape of friction", 0.2);
        for (name, value) in SHAPES.into_iter().filter(|(name, _)| plain(name)) {
            let model = with(&fitted.train.model, at, &[(name, value)]);
            let next = self.fit(&model, &fitted, ROUNDS);
            let Some(next) = self.earned(&fitted, next.ok(), at) else { break };
            fitted = next;
        }
        if self.something_left(&fitted) {
            let next = self.presliding(&fitted, at)?;
            fitted = self.earned(&fitted, next, at).unwrap_or(fitted);
        }
        Ok(fitted)
    }

    /// Once all effects stand: extensions that were too much as long as other effects were missing, and no presliding that
    /// stood for one of these.
    pub(crate) fn settle_extensions(&mut self, mut fitted: Fitted) -> Result<Fitted, FitError> {
        let effects = self.given..fitted.train.model.effects.len();
        let alone = effects.len() < 2;
        for at in effects {
            if value_of(&fitted.train.model.effects[at], "presliding_stiffness").is_none_or(|s| s == 0.0) {
                fitted = self.extend(fitted, at)?;
            } else if !alone {
                let model = with(&fitted.train.model, at, &STATIC);
                let next = self.fit_without(&model, &fitted, ROUNDS).ok();
                if let Some(next) = next.filter(|next| next.score < fitted.score + EVIDENCE) {
                    self.note(&next.train.model.effects[at].clone(), "simplified", next.score - fitted.score, "");
                    fitted = next;
                }
            }
        }
        Ok(fitted)
    }

    /// `next` where it is better than `before` by what counts, noted as such.
    fn earned(&mut self, before: &Fitted, next: Option<Fitted>, at: usize) -> Option<Fitted> {
        let next = next.filter(|next| next.score < before.score - EVIDENCE && Self::helps(before, next))?;
        let change = next.score - before.score;
        self.taken[at - self.given].delta_bic += change;
        self.note(&next.train.model.effects[at].clone(), "extended", change, "");
        Some(next)
    }

    /// Whether the model leaves a gap on held-out data or a residual that is not white.
    fn something_left(&self, fitted: &Fitted) -> bool {
        let noise = &fitted.train.randomness.noise;
        fitted.gap[0] > NOTHING_LEFT
            || verify::whiteness(&fitted.train, &self.evidence.train, noise).iter().any(|w| w.statistic > w.limit)
    }

    /// The law of effect `at` with presliding, first without damping, in place of the shapes of a static law.
    fn presliding(&self, fitted: &Fitted, at: usize) -> Result<Option<Fitted>, FitError> {
        let effect = &fitted.train.model.effects[at];
        let Some(force) = value_of(effect, "force").or(value_of(effect, "coulomb")) else { return Ok(None) };
        let sharp = with(&fitted.train.model, at, &[("transition_speed", SHARP), ("tail", 0.0), ("algebraic", 0.0)]);
        let starts = DEFLECTIONS.map(|deflection| vec![("presliding_stiffness", force / deflection)]);
        let Some(dahl) = self.tried(&sharp, at, &starts, fitted).next() else { return Ok(None) };
        let dahl = self.refined_once(&dahl)?;
        let Some(stiffness) = value_of(&dahl.train.model.effects[at], "presliding_stiffness") else { return Ok(None) };
        let starts = DAMPING_SPEEDS
            .map(|speed| vec![("presliding_damping", DAMPING_TIME * stiffness), ("damping_speed", speed)]);
        let model = with(&dahl.train.model, at, &[("transition_speed", 0.1 * SHARP)]);
        let damped = self.tried(&model, at, &starts, &dahl).min_by(|a, b| a.score.total_cmp(&b.score));
        self.refined(damped.unwrap_or(dahl)).map(Some)
    }

    /// Effect `at` from several starts, as far as a few rounds bring it, where that is better than `from`.
    fn tried<'a>(
        &'a self,
        model: &'a Model,
        at: usize,
        starts: &'a [Vec<(&'a str, f64)>],
        from: &'a Fitted,
    ) -> impl Iterator<Item = Fitted> + 'a {
        let tried = starts.iter().filter_map(move |start| self.fit(&with(model, at, start), from, FIRST_ROUNDS).ok());
        tried.filter(|next| next.score < from.score - EVIDENCE)
    }

    /// `fitted` refined until nothing is gained.
    fn refined(&self, mut fitted: Fitted) -> Result<Fitted, FitError> {
        for _ in 0..MOST_REFINEMENTS {
            let next = self.refined_once(&fitted)?;
            let gained = fitted.score - next.score;
            if gained > 0.0 {
                fitted = next;
            }
            if gained < EVIDENCE {
                break;
            }
        }
        Ok(fitted)
    }

    /// `fitted` refined from a trajectory that has settled: where friction has just become a state, one round of smoothing
    /// is too little, and steps from there fail.
    fn refined_once(&self, fitted: &Fitted) -> Result<Fitted, FitError> {
        let mut start = fitted.clone();
        for _ in 0..2 {
            start.train.smooth(&self.evidence.train)?;
        }
        self.fit(&fitted.train.model, &start, ROUNDS)
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
    fn a_rival_gets_the_extensions_that_it_knows() {
        let standing = effect("winch_coulomb_friction", &[100.0, 0.01, 0.3, 0.0, 2e4, 500.0]);
        let stribeck = extended_like(&effect("winch_stribeck_friction", &[90.0, 150.0, 0.1, 5.0]), &standing);
        assert_eq!(stribeck.values, [90.0, 150.0, 0.1, 5.0, 0.0, 2e4, 500.0, 0.0]);
        let capstan = effect("pulley_capstan_loss", &[0.01, 0.02]);
        assert_eq!(extended_like(&capstan, &standing), capstan);
    }
}

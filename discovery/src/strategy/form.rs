//! How the form of friction is found: its law, how its force turns its sign, and presliding.
//!
//! A law is looked for in its plain form. Where it stands, each shape that the catalogue has for it is added and kept if the
//! information criterion falls: first unlike forces in the two directions, unless a force bias beside equal ones explains more
//! (they differ where the winch hardly moves), then the turn; where something is left, the other laws of friction and presliding are tried, which makes
//! the friction force a state of its own. All this on the beginnings of the trials, where it costs little; the form chosen
//! is then fitted to the whole, and kept if the criterion falls by what counts. Presliding is tried on all friction at once:
//! one machine has one kind of it, and as long as one winch lacks it, it does not show on another.

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::filter::estimate::FitError;
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::extension::{
    Stage, beyond_first_order, count_in_use, force_of, in_use, index_of, is_friction, kin_of, stage, value_of, with,
};
use crate::journal::Outcome;
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::search::{EVIDENCE, ROUNDS, Search, Taken};

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

/// A law without presliding, from where it is refined.
const STATIC: [(&str, f64); 4] =
    [("presliding_stiffness", 0.0), ("presliding_damping", 0.0), ("damping_speed", 0.0), ("transition_speed", 0.01)];

/// Difference between the two directions, with the value from which it is refined.
const ASYMMETRY: (&str, f64) = ("asymmetry", 0.1);
/// Parameters that shape how friction turns its sign, each tried where the one before it helped.
const TURN: [(&str, f64); 3] = [("transition_speed", 0.01), ("tail", 0.2), ("algebraic", 0.2)];

impl Search<'_> {
    /// `fitted` with all friction in the form that it needs beside the effects that stand.
    pub(crate) fn form(&mut self, fitted: Fitted) -> Fitted {
        self.form_if(fitted, f64::NEG_INFINITY)
    }

    /// As [`Search::form`], but law and presliding only if they explain more than this share of the evidence that is left.
    pub(crate) fn form_if(&mut self, fitted: Fitted, share: f64) -> Fitted {
        let among = fitted.train.model.effects.len();
        let wanting: Vec<usize> = (self.given..among)
            .filter(|at| {
                let effect = &fitted.train.model.effects[*at];
                let formed = self.taken[at - self.given].formed_among == Some(among);
                is_friction(effect) && stage(effect) != Stage::Complete && !formed
            })
            .collect();
        if wanting.is_empty() {
            return fitted;
        }
        (self.progress)("fitting the shape of friction", 0.2);
        let first = &fitted.train.model.effects[wanting[0]];
        let begun = self.journal.tried(first, "its form, on the beginnings of the trials", self.on_beginnings(&fitted));
        let Some(begun) = begun else { return fitted };
        let shaped = wanting.iter().fold(begun, |begun, at| self.in_full(begun, *at));
        let formed = self.journal.tried(first, "in another form", self.formed(&shaped, &wanting));
        let Some(formed) = formed else { return fitted };
        if self.share(shaped.score, formed.score, &self.beginnings) < share {
            return self.as_begun(fitted, &shaped);
        }
        for at in wanting {
            self.taken[at - self.given].formed_among = Some(among);
        }
        self.as_begun(fitted, &formed)
    }

    /// The law and the presliding of friction at some places that the beginnings of the trials ask for.
    pub(crate) fn formed(&self, shaped: &Trained, places: &[usize]) -> Result<Trained, FitError> {
        let mut begun = shaped.clone();
        let mut able: Vec<(usize, EffectSpec)> = Vec::new();
        let mut undamped = false;
        for &at in places {
            if stage(&begun.fit.model.effects[at]) == Stage::Undamped {
                undamped = true;
            } else if self.something_left(&begun.fit, &self.beginnings) {
                let mut laws = self.kin(begun, at);
                // The best law that knows presliding, even where another one is better as long as there is none.
                let mut effects = laws.iter().map(|law| &law.fit.model.effects[at]);
                let law = effects.find(|law| index_of(law, "presliding_stiffness").is_some());
                able.extend(law.map(|law| (at, law.clone())));
                begun = laws.swap_remove(0);
            }
        }
        let presliding = match (able.is_empty(), undamped) {
            (true, false) => return Ok(begun),
            (true, true) => return self.damped(begun),
            // Another law may have explained it all.
            (false, _) if !self.something_left(&begun.fit, &self.beginnings) => return Ok(begun),
            (false, _) => self.presliding(&begun, &able)?,
        };
        Ok(presliding.filter(|next| next.score < begun.score).unwrap_or(begun))
    }

    /// `fitted` with the form of friction that was chosen by the beginnings of the trials, if it earns its place.
    fn as_begun(&mut self, fitted: Fitted, begun: &Trained) -> Fitted {
        let old = fitted.train.model.effects.clone();
        let new = &begun.fit.model.effects;
        let changed: Vec<usize> = (self.given..old.len())
            .filter(|at| old[*at].id != new[*at].id || count_in_use(&old[*at]) != count_in_use(&new[*at]))
            .collect();
        if changed.is_empty() {
            return fitted;
        }
        let whole = self.journal.tried(&new[changed[0]], "in this form on the whole", self.on_whole(&fitted, begun));
        let Some(next) = whole.flatten() else { return fitted };
        let among = self.taken.iter().map(|taken| taken.formed_among).collect::<Vec<_>>();
        self.taken.iter_mut().for_each(Taken::changed);
        let change = next.score - fitted.score;
        for at in changed {
            let (old, new) = (old[at].clone(), next.train.model.effects[at].clone());
            let taken = &mut self.taken[at - self.given];
            taken.formed_among = among[at - self.given];
            taken.delta_bic += change;
            taken.rivals.retain(|rival| rival.id != new.id);
            if old.id == new.id {
                self.journal.note(&new, Outcome::Extended, change, "");
            } else {
                let reason = format!("in place of {}", old.id);
                taken.rivals.insert(0, old);
                self.journal.note(&new, Outcome::Replaced, change, &reason);
            }
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

    /// Once all effects stand: extensions that were too much as long as other effects were missing, and no presliding and no
    /// asymmetry that stood for one of these.
    pub(crate) fn settle_extensions(&mut self, mut fitted: Fitted) -> Fitted {
        let among = fitted.train.model.effects.len();
        for at in self.given..among {
            let formed = self.taken[at - self.given].formed_among == Some(among);
            if !formed && stage(&fitted.train.model.effects[at]) != Stage::Static {
                fitted = self.simplified(fitted, at, &STATIC);
            }
            if value_of(&fitted.train.model.effects[at], ASYMMETRY.0).is_some_and(|a| a != 0.0) {
                fitted = self.simplified(fitted, at, &[(ASYMMETRY.0, 0.0)]);
            }
        }
        self.form(fitted)
    }

    /// `fitted` with parameters of effect `at` as in a simpler law, if that is as good.
    fn simplified(&mut self, fitted: Fitted, at: usize, law: &[(&str, f64)]) -> Fitted {
        let simpler = self.simpler(&fitted, at, law);
        let simpler = self.journal.tried(&fitted.train.model.effects[at], "in a simpler form", simpler);
        let Some(next) = simpler.flatten() else { return fitted };
        self.journal.note(&next.train.model.effects[at].clone(), Outcome::Simplified, next.score - fitted.score, "");
        next
    }

    fn simpler(&self, fitted: &Fitted, at: usize, law: &[(&str, f64)]) -> Result<Option<Fitted>, FitError> {
        let begun = self.on_beginnings(fitted)?;
        let model = with(&begun.fit.model, at, law);
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
        let begun = self.begun(&fitted.train)?;
        self.train(&fitted.train.model, &begun, &self.beginnings, FIRST_ROUNDS, None)
    }

    /// The law of effect `at` with the shapes that it needs on the beginnings of the trials; as it is where it has presliding
    /// or is none of friction.
    pub(crate) fn shaped(&self, mut begun: Trained, at: usize) -> Trained {
        if stage(&begun.fit.model.effects[at]) != Stage::Static {
            return begun;
        }
        if let Some(unlike) = self.unlike_directions(&begun, at) {
            begun = unlike;
        }
        for shape in TURN {
            let effect = &begun.fit.model.effects[at];
            if index_of(effect, shape.0).is_none_or(|k| in_use(effect, k)) {
                continue;
            }
            let Some(next) = self.with_shape(&begun, at, shape) else { break };
            begun = next;
        }
        begun
    }

    /// `begun` with one more shape of effect `at`, if the criterion falls.
    fn with_shape(&self, begun: &Trained, at: usize, shape: (&str, f64)) -> Option<Trained> {
        let model = with(&begun.fit.model, at, &[shape]);
        let next = self.train(&model, &begun.fit, &self.beginnings, ROUNDS, None);
        let next = self.journal.tried(&model.effects[at], &format!("with {}", shape.0), next);
        next.filter(|next| next.score < begun.score)
    }

    /// The law of effect `at` with the shapes that it needs, or the one of which it is the first order, which has as many
    /// parameters, if that is better by what counts.
    fn in_full(&self, begun: Trained, at: usize) -> Trained {
        let shaped = self.shaped(begun, at);
        let Some(law) = beyond_first_order(&shaped.fit.model.effects[at]) else { return shaped };
        let mut model = shaped.fit.model.clone();
        model.effects[at] = law;
        let whole = self.train(&model, &shaped.fit, &self.beginnings, ROUNDS, None);
        let whole = self.journal.tried(&model.effects[at], "beyond its first order", whole);
        whole.filter(|whole| whole.score < shaped.score - EVIDENCE).unwrap_or(shaped)
    }

    /// `begun` with the law of effect `at` unlike in its two directions, if the criterion falls by more than with a force bias
    /// beside it: while the winch turns fast the two are the same force, at rest only the bias acts.
    fn unlike_directions(&self, begun: &Trained, at: usize) -> Option<Trained> {
        let effect = &begun.fit.model.effects[at];
        if in_use(effect, index_of(effect, ASYMMETRY.0)?) {
            return None;
        }
        let unlike = self.with_shape(begun, at, ASYMMETRY)?;
        let law = &unlike.fit.model.effects[at];
        let bias = force_of(law)? * value_of(law, ASYMMETRY.0)?;
        let mut biased = begun.fit.model.clone();
        biased.effects.push(EffectSpec::new("winch_force_bias", law.cable, &[bias]).ok()?);
        let with_bias = self.train(&biased, &begun.fit, &self.beginnings, ROUNDS, None);
        let with_bias = self.journal.tried(law, "equal in both directions beside a bias", with_bias);
        with_bias.is_none_or(|biased| unlike.score <= biased.score).then_some(unlike)
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
        let fitted = |law: &EffectSpec| {
            let mut model = begun.fit.model.clone();
            model.effects[at] = law.clone();
            let start = self.loosened(&model, &begun.fit, &self.beginnings)?;
            self.train(&model, &start, &self.beginnings, ROUNDS, None)
        };
        let tried = laws.par_iter().filter_map(|law| {
            let law = self.journal.tried(law, "as another law of friction", fitted(law))?;
            Some(self.in_full(law, at))
        });
        let mut all: Vec<Trained> = self.journal.side_by_side(|| tried.collect());
        all.push(begun);
        all.sort_by(|a, b| handicap(a).total_cmp(&handicap(b)));
        all
    }

    /// Presliding of the `able` laws, first without damping, in place of the shapes of static ones; on the beginnings of the
    /// trials, where it is better.
    fn presliding(&self, begun: &Trained, able: &[(usize, EffectSpec)]) -> Result<Option<Trained>, FitError> {
        let starts = DEFLECTIONS.map(|deflection| {
            let mut model = begun.fit.model.clone();
            for (at, law) in able {
                model.effects[*at] = law.clone();
                let stiffness = force_of(law).unwrap_or_default() / deflection;
                let values = [("tail", 0.0), ("algebraic", 0.0), ("presliding_stiffness", stiffness)];
                model = with(&model, *at, &values);
            }
            model
        });
        let Some(dahl) = self.tried(&starts, begun, &able[0].1) else { return Ok(None) };
        self.damped(self.refined_once(&dahl)?).map(Some)
    }

    /// Presliding with the damping that it needs on the beginnings of the trials, wherever it has none.
    fn damped(&self, dahl: Trained) -> Result<Trained, FitError> {
        let starts = DAMPING_SPEEDS.map(|speed| {
            let mut model = dahl.fit.model.clone();
            for at in self.given..model.effects.len() {
                let effect = &model.effects[at];
                if is_friction(effect) && stage(effect) == Stage::Undamped {
                    let damping = DAMPING_TIME * value_of(effect, "presliding_stiffness").unwrap_or_default();
                    let values = [("presliding_damping", damping), ("damping_speed", speed)];
                    model = with(&model, at, &values);
                }
            }
            model
        });
        let undamped = |effect: &&EffectSpec| is_friction(effect) && stage(effect) == Stage::Undamped;
        let damped = match dahl.fit.model.effects[self.given..].iter().find(undamped) {
            Some(law) => self.tried(&starts, &dahl, law),
            None => None,
        };
        self.refined(damped.unwrap_or(dahl))
    }

    /// The best of several starts of presliding of a `law`, as far as a few rounds bring them, if better than `from`.
    fn tried(&self, starts: &[Model], from: &Trained, law: &EffectSpec) -> Option<Trained> {
        let train = |start| self.train(start, &from.fit, &self.beginnings, FIRST_ROUNDS, None);
        let tried = starts.par_iter().filter_map(|start| self.journal.tried(law, "with presliding", train(start)));
        let best = self.journal.side_by_side(|| tried.min_by(|a, b| a.score.total_cmp(&b.score)))?;
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
    use crate::data::recording::record;
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::fitted::Evidence;

    /// The asymmetry that a plain law gets where `hidden` effects act.
    fn asymmetry(hidden: &[EffectSpec]) -> f64 {
        let (train, holdout) = (vec![record(hidden, 30.0, 41)], vec![record(hidden, 20.0, 42)]);
        let noise = noise_of_data(&[&train[..], &holdout[..]].concat());
        let evidence = Evidence { train, holdout, noise, instruments: None };
        let search = Search::new(&evidence, 0, &|_, _| {});
        let plain = EffectSpec::new("winch_coulomb_friction", Some(2), &[180.0, 0.02]).unwrap();
        let model = Model { effects: vec![plain], ..Model::default() };
        let from = crate::data::recording::fitted(&[], &evidence.train);
        let begun = search.train(&model, &from, &search.beginnings, ROUNDS, None).unwrap();
        value_of(&search.shaped(begun, 0).fit.model.effects[0], "asymmetry").unwrap()
    }

    /// Friction with 30 % more when paying out was found as equal friction and a force bias, which it is but at low speeds.
    #[test]
    fn friction_unlike_in_its_directions_is_told_from_a_bias_beside_it() {
        let friction = |asymmetry: f64| {
            let values = [180.0, 0.02, 0.0, 0.0, 0.0, 0.0, 0.0, asymmetry];
            EffectSpec::new("winch_coulomb_friction", Some(2), &values).unwrap()
        };
        let found = asymmetry(&[friction(0.3)]);
        assert!((found - 0.3).abs() < 0.03, "{found}");
        let bias = EffectSpec::new("winch_force_bias", Some(2), &[54.0]).unwrap();
        assert_eq!(asymmetry(&[friction(0.0), bias]), 0.0);
    }
}

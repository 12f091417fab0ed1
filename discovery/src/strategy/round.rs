//! One round of the search: all candidates weighed, the best fitted, its rivals kept.

use std::sync::{Mutex, PoisonError};

use crate::data::Trial;
use crate::filter::estimate::{Fit, FitError};
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::{Candidate, Library, Situation};
use crate::hypothesis::stream::normals;
use crate::journal::Outcome;
use crate::strategy::entrance::{Answer, Source};
use crate::strategy::fitted::Fitted;
use crate::strategy::search::{EVIDENCE, ROUNDS, Search};
use crate::weigh::null_test::{Weighed, Weighing};
use crate::weigh::regression::{Penalty, Scored, baseline, ladder, levels, rank};
use cdpr::effect::EffectSpec;

/// Share of the best candidate's gain at which a simpler one is preferred.
const SIMPLER: f64 = 0.93;
/// Most rivals of one effect that are fitted in full.
pub(crate) const MOST_RIVALS: usize = 3;

/// Candidates along a fit of the training data.
pub(crate) struct Signatures {
    pub(crate) library: Library,
    /// The size of what is random at which they were weighed last, and what came of it.
    weighed: Mutex<Option<(Randomness, Weighed)>>,
}

impl Signatures {
    pub(crate) fn new(library: Library) -> Self {
        Self { library, weighed: Mutex::default() }
    }

    /// What comes of weighing all of them along their fit.
    pub(crate) fn weighed(&self, fit: &Fit, trials: &[Trial], randomness: &Randomness) -> Weighed {
        let known = || self.weighed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((size, weighed)) = &*known()
            && size.same(randomness)
        {
            return weighed.clone();
        }
        let weighed = Weighing { fit, trials, library: &self.library, randomness }.weigh();
        *known() = Some((randomness.clone(), weighed.clone()));
        weighed
    }
}

impl Search<'_> {
    /// What the candidates need to know of the data, with the spectral peaks of the latent forces.
    pub(crate) fn situation(&self, fit: &Fit) -> Situation {
        let mut situation = Situation::of(&self.evidence.train);
        situation.peaks = crate::hypothesis::spectrum::peaks(fit, &self.evidence.train);
        situation.waves = crate::hypothesis::spectrum::waves(fit, &self.evidence.train);
        let (each, all) = crate::hypothesis::spectrum::drum_waves(fit, &self.evidence.train);
        let radius = |number: Option<f64>| number.map(|number| 1.0 / number);
        situation.drums = (each.into_iter().map(radius).collect(), radius(all));
        situation
    }

    /// One round over a library: the best candidate, refined and taken up, if it earns its place. Over the catalogue, where
    /// the instruments explain more, there is none, but a better fit to go on from.
    pub(crate) fn round(
        &mut self,
        fitted: &Fitted,
        signatures: &Signatures,
        source: Source,
        most_refusals: usize,
    ) -> Result<Option<Fitted>, FitError> {
        let library = &signatures.library;
        let parsimony = source == Source::Catalogue;
        let e = self.evidence;
        let fit = &fitted.train;
        self.tried.extend(library.candidates.iter().map(|candidate| library.name(candidate)));
        let sizes = ladder(&fit.randomness);
        let levels = levels(fit, &e.train, signatures, &sizes);
        for (variation, error) in &*signatures.weighed(fit, &e.train, &sizes[0]).failures {
            self.journal.silent(&library.variations[*variation], error);
        }
        let base = baseline(&levels);
        let ranked = rank(library, &levels, self.penalty);
        let gain = ranked.first().map_or(0.0, |best| base - best.score).max(0.0);
        if parsimony {
            let instruments = self.instruments.clone();
            self.better = self.better_instruments(fitted, gain)?;
            if let Some(better) = &self.better {
                // What begins or ends looks like an instrument that drifts.
                let explained = fitted.score - better.score;
                let after = std::mem::replace(&mut self.instruments, instruments);
                let found = self.for_a_while(fitted, library, &ranked, explained)?;
                if found.is_some() {
                    self.better = None;
                } else {
                    self.instruments = after;
                }
                return Ok(found);
            }
        }
        let mut refused: Vec<(&'static str, Option<usize>)> = Vec::new();
        while refused.len() < most_refusals {
            let left: Vec<Scored> = ranked
                .iter()
                .filter(|s| {
                    let c = &library.candidates[s.candidate];
                    c.id == "expression" || !refused.contains(&(c.id, c.cable))
                })
                .skip(if library.candidates.first().is_some_and(|c| c.id == "expression") { refused.len() } else { 0 })
                .cloned()
                .collect();
            let Some(best) = left.first() else { break };
            if base - best.score < EVIDENCE {
                break;
            }
            // The simpler of two good explanations first; once one is refused, the better one.
            let chosen = if parsimony && refused.is_empty() { simplest(library, &left, base) } else { best };
            let candidate = &library.candidates[chosen.candidate];
            refused.push((candidate.id, candidate.cable));
            let Some(effect) = effect_of(library, chosen) else { continue };
            // Where errors of the survey move along, its signature does not say all.
            let alone = library.beside.is_empty() && is_a_force(candidate.id);
            if alone && self.foreseen(fitted, library, chosen, &sizes) > fitted.holdout_score {
                self.journal.note(
                    &effect,
                    Outcome::Refused,
                    chosen.score - base,
                    "it would not predict the held-out data better",
                );
                continue;
            }
            let mut model = fit.model.clone();
            model.effects.push(effect.clone());
            let trained = self.train(&model, &fitted.train, &e.train, ROUNDS, None).map(|one| self.both_limits(one));
            let trained = match trained {
                Ok(trained) if trained.score < fitted.score - EVIDENCE => trained,
                Ok(trained) => {
                    let change = trained.score - fitted.score;
                    self.journal.note(&effect, Outcome::Refused, change, "too little evidence after refinement");
                    continue;
                }
                Err(error) => {
                    self.journal.failed(&effect, "it cannot be fitted", &error);
                    continue;
                }
            };
            match self.verified(trained, fitted) {
                Ok(next) if Self::helps(fitted, &next) => {
                    let (next, rivals) = match source {
                        Source::Catalogue => {
                            let mut rivals = rivals(library, &ranked, chosen, base);
                            let other = self.or_rival(fitted, &next, &mut rivals);
                            (
                                self.journal.tried(&effect, "its rivals in its place", other).flatten().unwrap_or(next),
                                rivals,
                            )
                        }
                        Source::Terms => (next, Vec::new()),
                    };
                    match self.enter(fitted, &next, vec![rivals], source, "")? {
                        Answer::Enters => return Ok(Some(next)),
                        // What explains less is chance as well.
                        Answer::Chance => break,
                    }
                }
                Ok(next) => {
                    let change = next.score - fitted.score;
                    self.journal.note(
                        &effect,
                        Outcome::Refused,
                        change,
                        "it does not predict the held-out data better",
                    );
                }
                Err(error) => self.journal.failed(&effect, "it does not go with the held-out data", &error),
            }
        }
        if parsimony {
            let weighed = signatures.weighed(fit, &e.train, &sizes[0]);
            self.null_test = weighed.null_test(library, self.penalty, EVIDENCE);
            if fit.randomness.has_latents() || self.something_left(fit, &e.train) {
                let found = self.for_a_while(fitted, library, &ranked, 0.0)?;
                if found.is_some() {
                    return Ok(found);
                }
            }
            if gain > 0.0 && !self.may_hide(fitted) {
                self.better = self.better_instruments(fitted, 0.0)?;
            }
        }
        Ok(None)
    }

    /// `-2 log L` of the held-out data with a candidate of these amplitudes, foreseen by its signature.
    fn foreseen(&self, fitted: &Fitted, library: &Library, scored: &Scored, sizes: &[Randomness]) -> f64 {
        let (fit, trials) = (&fitted.holdout, &self.evidence.holdout);
        let own = library.only(scored.candidate);
        let size = &sizes[scored.level..=scored.level];
        let normal = &normals(fit, trials, (&own.variations, &own.columns), size, None)[0];
        normal.minus_two_log_likelihood - normal.drop(&scored.amplitudes)
    }
}

/// Whether a candidate is a force that enters the model as it is, so that its signature says all of it.
fn is_a_force(id: &str) -> bool {
    matches!(id, "expression" | "periodic_gust" | "steady_wind")
}

pub(crate) fn effect_of(library: &Library, scored: &Scored) -> Option<EffectSpec> {
    library.candidates[scored.candidate].effect(&scored.amplitudes)
}

/// Effects to be fitted together, and the rivals of each.
pub(crate) type Proposed = (Vec<EffectSpec>, Vec<Vec<EffectSpec>>);

/// The best candidate along a fit with its rivals, if it explains enough to be believed.
pub(crate) fn best_alone(fit: &Fit, trials: &[Trial], signatures: &Signatures, penalty: Penalty) -> Option<Proposed> {
    let library = &signatures.library;
    let levels = levels(fit, trials, signatures, &ladder(&fit.randomness));
    let (base, ranked) = (baseline(&levels), rank(library, &levels, penalty));
    let best = ranked.first().filter(|best| base - best.score > EVIDENCE)?;
    Some((vec![effect_of(library, best)?], vec![rivals(library, &ranked, best, base)]))
}

/// The candidate with the fewest columns among those nearly as good as the best.
fn simplest<'a>(library: &Library, ranked: &'a [Scored], base: f64) -> &'a Scored {
    let enough = SIMPLER * (base - ranked[0].score);
    let size = |s: &Scored| library.candidates[s.candidate].columns.len();
    ranked
        .iter()
        .filter(|s| base - s.score >= enough)
        .min_by(|a, b| size(a).cmp(&size(b)).then(a.score.total_cmp(&b.score)))
        .unwrap_or(&ranked[0])
}

/// The best candidates that are another explanation than the one chosen, for a full comparison: first of those that the
/// catalogue says are alike, whatever else explains more.
fn rivals(library: &Library, ranked: &[Scored], chosen: &Scored, base: f64) -> Vec<EffectSpec> {
    let own = &library.candidates[chosen.candidate];
    let share = |scored: &Scored| (base - scored.score) / (base - chosen.score);
    let mut out: Vec<EffectSpec> = Vec::new();
    for alike in [true, false] {
        for scored in ranked {
            let c = &library.candidates[scored.candidate];
            let known =
                (c.id == own.id && c.cable == own.cable) || out.iter().any(|e| e.id == c.id && e.cable == c.cable);
            if !known
                && out.len() < MOST_RIVALS
                && is_alike(own, c) == alike
                && is_rival(own, c, share(scored))
                && let Some(effect) = effect_of(library, scored)
            {
                out.push(effect);
            }
        }
    }
    out
}

/// Whether the catalogue says that two laws are alike; the winches of one machine are built alike.
fn is_alike(own: &Candidate, other: &Candidate) -> bool {
    let look_alikes = cdpr::effect::find(own.id).map_or(&[][..], |info| info.look_alikes);
    let alike = look_alikes.iter().any(|look_alike| look_alike.id == other.id) && other.cable == own.cable;
    alike || (other.id == own.id && other.cable.is_none())
}

/// Whether another candidate with a share of the gain of `own` is worth a full comparison.
pub(crate) fn is_rival(own: &Candidate, other: &Candidate, share: f64) -> bool {
    share > if is_alike(own, other) { 0.5 } else { 0.8 }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::record;
    use crate::hypothesis::candidates::catalogue;

    /// The noise of a channel that is not measured is no number, and no number equals itself: all was weighed anew each time.
    #[test]
    fn sizes_are_known_again_though_channels_are_not_measured() {
        let fit = crate::data::recording::fitted(&[], &[record(&[], 5.0, 1)]);
        assert!(fit.randomness.noise.iter().any(|noise| noise.is_nan()));
        assert!(fit.randomness.same(&ladder(&fit.randomness)[0]));
        let larger = Randomness { force: 2.0 * fit.randomness.force, ..fit.randomness.clone() };
        assert!(!fit.randomness.same(&larger));
    }

    /// Drag was not compared with viscous friction where three kinds of inertia explained more at first sight.
    #[test]
    fn look_alikes_of_the_catalogue_are_rivals_before_what_explains_more() {
        let library = catalogue(&Model::default(), &Situation::of(&[record(&[], 5.0, 1)]));
        let scored = |id: &str, cable: Option<usize>, score: f64| {
            let found = library.candidates.iter().position(|c| c.id == id && c.cable == cable);
            let candidate = found.unwrap_or_else(|| panic!("{id} is a candidate"));
            Scored { candidate, score, amplitudes: vec![1.0; library.candidates[candidate].columns.len()], level: 0 }
        };
        let chosen = scored("winch_viscous_friction", None, -100.0);
        let inertia = (1..=4).map(|cable| scored("winch_drum_inertia", Some(cable), -95.0));
        let mut ranked = vec![chosen.clone()];
        ranked.extend(inertia);
        ranked.push(scored("platform_linear_drag", None, -60.0));
        // Too little for a look-alike, and for any other.
        ranked.push(scored("cable_damping", None, -40.0));
        ranked.push(scored("platform_mass", None, -70.0));
        let ids: Vec<(String, Option<usize>)> =
            rivals(&library, &ranked, &chosen, 0.0).into_iter().map(|effect| (effect.id, effect.cable)).collect();
        let inertia = |cable| ("winch_drum_inertia".to_owned(), Some(cable));
        assert_eq!(ids, [("platform_linear_drag".to_owned(), None), inertia(1), inertia(2)]);
    }
}

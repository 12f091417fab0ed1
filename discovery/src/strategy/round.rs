//! One round of the search: all candidates weighed, the best fitted, its rivals kept.

use cdpr::effect::EffectSpec;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;
use crate::hypothesis::candidates::{Candidate, Library, is_there};
use crate::hypothesis::containing::far_away;
use crate::hypothesis::correction::leaves_enough;
use crate::hypothesis::facts::facts;
use crate::hypothesis::friction::{is_friction, on_all_winches};
use crate::hypothesis::stream::normals;
use crate::journal::{NOT_HELD_OUT, Outcome};
use crate::model::sizes::{Sizes, usual_force};
use crate::strategy::context::Context;
use crate::strategy::entrance::{Entry, enter};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::instruments::{better_instruments, forces_err_for_sure, with_instruments};
use crate::strategy::onset::for_a_while;
use crate::strategy::other_optimum::better_optimum;
use crate::strategy::policy::Policy;
use crate::strategy::rivals::or_rival;
use crate::strategy::second_look::may_hide;
use crate::strategy::standing::Standing;
use crate::verdict::{POLICY as VERDICT, out_of_range};
use crate::weigh::criterion::{EVIDENCE, Penalty, told_apart_from};
use crate::weigh::regression::{Scored, baseline, ladder, rank};
use crate::weigh::signatures::{Signatures, Source, levels};

/// What a round brings.
pub(crate) enum Round {
    /// One more effect stands.
    Found(Standing),
    /// No effect, but a fit with what the instruments ask for, which explains more.
    Instruments(Standing, Box<Fitted>),
    Nothing(Standing),
}

/// One round over a library: the best candidate, refined and accepted, if it earns its place. Over the catalogue, where the
/// instruments explain more, there is none, but a better fit to go on from.
pub(crate) fn round(
    context: &Context<'_>,
    mut standing: Standing,
    signatures: &Signatures,
    source: Source,
    most_refusals: usize,
) -> Result<Round, FitError> {
    let weighing = Weighing::new(context, &standing.fit, signatures, source);
    let gain = gain(weighing.base, &weighing.ranked);
    let library = &signatures.library;
    if source == Source::Catalogue
        && let Some(better) = better_instruments(context, &standing.fit, gain)?
    {
        let explained = standing.fit.score - better.score;
        // With such an error the search begins anew, whatever is found before.
        if better.train.randomness.white_input() > 0.0 && forces_err_for_sure(context, &standing.fit, gain) {
            return Ok(Round::Instruments(standing, Box::new(better)));
        }
        if weighing.explains_more_beside_instruments(&standing, &better, gain, explained)?
            && let Some(found) = weighing.best_that_enters(&standing, 1)?
        {
            return Ok(Round::Found(found));
        }
        // What begins or ends looks like an instrument that drifts.
        let found = for_a_while(context, &standing, library, &weighing.ranked, explained)?;
        return Ok(found.map_or_else(|| Round::Instruments(standing, Box::new(better)), Round::Found));
    }
    if let Some(found) = weighing.best_that_enters(&standing, most_refusals)? {
        return Ok(Round::Found(found));
    }
    if source == Source::Terms {
        return Ok(Round::Nothing(standing));
    }
    let (fit, trials) = (&standing.fit.train, &context.evidence.train);
    let weighed = signatures.weighed(fit, trials, &weighing.sizes[0]);
    let chance = weighed.null_test(library, context.penalty, EVIDENCE);
    let left = context.something_left(fit, trials);
    let ranked = weighing.ranked;
    standing.chance = chance;
    if left && let Some(found) = for_a_while(context, &standing, library, &ranked, 0.0)? {
        return Ok(Round::Found(found));
    }
    let hides = || may_hide(context, &standing, &standing.fit);
    let better = if hides() { None } else { better_instruments(context, &standing.fit, 0.0)? };
    Ok(match better {
        Some(better) => Round::Instruments(standing, Box::new(better)),
        None => Round::Nothing(standing),
    })
}

/// The candidates of a library, weighed along a fit.
struct Weighing<'a> {
    context: &'a Context<'a>,
    library: &'a Library,
    source: Source,
    sizes: Vec<Randomness>,
    /// `-2 log L` without any of them.
    base: f64,
    ranked: Vec<Scored>,
}

impl<'a> Weighing<'a> {
    fn new(context: &'a Context<'a>, fitted: &Fitted, signatures: &'a Signatures, source: Source) -> Self {
        let (library, trials) = (&signatures.library, &context.evidence.train);
        let fit = &fitted.train;
        context.journal.weighed(library.candidates.iter().map(|candidate| library.name(candidate)));
        let sizes = ladder(&fit.randomness);
        for (variation, error) in &*signatures.weighed(fit, trials, &sizes[0]).failures {
            context.journal.silent(&library.variations[*variation], error);
        }
        let (base, ranked) = ranked(fit, trials, signatures, &sizes, context.penalty);
        Self { context, library, source, sizes, base, ranked }
    }

    /// The best candidate that earns its place, accepted; so many may be refused.
    fn best_that_enters(&self, standing: &Standing, most_refusals: usize) -> Result<Option<Standing>, FitError> {
        let Self { context, library, base, .. } = *self;
        let fitted = &standing.fit;
        let mut refused: Vec<(&'static str, Option<usize>)> = Vec::new();
        while refused.len() < most_refusals {
            let left = self.left(&refused);
            let Some(best) = left.first() else { break };
            if base - best.score < EVIDENCE {
                break;
            }
            let chosen = if refused.is_empty() { self.first(&left).unwrap_or(best) } else { best };
            let candidate = &library.candidates[chosen.candidate];
            refused.push((candidate.id, candidate.cable));
            let Some(effect) = chosen.effect(library) else { continue };
            let Some(next) = self.fitted(fitted, chosen, &effect) else { continue };
            let (next, rivals) = match self.source {
                Source::Catalogue => {
                    let mut rivals = rivals(library, &self.ranked, chosen, base, context.policy);
                    let known = |law: &EffectSpec| rivals.iter().any(|rival| is_there(rival, &law.id, law.cable));
                    let force = usual_force(&context.evidence.train);
                    let hidden = hidden(next.gap[0], &next.train, force, context.policy);
                    let hidden: Vec<EffectSpec> = hidden.filter(|law| !known(law)).collect();
                    rivals.extend(hidden);
                    if next.gap[0] > context.policy.nothing_left {
                        let explained = fitted.score - next.score;
                        let more =
                            promising_more(library, &self.ranked, chosen, base - explained, &rivals, context.policy);
                        rivals.extend(more);
                    }
                    let other = or_rival(context, standing, &next, &mut rivals);
                    let other = context.journal.tried(&effect, "its rivals in its place", other).flatten();
                    (other.unwrap_or(next), rivals)
                }
                Source::Terms => (next, Vec::new()),
            };
            let (next, rivals) = match self.as_others(fitted, &next) {
                Some(others) => others,
                None => (next, vec![rivals]),
            };
            match enter(context, standing, next, rivals, self.source, "")? {
                Entry::Entered(entered) => return Ok(Some(*entered)),
                Entry::OnNoise => {}
                // What explains less than what is chance is chance as well.
                Entry::Chance => return Ok(None),
            }
        }
        Ok(None)
    }

    /// `next` with the laws that its last one is together where its numbers leave the range in which it is itself, if they explain as
    /// much; and the rivals of each: what they are together is none of one.
    fn as_others(&self, fitted: &Fitted, next: &Fitted) -> Option<(Fitted, Vec<Vec<EffectSpec>>)> {
        let Self { context, .. } = *self;
        let mut model = next.train.model.clone();
        let law = model.effects.pop()?;
        let others = far_away(&law).filter(|_| out_of_range(&law, &[], &model, &VERDICT))?;
        if others.iter().any(|other| model.effects.iter().any(|known| is_there(known, &other.id, other.cable))) {
            return None;
        }
        let rivals = vec![Vec::new(); others.len()];
        model.effects.extend(others);
        let others = context.fit(&model, next);
        let what = "as the laws that it is where it has left its range";
        let others = context.journal.tried(&law, what, others)?;
        let as_good = others.score < next.score + told_apart_from(next.score - fitted.score);
        if as_good && others.helps(fitted, context.policy) {
            return Some((others, rivals));
        }
        for law in &others.train.model.effects[others.train.model.effects.len() - rivals.len()..] {
            let change = others.score - fitted.score;
            context.journal.note(
                law,
                Outcome::Refused,
                change,
                "in the place of a law that has left its range it explains less, or not what was held out",
            );
        }
        None
    }

    /// Whether the best candidate, which gains so much, and the instruments that are asked for beside it explain more than those that
    /// are `better` without it: a length that drifts stands in for a law that lasts, and explains more than it by itself because it
    /// takes another instrument's part as well. Only what remembers can, and only a law that promises enough can be told from it.
    fn explains_more_beside_instruments(
        &self,
        standing: &Standing,
        better: &Fitted,
        gain: f64,
        explained: f64,
    ) -> Result<bool, FitError> {
        let Self { context, library, .. } = *self;
        let remembers = better.train.randomness.memory.len() > standing.fit.train.randomness.memory.len();
        if !remembers || gain < context.policy.promising * explained {
            return Ok(false);
        }
        let Some(effect) = self.first(&self.ranked).and_then(|first| first.effect(library)) else { return Ok(false) };
        let fitted = &standing.fit;
        let mut model = fitted.train.model.clone();
        model.effects.push(effect.clone());
        let trained = context.train(&model, &fitted.train, &context.evidence.train, context.policy.rounds, None);
        let next = trained.and_then(|trained| context.verified(trained, fitted));
        let Some(next) = context.journal.tried(&effect, "in the place of instruments", next) else { return Ok(false) };
        let beside = with_instruments(context, &next, 0.0)?;
        Ok(beside.is_some_and(|beside| beside.score < better.score - EVIDENCE))
    }

    /// The candidate that is fitted first of those `ranked`: of laws of the catalogue the simpler one of two good explanations.
    fn first<'b>(&self, ranked: &'b [Scored]) -> Option<&'b Scored> {
        match self.source {
            Source::Catalogue if !ranked.is_empty() => {
                Some(simplest(self.library, ranked, self.base, self.context.policy))
            }
            _ => ranked.first(),
        }
    }

    /// The candidates that were not refused yet, the best first.
    fn left(&self, refused: &[(&'static str, Option<usize>)]) -> Vec<Scored> {
        // Terms are all of one id, and are refused one by one.
        if self.source == Source::Terms {
            return self.ranked.iter().skip(refused.len()).cloned().collect();
        }
        let of = |scored: &&Scored| {
            let candidate = &self.library.candidates[scored.candidate];
            !refused.contains(&(candidate.id, candidate.cable))
        };
        self.ranked.iter().filter(of).cloned().collect()
    }

    /// `fitted` with the candidate that was chosen, as an `effect`, if it explains enough on training data and helps on
    /// held-out data. Why it does not is noted.
    fn fitted(&self, fitted: &Fitted, chosen: &Scored, effect: &EffectSpec) -> Option<Fitted> {
        let Self { context, library, base, .. } = *self;
        let refuse = |change: f64, reason: &str| {
            context.journal.note(effect, Outcome::Refused, change, reason);
            None
        };
        // Where something moves along, its signature does not say all.
        let alone = library.beside.is_empty() && facts(library.candidates[chosen.candidate].id).enters_as_it_is;
        if alone && self.foreseen(fitted, chosen) > fitted.holdout_score {
            return refuse(chosen.score - base, "it would not predict the held-out data better");
        }
        let mut model = fitted.train.model.clone();
        model.effects.push(effect.clone());
        let (trials, rounds) = (&context.evidence.train, context.policy.rounds);
        let trained = context.train(&model, &fitted.train, trials, rounds, None);
        let trained = context.journal.tried(effect, "it cannot be fitted", trained)?;
        let trained: Trained = better_optimum(context, trained);
        let sizes = Sizes::of(&model.parameters);
        if !trained.fit.model.effects.last().is_some_and(|effect| leaves_enough(effect, &sizes)) {
            return refuse(trained.score - fitted.score, "it would take most of what it corrects");
        }
        let explains = trained.score < fitted.score - EVIDENCE;
        if !explains {
            return refuse(trained.score - fitted.score, "too little evidence after refinement");
        }
        let next = context.verified(trained, fitted);
        let next = context.journal.tried(effect, "it does not go with the held-out data", next)?;
        if !next.helps(fitted, context.policy) {
            let contradicted = next.holdout_score > fitted.holdout_score + EVIDENCE;
            // Along a trajectory that has not settled nothing has a likelihood.
            let told = fitted.train.has_settled() && next.train.has_settled() && context.misses_while_training(fitted);
            if contradicted && told && context.explained(fitted, &next) > context.policy.most {
                let refined = next.train.model.effects.last().unwrap_or(effect);
                context.journal.contradicted(refined, next.score - fitted.score);
            }
            return refuse(next.score - fitted.score, NOT_HELD_OUT);
        }
        Some(next)
    }

    /// `-2 log L` of the held-out data with a candidate of these amplitudes, foreseen by its signature.
    fn foreseen(&self, fitted: &Fitted, scored: &Scored) -> f64 {
        let (fit, trials) = (&fitted.holdout, &self.context.evidence.holdout);
        let own = self.library.only(scored.candidate);
        let size = &self.sizes[scored.level..=scored.level];
        let normal = &normals(fit, trials, (&own.variations, &own.columns), size, None)[0];
        normal.minus_two_log_likelihood - normal.drop(&scored.amplitudes)
    }
}

/// Effects to be fitted together, and the rivals of each.
pub(crate) type Proposed = (Vec<EffectSpec>, Vec<Vec<EffectSpec>>);

/// What the best candidate promises to gain along a fit (fall of the criterion).
pub(crate) fn best_gain(context: &Context<'_>, fit: &Fit, signatures: &Signatures) -> f64 {
    let (base, ranked) = ranked(fit, &context.evidence.train, signatures, &ladder(&fit.randomness), context.penalty);
    gain(base, &ranked)
}

/// `-2 log L` without any candidate along a fit, and all of them, the best first.
fn ranked(
    fit: &Fit,
    trials: &[Trial],
    signatures: &Signatures,
    sizes: &[Randomness],
    penalty: Penalty,
) -> (f64, Vec<Scored>) {
    let levels = levels(fit, trials, signatures, sizes);
    (baseline(&levels), rank(&signatures.library, &levels, penalty))
}

/// What the best of those that are ranked gains.
fn gain(base: f64, ranked: &[Scored]) -> f64 {
    ranked.first().map_or(0.0, |best| (base - best.score).max(0.0))
}

/// The best candidate along a fit with its rivals, if it explains enough to be believed.
pub(crate) fn best_alone(
    fit: &Fit,
    trials: &[Trial],
    signatures: &Signatures,
    penalty: Penalty,
    policy: &Policy,
) -> Option<Proposed> {
    let library = &signatures.library;
    let (base, ranked) = ranked(fit, trials, signatures, &ladder(&fit.randomness), penalty);
    let best = ranked.first().filter(|best| base - best.score > EVIDENCE)?;
    Some((vec![best.effect(library)?], vec![rivals(library, &ranked, best, base, policy)]))
}

/// The candidate with the fewest columns among those nearly as good as the best.
fn simplest<'a>(library: &Library, ranked: &'a [Scored], base: f64, policy: &Policy) -> &'a Scored {
    let enough = policy.simpler * (base - ranked[0].score);
    let size = |s: &Scored| library.candidates[s.candidate].columns.len();
    ranked
        .iter()
        .filter(|s| base - s.score >= enough)
        .min_by(|a, b| size(a).cmp(&size(b)).then(a.score.total_cmp(&b.score)))
        .unwrap_or(&ranked[0])
}

/// The best candidates that are another explanation than the one chosen, for a full comparison: first of those that the
/// catalogue says are alike, whatever else explains more.
fn rivals(library: &Library, ranked: &[Scored], chosen: &Scored, base: f64, policy: &Policy) -> Vec<EffectSpec> {
    let own = &library.candidates[chosen.candidate];
    let share = |scored: &Scored| (base - scored.score) / (base - chosen.score);
    let mut out: Vec<EffectSpec> = Vec::new();
    for alike in [true, false] {
        for scored in ranked {
            let c = &library.candidates[scored.candidate];
            let known =
                (c.id == own.id && c.cable == own.cable) || out.iter().any(|e| e.id == c.id && e.cable == c.cable);
            if !known
                && out.len() < policy.most_rivals
                && is_alike(own, c) == alike
                && is_rival(own, c, share(scored), policy)
                && let Some(effect) = scored.effect(library)
            {
                out.push(effect);
            }
        }
    }
    out
}

/// Candidates beside the one chosen, which left a gap, and its `rivals`, that promise a better score than its fit came to. One that
/// explains all does so along another trajectory than that without it: what its signature misses may be more than what it gains.
fn promising_more(
    library: &Library,
    ranked: &[Scored],
    chosen: &Scored,
    score: f64,
    rivals: &[EffectSpec],
    policy: &Policy,
) -> Vec<EffectSpec> {
    let mut promising: Vec<&Scored> = ranked.iter().filter(|scored| scored.promise < score).collect();
    promising.sort_by(|a, b| a.promise.total_cmp(&b.promise));
    let own = &library.candidates[chosen.candidate];
    let mut out: Vec<EffectSpec> = Vec::new();
    for effect in promising.into_iter().filter_map(|scored| scored.effect(library)) {
        let known = |law: &EffectSpec| is_there(law, &effect.id, effect.cable);
        let is_own = own.id == effect.id && own.cable == effect.cable;
        if out.len() < policy.most_rivals && !is_own && !rivals.iter().chain(&out).any(known) {
            out.push(effect);
        }
    }
    out
}

/// Laws that a wrong trajectory may hide, where a `fit` with an explanation leaves so much of the gap that the trajectory is
/// wrong: friction on all winches, whose mean force is this (N). Forces that do next to nothing seem to explain more than
/// what eats them, until both are fitted in full. Where the recorded forces were found to have an error they are looked for
/// whatever is left: what friction takes from forces looks like one, and gaps count by it.
fn hidden(gap: f64, fit: &Fit, force: f64, policy: &Policy) -> impl Iterator<Item = EffectSpec> {
    let wrong = gap > policy.strong || fit.randomness.expected.is_some();
    let looked_for = wrong && !fit.model.effects.iter().any(is_friction);
    looked_for.then(|| on_all_winches(force)).into_iter().flatten()
}

/// Whether the catalogue says that two laws are alike; the winches of one machine are built alike.
fn is_alike(own: &Candidate, other: &Candidate) -> bool {
    let look_alikes = cdpr::effect::find(own.id).map_or(&[][..], |info| info.look_alikes);
    let alike = look_alikes.iter().any(|look_alike| look_alike.id == other.id) && other.cable == own.cable;
    alike || (other.id == own.id && other.cable.is_none())
}

/// Whether another candidate with a share of the gain of `own` is worth a full comparison.
pub(crate) fn is_rival(own: &Candidate, other: &Candidate, share: f64, policy: &Policy) -> bool {
    share > if is_alike(own, other) { policy.rival_alike } else { policy.rival }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::Channel;
    use crate::data::recording::record;
    use crate::hypothesis::candidates::{Situation, catalogue};
    use crate::instruments::expected::with_memory;
    use crate::strategy::candidates::signatures;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, evidence};
    use crate::strategy::policy::POLICY;

    /// The noise of a channel that is not measured is no number, and no number equals itself: all was weighed anew each time.
    #[test]
    fn sizes_are_known_again_though_channels_are_not_measured() {
        let fit = crate::data::recording::fitted(&[], &[record(&[], 5.0, 1)]);
        assert!(fit.randomness.noise.iter().any(|noise| noise.is_nan()));
        assert!(fit.randomness.same(&ladder(&fit.randomness)[0]));
        let larger = Randomness { force: 2.0 * fit.randomness.force, ..fit.randomness.clone() };
        assert!(!fit.randomness.same(&larger));
    }

    /// A cable that is softer by 4 %, a pose that wanders and lengths whose noise has a memory: lengths that drift stand in for all three
    /// and explain more than the cable alone, and nothing was missing.
    #[test]
    fn a_law_is_fitted_with_its_own_instruments_before_those_that_stand_in_for_it() {
        let hidden = EffectSpec::new("cable_stiffness", Some(2), &[-0.04]).expect("an effect");
        let recorded = |seed: u64| {
            let mut trial = record(std::slice::from_ref(&hidden), 60.0, seed);
            let last = trial.time[trial.len() - 1];
            let (mut white, mut colour) = (crate::data::recording::noise(4 * trial.len(), 500 + seed), [0.0; 4]);
            let lengths = trial.channels.iter().position(|c| *c == Channel::UnstretchedLength(0)).expect("lengths");
            for (row, time) in trial.measured.iter_mut().zip(&trial.time) {
                row[0] += 0.012 * (std::f64::consts::PI * time / last).sin();
                row[1] -= 0.012 * (0.5 * std::f64::consts::PI * time / last).sin();
                for (i, colour) in colour.iter_mut().enumerate() {
                    *colour = 0.8 * *colour + 1e-3 * white.next().unwrap_or(0.0);
                    row[lengths + i] += *colour;
                }
            }
            trial
        };
        let (train, holdout) = (vec![recorded(81), recorded(82)], vec![recorded(83)]);
        let noise = crate::filter::estimate::noise_of_data(&train);
        let evidence = Evidence::new(train, holdout, noise);
        let begun = Context::begin(&evidence, &Model::default(), 0..0, &|_, _| {});
        let (context, base) = begun.expect("a fit");
        let standing = Standing::new(&context, base);
        let signatures = crate::strategy::candidates::signatures(&context, &standing, &standing.fit, Source::Catalogue);
        let Round::Found(found) = round(&context, standing, &signatures, Source::Catalogue, 3).expect("a round") else {
            panic!("instruments alone")
        };
        let [effect] = &found.fit.train.model.effects[..] else { panic!("{:?}", found.fit.train.model.effects) };
        assert_eq!((effect.id.as_str(), effect.cable), ("cable_stiffness", Some(2)));
    }

    #[test]
    fn a_law_of_the_training_data_that_held_out_data_contradict_is_kept_in_mind() {
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        for mended in [true, false] {
            let of_training = evidence(std::slice::from_ref(&drag), 83);
            let holdout = if mended { evidence(&[], 85).holdout } else { of_training.holdout.clone() };
            let evidence = Evidence { holdout, ..of_training };
            let (context, standing) = begun(&evidence, &Model::default());
            let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
            let found = round(&context, standing, &signatures, Source::Catalogue, 1).expect("a round");
            assert_eq!(matches!(found, Round::Found(_)), !mended);
            let law = context.journal.only_trained();
            assert_eq!(law.as_ref().map(|law| law.id.as_str()), mended.then_some("platform_linear_drag"));
            assert!(law.is_none_or(|law| (law.values[0] - 60.0).abs() < 6.0));
        }
    }

    /// On logs of a real robot a gain of -92 % came first, then a limit that left a constant force, and friction not at all.
    #[test]
    fn friction_is_a_rival_of_what_leaves_a_wrong_trajectory() {
        let trials = [record(&[], 5.0, 1)];
        let with = |effects: &[EffectSpec]| crate::data::recording::fitted(effects, &trials);
        let rivals =
            |gap: f64, fit: &Fit| hidden(gap, fit, 100.0, &POLICY).map(|law| (law.id, law.cable)).collect::<Vec<_>>();
        let gain = EffectSpec::new("winch_force_gain", None, &[-0.05]).expect("an effect");
        let both = ["winch_coulomb_friction", "pulley_capstan_loss"].map(|id| (id.to_owned(), None));
        assert_eq!(rivals(POLICY.strong + 0.1, &with(std::slice::from_ref(&gain))), both);
        assert!(rivals(POLICY.strong, &with(std::slice::from_ref(&gain))).is_empty());
        let mut beside_an_error = with(std::slice::from_ref(&gain));
        beside_an_error.randomness.expected = Some(with_memory(0.05, 0.02));
        assert_eq!(rivals(1.0, &beside_an_error), both);
        let friction = EffectSpec::new("winch_coulomb_friction", Some(2), &[10.0]).expect("an effect");
        assert!(rivals(400.0, &with(&[gain, friction])).is_empty());
    }

    /// A wind and linear drag of a point on cables were an umbilical that was 240 m away, which was refused as uncertain.
    #[test]
    fn a_law_that_has_left_its_range_is_the_laws_that_it_is_together_there() {
        let wind = EffectSpec::new("steady_wind", None, &[40.0, -25.0, 0.0]).expect("an effect");
        let drag = EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect");
        let evidence = evidence(&[wind, drag], 88);
        let (context, standing) = begun(&evidence, &Model::default());
        let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
        let weighing = Weighing::new(&context, &standing.fit, &signatures, Source::Catalogue);
        let others = |x: f64, y: f64| {
            let umbilical = EffectSpec::new("umbilical", None, &[0.01, 60.0, x, y]).expect("an effect");
            let mut next = standing.fit.clone();
            next.train.model.effects.push(umbilical);
            let found = weighing.as_others(&standing.fit, &next);
            found.map_or(Vec::new(), |(others, _)| others.train.model.effects.into_iter().map(|law| law.id).collect())
        };
        assert_eq!(others(4e3, -2.5e3), ["steady_wind", "platform_linear_drag"]);
        assert!(others(40.0, -25.0).is_empty());
    }

    /// Drag was not compared with viscous friction where three kinds of inertia explained more at first sight.
    #[test]
    fn look_alikes_of_the_catalogue_are_rivals_before_what_explains_more() {
        let library = catalogue(&Model::default(), &Situation::of(&[record(&[], 5.0, 1)]));
        let scored = |id: &str, cable: Option<usize>, score: f64| {
            let found = library.candidates.iter().position(|c| c.id == id && c.cable == cable);
            let candidate = found.unwrap_or_else(|| panic!("{id} is a candidate"));
            Scored {
                candidate,
                score,
                promise: score,
                amplitudes: vec![1.0; library.candidates[candidate].columns.len()],
                level: 0,
            }
        };
        let chosen = scored("winch_viscous_friction", None, -100.0);
        let inertia = (1..=4).map(|cable| scored("winch_drum_inertia", Some(cable), -95.0));
        let mut ranked = vec![chosen.clone()];
        ranked.extend(inertia);
        ranked.push(scored("platform_linear_drag", None, -60.0));
        // Too little for a look-alike, and for any other.
        ranked.push(scored("cable_damping", None, -40.0));
        ranked.push(scored("platform_mass", None, -70.0));
        let ids: Vec<(String, Option<usize>)> = rivals(&library, &ranked, &chosen, 0.0, &POLICY)
            .into_iter()
            .map(|effect| (effect.id, effect.cable))
            .collect();
        let inertia = |cable| ("winch_drum_inertia".to_owned(), Some(cable));
        assert_eq!(ids, [("platform_linear_drag".to_owned(), None), inertia(1), inertia(2)]);
    }

    /// A wind of 2.6 N gained 2527, and the gain of a winch by 1.5 %, which had moved the platform far, 752 by its signature: fitted, it
    /// gains 4746.
    #[test]
    fn what_promises_more_than_a_law_that_left_a_gap_came_to_is_fitted_as_well() {
        let library = catalogue(&Model::default(), &Situation::of(&[record(&[], 5.0, 1)]));
        let scored = |id: &str, cable: Option<usize>, [score, promise]: [f64; 2]| {
            let found = library.candidates.iter().position(|c| c.id == id && c.cable == cable);
            let candidate = found.unwrap_or_else(|| panic!("{id} is a candidate"));
            let amplitudes = vec![1.0; library.candidates[candidate].columns.len()];
            Scored { candidate, score, promise, amplitudes, level: 0 }
        };
        let wind = scored("steady_wind", None, [-2519.0, -2600.0]);
        let gain = scored("winch_force_gain", Some(4), [-752.0, -3132.0]);
        let bias = scored("winch_force_bias", Some(4), [-700.0, -2400.0]);
        let ranked = [wind.clone(), gain, bias];
        let more = |score: f64, rivals: &[EffectSpec]| {
            let more = promising_more(&library, &ranked, &wind, score, rivals, &POLICY);
            more.into_iter().map(|law| (law.id, law.cable)).collect::<Vec<_>>()
        };
        let gain = ("winch_force_gain".to_owned(), Some(4));
        assert_eq!(more(-2527.0, &[]), std::slice::from_ref(&gain));
        assert_eq!(more(-2300.0, &[]), [gain, ("winch_force_bias".to_owned(), Some(4))]);
        assert!(more(-3200.0, &[]).is_empty());
        let known = EffectSpec::new("winch_force_gain", Some(4), &[0.01]).expect("an effect");
        assert!(more(-2527.0, &[known]).is_empty());
    }
}

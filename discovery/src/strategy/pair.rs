//! Two effects at once: the pair of candidates that together explain the innovations best.
//!
//! One effect after the other is misled where two are missing: the first one found may be neither, but what does some of
//! both. Where the first effect leaves a gap, or none was taken, all pairs of the best candidates are therefore weighed
//! together, on the signatures along the model as given. If the best pair leaves nothing to the latent forces, it is fitted
//! in full, and taken if nothing is left to explain.

use cdpr::effect::EffectSpec;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::candidates::{Candidate, Library};
use crate::hypothesis::friction::is_friction_law;
use crate::hypothesis::stream::normals;
use crate::strategy::context::Context;
use crate::strategy::entrance::enter;
use crate::strategy::policy::Policy;
use crate::strategy::round::{Proposed, is_rival};
use crate::strategy::standing::Standing;
use crate::weigh::criterion::{EVIDENCE, Penalty};
use crate::weigh::regression::{Level, Scored, ladder, rank, subset};
use crate::weigh::signatures::{Signatures, Source, levels};

/// Two candidates, solved together.
struct Pair {
    members: [Scored; 2],
    score: f64,
}

/// The best pair of effects from the model as given on, if it explains all that what stands does not; in place of that.
pub(crate) fn pair(context: &Context<'_>, standing: Standing, signatures: &Signatures) -> Result<Standing, FitError> {
    (context.progress)("weighing pairs", 0.25);
    let (base, found) = (&standing.base, &standing.fit);
    let (fit, trials) = (&base.train, &context.evidence.train);
    let Some((pair, rivals)) = best_pair(fit, trials, signatures, context.penalty, context.policy) else {
        return Ok(standing);
    };
    let beside = |other: &EffectSpec| format!("as one of a pair with {}", other.id);
    let mut model = fit.model.clone();
    model.effects.extend(pair.clone());
    let trained = context.train(&model, fit, trials, context.policy.rounds, None);
    let Some(trained) = context.journal.tried(&pair[0], &beside(&pair[1]), trained) else { return Ok(standing) };
    if trained.score >= found.score - EVIDENCE {
        return Ok(standing);
    }
    let next = context.verified(trained, base);
    let Some(next) = context.journal.tried(&pair[0], &beside(&pair[1]), next) else { return Ok(standing) };
    if next.gap[0] > context.policy.nothing_left || !next.helps(found, context.policy) {
        return Ok(standing);
    }
    let entered = enter(context, &standing.anew(), next, rivals, Source::Catalogue, "as one of a pair")?.entered();
    Ok(entered.unwrap_or(standing))
}

/// The best pair of candidates along a fit, each with its rivals, if it leaves nothing to the latent forces: else it only does
/// some of what is missing.
pub(crate) fn best_pair(
    fit: &Fit,
    trials: &[Trial],
    signatures: &Signatures,
    penalty: Penalty,
    policy: &Policy,
) -> Option<Proposed> {
    let library = &signatures.library;
    let pairs = weigh_pairs(fit, trials, signatures, penalty, policy);
    let best = pairs.first().filter(|pair| !ladder(&fit.randomness)[pair.members[0].level].has_latents())?;
    let effects = best.members.iter().map(|member| member.effect(library)).collect::<Option<_>>()?;
    Some((effects, (0..2).map(|k| rivals(library, &pairs, k, policy)).collect()))
}

/// All pairs of the best candidates, the best first.
fn weigh_pairs(fit: &Fit, trials: &[Trial], signatures: &Signatures, penalty: Penalty, policy: &Policy) -> Vec<Pair> {
    let library = &signatures.library;
    let sizes = ladder(&fit.randomness);
    let ranked = rank(library, &levels(fit, trials, signatures, &sizes[..1]), Penalty::NONE);
    // Of each effect on each cable the best variant.
    let mut best: Vec<usize> = Vec::new();
    for scored in ranked {
        let candidate = &library.candidates[scored.candidate];
        let same = |at: &usize| {
            let other = &library.candidates[*at];
            (other.id, other.cable) == (candidate.id, candidate.cable)
        };
        if best.len() < policy.paired && !best.iter().any(same) {
            best.push(scored.candidate);
        }
    }
    let mut columns: Vec<usize> = best.iter().flat_map(|c| library.candidates[*c].columns.clone()).collect();
    columns.sort_unstable();
    columns.dedup();
    let reduced = library.of_columns(&columns);
    let joint = normals(fit, trials, (&reduced.variations, &reduced.columns), &sizes, None);
    let joint: Vec<Level> = joint.into_iter().map(|normal| Level { normal }).collect();
    let place = |c: &usize| columns.binary_search(c).unwrap_or_default();
    let all: Vec<(usize, usize)> = (0..best.len()).flat_map(|b| (0..b).map(move |a| (a, b))).collect();
    let mut pairs: Vec<Pair> = all
        .into_par_iter()
        .filter_map(|(a, b)| {
            let members = [best[a], best[b]];
            let [one, other] = members.map(|at| &library.candidates[at]);
            if exclude_each_other(one, other) {
                return None;
            }
            let own: Vec<usize> = one.columns.iter().chain(&other.columns).map(place).collect();
            solved(&joint, &own, members, [one, other], penalty)
        })
        .collect();
    pairs.sort_by(|a, b| a.score.total_cmp(&b.score));
    pairs
}

/// A pair at the size of latents at which it does best.
fn solved(
    levels: &[Level],
    own: &[usize],
    members: [usize; 2],
    candidates: [&Candidate; 2],
    penalty: Penalty,
) -> Option<Pair> {
    let cost: f64 = candidates.iter().map(|c| penalty.of(c.columns.len() + c.tried)).sum();
    let cut = candidates[0].columns.len();
    let mut best: Option<Pair> = None;
    for (at_level, level) in levels.iter().enumerate() {
        let Some(solved) = subset(&level.normal, own) else { continue };
        let score = level.normal.minus_two_log_likelihood - solved.drop + cost;
        let (first, second) = solved.amplitudes.split_at(cut);
        let possible = candidates[0].effect(first).is_some() && candidates[1].effect(second).is_some();
        if possible && best.as_ref().is_none_or(|b| score < b.score) {
            let member = |k: usize, amplitudes: &[f64]| Scored {
                candidate: members[k],
                score,
                promise: score,
                amplitudes: amplitudes.to_vec(),
                level: at_level,
            };
            best = Some(Pair { members: [member(0, first), member(1, second)], score });
        }
    }
    best
}

/// Whether two candidates say the same of the same place: an effect on a cable and on all, two laws of friction.
fn exclude_each_other(a: &Candidate, b: &Candidate) -> bool {
    let together = a.cable.is_none() || b.cable.is_none() || a.cable == b.cable;
    together && (a.id == b.id || is_friction_law(a.id) && is_friction_law(b.id))
}

/// What could stand in place of a member of the best pair, beside the other one.
fn rivals(library: &Library, pairs: &[Pair], member: usize, policy: &Policy) -> Vec<EffectSpec> {
    let own = &pairs[0].members[member];
    let beside = pairs[0].members[1 - member].candidate;
    let others = pairs.iter().skip(1).filter_map(|pair| {
        let at = pair.members.iter().position(|m| m.candidate == beside)?;
        Some((&pair.members[1 - at], pair.score))
    });
    // What stands beside the other one and explains least is as good as nothing.
    let worst = others.clone().map(|(_, score)| score).fold(pairs[0].score, f64::max);
    let gain = worst - pairs[0].score;
    let own = &library.candidates[own.candidate];
    let wanted = others
        .filter(|(scored, score)| is_rival(own, &library.candidates[scored.candidate], (worst - score) / gain, policy));
    wanted.filter_map(|(scored, _)| scored.effect(library)).take(policy.most_rivals).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::hypothesis::candidates::{Situation, catalogue};
    use crate::strategy::candidates::signatures;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};
    use crate::strategy::policy::POLICY;

    #[test]
    fn both_effects_of_a_pair_are_found_with_their_sizes() {
        let hidden = [
            EffectSpec::new("winch_force_gain", Some(1), &[0.01]).unwrap(),
            EffectSpec::new("platform_linear_drag", None, &[60.0]).unwrap(),
        ];
        let trials = [record(&hidden, 40.0, 7), record(&hidden, 40.0, 8)];
        let fit = fitted(&[], &trials);
        let library = catalogue(&fit.model, &Situation::of(&trials));
        let signatures = Signatures::new(library);
        let pairs = weigh_pairs(&fit, &trials, &signatures, Penalty::new(5000), &POLICY);
        let found = [0, 1].map(|k| pairs[0].members[k].effect(&signatures.library).unwrap());
        for effect in &hidden {
            let same = found.iter().find(|f| (&f.id, f.cable) == (&effect.id, effect.cable));
            let size = same.map(|f| f.values[0] / effect.values[0]);
            assert!(size.is_some_and(|size| (size - 1.0).abs() < 0.1), "{found:?}");
        }
        // It explains all: at the smallest latent forces.
        assert_eq!(pairs[0].members[0].level, ladder(&fit.randomness).len() - 1);
    }

    #[test]
    fn a_pair_takes_the_place_of_what_did_some_of_both() {
        let hidden = [effect("winch_force_gain", Some(1), &[0.01]), effect("platform_linear_drag", None, &[60.0])];
        let evidence = evidence(&hidden, 89);
        let (context, standing) = begun(&evidence, &cdpr::model_file::Model::default());
        let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
        let half = with(&context, standing, vec![(hidden[0].clone(), Vec::new())]);
        let paired = pair(&context, half, &signatures).expect("a fit");
        let mut found = names(&context, &paired);
        found.sort();
        assert_eq!(found, [("platform_linear_drag".to_owned(), None), ("winch_force_gain".to_owned(), Some(1))]);
        assert!(paired.accepted.iter().all(|accepted| accepted.without.is_some()));
    }

    #[test]
    fn the_same_place_is_not_explained_twice() {
        let trials = [record(&[], 20.0, 9)];
        let library = catalogue(&cdpr::model_file::Model::default(), &Situation::of(&trials));
        let find = |id: &str, cable: Option<usize>| {
            library.candidates.iter().find(|c| c.id == id && c.cable == cable).unwrap()
        };
        let gain = find("winch_force_gain", Some(1));
        assert!(exclude_each_other(gain, find("winch_force_gain", None)));
        assert!(!exclude_each_other(gain, find("winch_force_gain", Some(2))));
        let friction = find("winch_coulomb_friction", Some(1));
        assert!(exclude_each_other(friction, find("pulley_capstan_loss", None)));
        assert!(!exclude_each_other(friction, gain));
    }
}

//! What recording does, where that explains most of what is left, or more than anything else does: then it is undone.

use std::sync::Arc;

use cdpr::model_file::Model;

use crate::data::{Trial, Undone};
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::instruments::Sizing;
use crate::instruments::undoing::{Did, errors};
use crate::journal::Outcome;
use crate::report;
use crate::strategy::context::{Context, share};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::instruments::beside_those_of;
use crate::strategy::late_winches::LATE;
use crate::strategy::standing::{Accepted, Standing};
use crate::verdict::{POLICY as VERDICT, share_taken};
use crate::weigh::criterion::{EVIDENCE, told_apart_from};

/// What else may explain what is left.
pub(crate) struct Others<'a> {
    /// What the best effect gains.
    pub(crate) effect: &'a dyn Fn() -> f64,
    /// Whether the instruments gain more than so much.
    pub(crate) instruments: &'a dyn Fn(f64) -> Result<bool, FitError>,
}

impl Others<'_> {
    /// Where whatever explains no more than most is better explained by something else.
    pub(crate) const MORE: Self = Self { effect: &|| f64::INFINITY, instruments: &|_| Ok(true) };

    /// Whether any gains as much, where the best effect gains so much.
    fn gain(&self, by_effect: f64, gain: f64) -> Result<bool, FitError> {
        Ok(by_effect >= gain || (self.instruments)(gain)?)
    }
}

/// What stands; where something that recording does explains most of what it leaves, or more than all `others`, the search begins again
/// with recordings as they were before.
pub(crate) fn undoing(context: &Context<'_>, standing: Standing, others: &Others<'_>) -> Result<Standing, FitError> {
    let to_undo = what_recording_does(context, &standing.fit, others)?.map(|better| better.undone);
    Ok(Standing { to_undo, ..standing })
}

/// What recording does, and the score of what stands where that is undone.
pub(crate) struct Better {
    pub(crate) undone: Undone,
    pub(crate) score: f64,
}

/// What recording does beside `fitted`. Late forces, if they explain most of what is left or no `others` gain as much: friction looks like
/// these to first order, and then gains more. A slow clock, if no others gain as much and it takes away most of the gap: mass and inertia look
/// like it, and where much else is missing whatever makes all slower explains some of that.
pub(crate) fn what_recording_does(
    context: &Context<'_>,
    fitted: &Fitted,
    others: &Others<'_>,
) -> Result<Option<Better>, FitError> {
    let evidence = context.evidence;
    let undone = evidence.train.first().map_or(0, |trial| trial.undone.len());
    if undone >= context.policy.most_undone {
        return Ok(None);
    }
    let left = context.something_left(&fitted.train, &evidence.train);
    let by_effect = (others.effect)();
    // Where noise is all that is left a law may make the data likelier still, and so may a clock.
    let law_gains = by_effect > 0.0 && by_effect.is_finite();
    if !left && !law_gains {
        return Ok(None);
    }
    let sizing = Sizing::new(&evidence.train, &evidence.noise, context.penalty);
    let may_be_late = left && !evidence.forces_in_time;
    let late = if may_be_late { sizing.recorded_late(&fitted.train, context.free_from) } else { Ok(None) };
    let late = context.journal.or_remark("Recorded forces that are late do not go with the data", late)?.flatten();
    let slow = sizing.slow_clock(&fitted.train, context.free_from, by_effect - told_apart_from(by_effect));
    let slow = context.journal.or_remark("A clock that is slow does not go with the data", slow)?.flatten();
    let scored = |did: Did| (context.score(&did.fit, &did.trials) + did.cost, did);
    let mut all: Vec<(f64, Did)> = [late, slow].into_iter().flatten().map(scored).collect();
    all.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    for (score, did) in all {
        let gain = fitted.score - score;
        let stands = match did.undone {
            Undone::Forces(_) => {
                let most = share(fitted.score, &did.fit, score, &did.trials) >= context.policy.most;
                (most || !others.gain(by_effect, gain)?) && held_out(context, fitted, &did)?.is_some()
            }
            Undone::Clock(slow) => {
                let apart = told_apart_from(gain);
                let near = !others.gain(by_effect, gain + apart)?
                    && held_out(context, fitted, &did)?
                        .is_some_and(|gap| share_taken(fitted.gap[0], gap, &VERDICT) >= context.policy.most);
                let beyond = near && !others.gain(by_effect, gain - apart)?;
                if near && !beyond {
                    context.journal.remark(not_told(slow));
                }
                beyond
            }
        };
        if stands {
            return Ok(Some(Better { undone: did.undone, score }));
        }
    }
    Ok(None)
}

/// What stands; where a recorder's lateness was undone before its laws were found, and beside these the data go as well with winch forces as
/// they were recorded, the search goes on with those.
///
/// Friction that has not its form yet looks like late forces, and once it has, a dead time of the winches takes back what was undone.
pub(crate) fn undone_in_vain(context: &Context<'_>, standing: Standing) -> Result<Standing, FitError> {
    let Some(recorded) = &context.evidence.as_recorded else { return Ok(standing) };
    let (fit, trials) = (standing.fit.clone(), &context.evidence.train);
    let recorder = Undone::recorder(trials);
    let [error, ..] = errors(&fit.train, trials, context.free_from);
    let for_sure = error.is_some_and(|error| (recorder.delay / error).powi(2) >= context.policy.certain);
    let undoing_costs = context.penalty.of_parameters(recorder.moments());
    let as_recorded = |model: &Model| -> Result<Option<Trained>, FitError> {
        let trained = context.train(model, &fit.train, &recorded.train, context.policy.rounds, None);
        let what = "Beside the laws that were found, winch forces as they were recorded do not go with the data";
        let trained = context.journal.or_remark(what, trained)?;
        Ok(trained.filter(|trained| trained.score <= fit.score + undoing_costs))
    };
    // What takes it back is far from what it is with forces as recorded, none, and is asked to be, however certain the lateness is.
    if let Some(k) = standing.found(context).iter().position(|law| LATE.contains(&law.id.as_str())) {
        let (model, law) = standing.without(context, k);
        if let Some(trained) = as_recorded(&model)? {
            context.journal.note(&law, Outcome::Removed, trained.score - fit.score, "it took back what was undone");
            let next = Fitted { train: trained.fit, score: trained.score, ..fit.clone() };
            let mut standing = standing.changed(next);
            standing.accepted.remove(k);
            return Ok(Standing { undone_in_vain: true, ..standing });
        }
    }
    if standing.accepted.is_empty() || for_sure {
        return Ok(standing);
    }
    let undone_in_vain = as_recorded(&fit.train.model)?.is_some();
    Ok(Standing { undone_in_vain, ..standing })
}

/// The laws that another search found, on these recordings.
pub(crate) fn with_laws(context: &Context<'_>, standing: Standing, laws: &Standing) -> Result<Standing, FitError> {
    let fit = context.fit(&laws.fit.train.model, &laws.fit)?;
    let base = beside_those_of(context, &fit, &standing.base)?;
    let anew = |accepted: &Accepted| Accepted::new(accepted.rivals.clone(), accepted.delta_bic, accepted.null_test);
    let accepted = laws.accepted.iter().map(anew).collect();
    Ok(Standing { fit, base: Arc::new(base), accepted, ..standing })
}

/// What is said where a law is believed before a clock that is slow by this share, though the data do not tell the two apart.
fn not_told(slow: f64) -> String {
    let way = if slow > 0.0 { "slow" } else { "fast" };
    let share = report::significant(100.0 * slow.abs(), 2);
    format!(
        "A clock of the time stamps that is {way} by {share} % would explain about as much as what was taken up in its place: comparing it with \
         another clock tells."
    )
}

/// The gap that is left on held-out data where what recording does is undone there as well; none where that makes them no likelier.
fn held_out(context: &Context<'_>, fitted: &Fitted, did: &Did) -> Result<Option<f64>, FitError> {
    let Did { undone, fit, .. } = did;
    let held: Vec<Trial> = context.evidence.holdout.iter().map(|trial| trial.before(*undone)).collect();
    let settled = Fit::new(&fit.model, &held, &fit.randomness, Some(&fitted.holdout)).and_then(|mut held_out| {
        held_out.settle(&held, context.policy.held_out_moves)?;
        Ok(held_out)
    });
    let settled =
        context.journal.or_remark("What recording seems to do does not go with the held-out data", settled)?;
    let likely = fitted.holdout_score - context.policy.helps * EVIDENCE;
    let likelier = settled.filter(|fit| fit.minus_two_log_likelihood(&held, &did.fit.randomness) < likely);
    Ok(likelier.map(|fit| context.gaps(&fit, &held, fitted.instruments.as_ref()).0[0]))
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::Recorder;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;
    use crate::strategy::candidates::signatures;
    use crate::strategy::fitted::Evidence;
    use crate::strategy::fixture::{begun, names, with};
    use crate::strategy::policy::{POLICY, Policy};
    use crate::strategy::rounds::undo_before_more;
    use crate::strategy::settle::settle;
    use crate::weigh::signatures::Source;

    /// Forces two samples late, by themselves, and ones in time where friction is missing, or with an error that is as slow as the motion.
    #[test]
    fn forces_are_late_where_that_explains_most_of_what_is_left() {
        let friction = EffectSpec::new("winch_coulomb_friction", None, &[100.0, 0.01]).expect("an effect");
        let recorded = |hidden: &[EffectSpec], late: usize, error: f64, seed: u64| {
            let mut trial = record(hidden, 40.0, seed);
            let inputs = trial.inputs.clone();
            trial.inputs[late..].copy_from_slice(&inputs[..inputs.len() - late]);
            for winch in 0..4 {
                let mut wander = 0.0;
                for (inputs, white) in trial.inputs.iter_mut().zip(noise(inputs.len(), 10 * seed + winch)) {
                    wander = 0.7 * wander + 0.7 * error * white;
                    inputs.winch_force[winch as usize] += wander;
                }
            }
            trial
        };
        for (hidden, late, error) in [(&[][..], 2, 0.0), (&[friction][..], 0, 0.0), (&[], 0, 30.0)] {
            let [first, second, held] = [31, 32, 33].map(|seed| recorded(hidden, late, error, seed));
            let (train, holdout) = (vec![first, second], vec![held]);
            let noise = noise_of_data(&train);
            let evidence = Evidence::new(train, holdout, noise);
            let (context, standing) = begun(&evidence, &Model::default());
            let standing = undoing(&context, standing, &Others::MORE).expect("a fit");
            assert_eq!(standing.begins_anew(), late > 0, "{:?} {error}", standing.to_undo);
            let expected = late as f64 * evidence.train[0].interval();
            let delay = match standing.to_undo {
                Some(Undone::Forces(recorder)) => recorder.delay,
                Some(Undone::Clock(slow)) => panic!("{slow}"),
                None => 0.0,
            };
            assert!((delay - expected).abs() <= 0.05 * expected, "{delay} {expected} {error}");
        }
    }

    /// Friction on all winches beside a geometry that was off looked like forces 3.7 ms late, which were undone; with its form a dead time of
    /// 3.6 ms took that back, and was named.
    #[test]
    fn a_lateness_that_a_law_takes_back_was_undone_in_vain() {
        let friction = EffectSpec::new("winch_coulomb_friction", None, &[100.0, 0.01]).expect("an effect");
        let dead_time = |time: f64| EffectSpec::new("winch_delay", None, &[time]).expect("an effect");
        // Also where its error says that it is certain.
        static CERTAIN: Policy = Policy { certain: 0.0, ..POLICY };
        for (late, policy) in [(0, &POLICY), (0, &CERTAIN), (2, &POLICY)] {
            let [first, second, held] = [31, 32, 33].map(|seed| {
                let mut trial = record(std::slice::from_ref(&friction), 40.0, seed);
                let inputs = trial.inputs.clone();
                trial.inputs[late..].copy_from_slice(&inputs[..inputs.len() - late]);
                trial
            });
            let undone = if late > 0 { late as f64 * first.interval() } else { 4e-3 };
            let (train, holdout) = (vec![first, second], vec![held]);
            let noise = noise_of_data(&train);
            let recorder = Recorder { delay: undone, variance: 0.0 };
            let evidence = Evidence::new(train, holdout, noise).before(Undone::Forces(recorder));
            let (mut context, standing) = begun(&evidence, &Model::default());
            context.policy = policy;
            let mut laws = vec![(friction.clone(), Vec::new())];
            laws.extend((late == 0).then(|| (dead_time(undone), Vec::new())));
            let standing = with(&context, standing, laws);
            let standing = undone_in_vain(&context, standing).expect("a fit");
            assert_eq!((standing.undone_in_vain, standing.begins_anew()), (late == 0, late == 0));
            // What took it back is gone.
            assert_eq!(names(&context, &standing), [("winch_coulomb_friction".to_owned(), None)]);
            if late > 0 {
                continue;
            }
            let recorded = evidence.as_recorded.as_deref().expect("forces as recorded");
            let (context, begun) = begun(recorded, &Model::default());
            let going_on = with_laws(&context, begun, &standing).expect("a fit");
            let settled = settle(&context, going_on).expect("a fit");
            assert_eq!(names(&context, &settled), [("winch_coulomb_friction".to_owned(), None)]);
        }
    }

    /// Recordings whose clock is slow by a share, with `hidden` effects.
    fn slow_by(share: f64, hidden: &[EffectSpec]) -> Evidence {
        let recorded = |seed: u64| {
            let mut trial = record(hidden, 40.0, seed);
            trial.time.iter_mut().for_each(|time| *time /= 1.0 + share);
            trial
        };
        let (train, holdout) = (vec![recorded(31), recorded(32)], vec![recorded(33)]);
        let noise = noise_of_data(&train);
        Evidence::new(train, holdout, noise)
    }

    /// Stamps made at a rate that is not quite that of the recordings came out as masses of platform and cables, both named.
    #[test]
    fn a_clock_is_slow_where_that_explains_more_than_masses_do() {
        let mass = EffectSpec::new("platform_mass", None, &[50.0]).expect("an effect");
        for (hidden, slow) in [(&[][..], 5e-3), (&[mass][..], 0.0)] {
            let evidence = slow_by(slow, hidden);
            let (context, standing) = begun(&evidence, &Model::default());
            let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
            let undone = undo_before_more(&context, standing, &signatures).expect("a fit");
            match undone.to_undo {
                Some(Undone::Clock(found)) => assert!((found / slow - 1.0).abs() < 0.2, "{found} {slow}"),
                None => assert_eq!(slow, 0.0),
                forces @ Some(_) => panic!("{forces:?}"),
            }
        }
    }

    /// An axial mass of 0.6 g/m was named, and no clock was asked for.
    #[test]
    fn a_clock_is_asked_for_where_a_law_is_though_nothing_but_noise_is_left() {
        let share = 2e-4;
        let evidence = slow_by(share, &[]);
        let (context, standing) = begun(&evidence, &Model::default());
        assert!(!context.something_left(&standing.fit.train, &evidence.train));
        let of = |effect: f64| {
            let others = Others { effect: &|| effect, instruments: &|_| Ok(false) };
            what_recording_does(&context, &standing.fit, &others).expect("a fit").map(|better| better.undone)
        };
        assert_eq!(of(0.0), None);
        let Some(Undone::Clock(slow)) = of(1e-3) else { panic!("no clock") };
        assert!((slow / share - 1.0).abs() < 0.3, "{slow}");
    }

    /// It went unmentioned, and a mass was named that was not there.
    #[test]
    fn a_clock_that_is_not_told_from_a_law_is_mentioned() {
        let evidence = slow_by(5e-3, &[]);
        let with_effect = |effect: f64| {
            let (context, standing) = begun(&evidence, &Model::default());
            let others = Others { effect: &|| effect, instruments: &|_| Ok(false) };
            let found = what_recording_does(&context, &standing.fit, &others).expect("a fit");
            (found.map(|better| standing.fit.score - better.score), context.journal.written().remarks)
        };
        let (gain, remarks) = with_effect(0.0);
        let gain = gain.expect("a slow clock");
        let apart = told_apart_from(gain);
        assert!(remarks.is_empty(), "{remarks:?}");
        for (effect, stands, mentioned) in
            [(gain - 2.0 * apart, true, false), (gain - 0.5 * apart, false, true), (gain + 2.0 * apart, false, false)]
        {
            let (found, remarks) = with_effect(effect);
            assert_eq!((found.is_some(), !remarks.is_empty()), (stands, mentioned), "{effect} {gain}: {remarks:?}");
        }
    }
}

//! Effects of the catalogue, one after the other, as long as they earn their place.

use crate::filter::error::FitError;
use crate::strategy::candidates::signatures;
use crate::strategy::context::Context;
use crate::strategy::each_cable::on_each_cable;
use crate::strategy::every_cable::on_every_cable;
use crate::strategy::form::form_if;
use crate::strategy::geometry::{instead_of_drifts, survey_gains};
use crate::strategy::given_sizes::given_before_more;
use crate::strategy::instruments::{beside_instruments, better_instruments};
use crate::strategy::one_friction::one_friction;
use crate::strategy::onset::onset;
use crate::strategy::prune::prune;
use crate::strategy::round::{Round, best_gain, round};
use crate::strategy::standing::Standing;
use crate::strategy::undoing::{Others, undoing};
use crate::weigh::signatures::{Signatures, Source};

/// What stands with one more effect of the catalogue, if one earns its place.
pub(crate) fn one_more(context: &Context<'_>, standing: Standing, signatures: &Signatures) -> Result<Round, FitError> {
    round(context, standing, signatures, Source::Catalogue, context.policy.most_refusals)
}

/// What stands; where something that recording does explains more of what it leaves than one more effect of the catalogue or what the
/// instruments ask for, that is to be undone first.
pub(crate) fn undo_before_more(
    context: &Context<'_>,
    standing: Standing,
    signatures: &Signatures,
) -> Result<Standing, FitError> {
    let fitted = standing.fit.clone();
    let effect = || best_gain(context, &fitted.train, signatures);
    let instruments = |gain| Ok(better_instruments(context, &fitted, gain)?.is_some());
    undoing(context, standing, &Others { effect: &effect, instruments: &instruments })
}

/// Effects of the catalogue, one after the other, as long as they earn their place, and after each the form of friction, where that
/// explains most of what is left; what of it explains less once no more effects do.
///
/// What the instruments have beside white noise is taken up where it explains more than the next effect. Where several laws stand
/// and errors of the survey promise to explain what they leave, and more of it than one more law or the instruments, no more are
/// looked for, but for one that makes fewer of them: errors of one anchor are found after what stood for each of their directions.
pub(crate) fn rounds(context: &Context<'_>, mut standing: Standing) -> Result<Standing, FitError> {
    standing = on_each_cable(context, standing, context.policy.most);
    for _ in 0..context.policy.most_rounds {
        if standing.count() >= context.policy.most_effects {
            return Ok(standing);
        }
        context.time.keep(&standing);
        let score = standing.fit.score;
        let signatures = signatures(context, &standing, &standing.fit, Source::Catalogue);
        standing = given_before_more(context, undo_before_more(context, standing, &signatures)?, &signatures)?;
        if standing.begins_anew() {
            return Ok(standing);
        }
        if standing.count() >= context.policy.several_laws
            && let Some(gain) = survey_gains(context, &standing)?
            && gain > best_gain(context, &standing.fit.train, &signatures)
        {
            let Some(better) = better_instruments(context, &standing.fit, gain)? else {
                match fewer_with_one_more(context, &standing)? {
                    Some(fewer) => standing = fewer,
                    None => return Ok(Standing { geometry_is_off: true, ..standing }),
                }
                continue;
            };
            standing = beside_instruments(context, standing, better)?;
            if standing.begins_anew() {
                return Ok(standing);
            }
            continue;
        }
        let found = match one_more(context, standing, &signatures)? {
            Round::Instruments(same, better) => {
                if instead_of_drifts(context, &better)? {
                    return Ok(Standing { geometry_is_off: true, ..same });
                }
                standing = beside_instruments(context, same, *better)?;
                if standing.begins_anew() {
                    return Ok(standing);
                }
                continue;
            }
            Round::Found(next) => {
                context.time.keep(&next);
                // As long as more is found, times at which an effect acts may only stand for what is not found yet.
                standing = onset(context, one_friction(context, on_every_cable(context, next)), context.policy.most);
                true
            }
            Round::Nothing(same) => {
                standing = same;
                false
            }
        };
        let share = if found { context.policy.most } else { f64::NEG_INFINITY };
        standing = on_each_cable(context, form_if(context, standing, share), share);
        if !found && standing.fit.score == score {
            return Ok(standing);
        }
    }
    context.journal.remark(format!(
        "Laws came in and were made one with others again for {} rounds: there the search for more was ended.",
        context.policy.most_rounds
    ));
    Ok(standing)
}

/// What stands with one more law, and what the instruments ask for before it, if it does what some of those that stand did, so that they
/// are no longer so many.
fn fewer_with_one_more(context: &Context<'_>, standing: &Standing) -> Result<Option<Standing>, FitError> {
    let mut next = standing.clone();
    loop {
        let signatures = signatures(context, &next, &next.fit, Source::Catalogue);
        match one_more(context, next, &signatures)? {
            Round::Instruments(same, better) => {
                next = beside_instruments(context, same, *better)?;
                if next.begins_anew() {
                    return Ok(None);
                }
            }
            Round::Found(found) => {
                let needed = prune(context, found)?;
                return Ok((needed.count() < context.policy.several_laws).then_some(needed));
            }
            Round::Nothing(_) => return Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::strategy::fixture::{begun, effect, evidence, names, with};
    use crate::strategy::policy::{POLICY, Policy};

    #[test]
    fn a_round_finds_what_is_hidden_and_nothing_where_nothing_is() {
        let drag = effect("platform_linear_drag", None, &[60.0]);
        for hidden in [vec![drag], Vec::new()] {
            let evidence = evidence(&hidden, 83);
            let (context, standing) = begun(&evidence, &Model::default());
            let signatures = signatures(&context, &standing, &standing.fit, Source::Catalogue);
            match one_more(&context, standing, &signatures).expect("a fit") {
                Round::Found(next) => {
                    assert_eq!(names(&context, &next), [("platform_linear_drag".to_owned(), None)]);
                    assert!((next.found(&context)[0].values[0] - 60.0).abs() < 6.0 && !hidden.is_empty());
                    assert!(next.accepted[0].null_test.is_some_and(|test| test.as_strong == 0));
                }
                Round::Nothing(same) => {
                    assert!(hidden.is_empty() && same.accepted.is_empty() && same.chance.is_some());
                }
                Round::Instruments(..) => panic!("the noise is white"),
            }
        }
    }

    /// Laws that stood for errors of four anchors were refined one after the other, up to five, before all were given up. But where
    /// one anchor was off, beside two laws, its error was not looked for: with three laws, one of which stood for it, errors of the
    /// survey explained what was left.
    #[test]
    fn where_so_many_laws_stand_and_the_geometry_is_off_no_more_are_looked_for() {
        static AT_ONCE: Policy = Policy { several_laws: 0, ..POLICY };
        // Not all alike, which is a bias of the pose.
        let offsets = [[0.1, -0.05], [-0.1, 0.08], [0.05, 0.1], [-0.06, -0.1]];
        let anchors: Vec<_> =
            (1..=4).zip(offsets).map(|(cable, offset)| effect("anchor_offset", Some(cable), &offset)).collect();
        for (hidden, off) in [(&anchors[..], true), (&anchors[..1], false)] {
            let evidence = evidence(hidden, 81);
            let (mut context, standing) = begun(&evidence, &Model::default());
            (context.geometry_may_be_off, context.policy) = (true, &AT_ONCE);
            let ended = rounds(&context, standing).expect("a fit");
            assert_eq!((ended.geometry_is_off, ended.begins_anew()), (off, off));
            let found = names(&context, &ended);
            let expected = if off { vec![] } else { vec![("anchor_offset".to_owned(), Some(1))] };
            assert_eq!(found, expected);
        }
    }
    /// An error of one anchor beside a bias: a scale of its length and an error of another anchor stood for it, three laws, and the
    /// errors of all were taken in their place, beside which the anchor was not named.
    #[test]
    fn one_law_that_does_what_two_stood_for_is_taken_before_the_geometry_is_off() {
        static AT_ONCE: Policy = Policy { several_laws: 2, ..POLICY };
        let anchor = effect("anchor_offset", Some(1), &[1.5, 0.8]);
        let evidence = evidence(std::slice::from_ref(&anchor), 85);
        let (mut context, standing) = begun(&evidence, &Model::default());
        (context.geometry_may_be_off, context.policy) = (true, &AT_ONCE);
        let scale = effect("length_sensor_scale", Some(1), &[-2e-4]);
        let other = effect("anchor_offset", Some(3), &[0.05, -0.05]);
        let standing = with(&context, standing, vec![(scale, Vec::new()), (other, Vec::new())]);
        let fewer = fewer_with_one_more(&context, &standing).expect("a fit").expect("one law");
        assert_eq!(names(&context, &fewer), [("anchor_offset".to_owned(), Some(1))]);
    }
}

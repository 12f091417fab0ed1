//! What a search found, concluded: what each effect does by itself, what is left, and the verdict.

use std::borrow::Cow;
use std::sync::Arc;

use cdpr::effect::{DependsOn, EffectSpec, Place, SpecError};

use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::hypothesis::parameter::{free_parameters, free_values};
use crate::hypothesis::term;
use crate::instruments;
use crate::journal::Written;
use crate::outcome::{
    BeforeAfter, Discovery, Estimated, Found, HORIZON, HORIZONS, HorizonGap, Located, Onset, Stability, SurveyError,
    Verdict, at_rest,
};
use crate::report::{channel_words, printed, significant};
use crate::strategy::begin::{begun_by_data, held_by_data};
use crate::strategy::context::Context;
use crate::strategy::fitted::Fitted;
use crate::strategy::given_sizes::{not_found_again, stands_for};
use crate::strategy::instruments::beside_those_of;
use crate::strategy::onset::time_errors;
use crate::strategy::other_optimum::{Other, hardly_told};
use crate::strategy::standing::Standing;
use crate::strategy::time_limit::Hours;
use crate::verdict::alike::likeness;
use crate::verdict::by_block::{ByBlock, Column};
use crate::verdict::by_recording::by_recording;
use crate::verdict::changed;
use crate::verdict::detection::detection_limits;
use crate::verdict::doubted::doubted;
use crate::verdict::drifts::not_told_from_drifts;
use crate::verdict::one_clock::one_clock;
use crate::verdict::stability::stability;
use crate::verdict::verify;
use crate::verdict::{self, Disturbance, EffectFacts, Facts, HorizonFacts, Judgement, POLICY, widened};
use crate::weigh::criterion::EVIDENCE;
use crate::weigh::lost::lost;
use crate::weigh::refine::refine_free;
use crate::write::{errors, in_numbers, in_place};

/// What is to be said of a search beside what it found.
pub(crate) struct About {
    /// What was held out, as a noun phrase.
    pub(crate) holdout_source: String,
    pub(crate) outliers: usize,
    pub(crate) remarks: Vec<String>,
    /// Effects that were taken out of the model as given.
    pub(crate) taken_out: Vec<EffectSpec>,
    pub(crate) hours: Hours,
    /// Whether the search left something undone because its time was over.
    pub(crate) ended_early: bool,
}

/// Effects and terms with what is known of each, and the places where they act.
#[derive(Default)]
struct Explained {
    effects: Vec<Found>,
    terms: Vec<Found>,
    located: Vec<Located>,
    /// Of the effects, in their order.
    facts: Vec<EffectFacts>,
    /// Effects of the model as given that were found to be as they are there, with what is known of each.
    as_given: Vec<Found>,
}

/// The outcome of a search that has ended.
///
/// # Errors
/// Effects whose places or times cannot be told.
pub(crate) fn conclude(context: Context<'_>, standing: Standing, about: About) -> Result<Discovery, FitError> {
    (context.progress)("verifying on held-out data", 0.92);
    let evidence = context.evidence;
    let About { holdout_source, outliers, mut remarks, taken_out, hours, ended_early } = about;
    let standing = beside_as_given(&context, standing, &taken_out)?;
    let (standing, horizons) = better_than_given(&context, standing);
    let (standing, horizons) = beside_what_was_found(&context, standing, horizons)?;
    let Standing { fit: fitted, base, .. } = &standing;
    let by_block = ByBlock::new(&fitted.train, &evidence.train, context.free_from);
    let by_samples = by_samples(&context, &fitted.train, &by_block);
    let horizon_facts = HorizonFacts::all(&horizons);
    let standard_errors = widened(&fitted.train, &evidence.train, &by_samples, &with_more_than_noise(&horizon_facts));
    let surveyed = surveyed(&context, fitted, &standard_errors);
    let Explained { mut effects, terms, mut located, facts, as_given } =
        explained(&context, &standing, &taken_out, &by_block, [&by_samples, &standard_errors])?;
    remarks.extend(as_given.iter().map(found_again));
    let whiteness = verify::whiteness(&fitted.train, &evidence.train, &fitted.train.randomness.noise);
    let coloured = whiteness
        .iter()
        .filter(|w| w.statistic > w.limit)
        .map(|w| channel_words(&w.channel.name()).replace('\u{a0}', " "))
        .collect();
    let only_trained = context.journal.only_trained().filter(|_| effects.is_empty() && terms.is_empty());
    // Of one that was fitted there is none that it could be unlike.
    let may_differ = evidence.train.len() > 1 && changed::more_is_left(&horizons);
    let recordings = if may_differ { by_recording(&context, fitted)? } else { Vec::new() };
    let unlike = changed::unlike(&recordings);
    let facts = Facts {
        horizons: horizon_facts,
        coloured,
        disturbance: Disturbance::of(&fitted.train, &evidence.train),
        unrecorded: fitted.train.randomness.expected.map_or(0.0, |expected| expected.unrecorded),
        effects: facts,
        terms: terms.len(),
        contradicted: only_trained.is_some(),
        unlike: unlike.is_some(),
        ended_early,
        chance: standing.chance,
    };
    let Judgement { verdict, reasons, named } = verdict::judge(&facts, &POLICY);
    let nothing_explains = verdict == Verdict::Unnamed && effects.is_empty() && terms.is_empty();
    let mut changed = None;
    if !nothing_explains {
        remarks.extend(unlike);
    } else {
        let names_the_law = unlike.is_none() && only_trained.is_some();
        changed = unlike.or_else(|| changed::changed(only_trained.as_ref(), &horizons));
        let (refused, failed) = context.journal.refused_and_failed();
        remarks.extend(refused.filter(|_| !names_the_law).map(|(law, delta_bic)| refused_law(&law, delta_bic)));
        remarks.extend((failed > 0).then(|| could_not_be_tried(failed)));
    }
    let phrases: Vec<String> = effects.iter().map(|found| in_place(&found.effect)).collect();
    remarks.extend(reasons.iter().map(|reason| verdict::sentence(reason, &phrases)));
    let remaining = HORIZONS.map(|h| {
        let (fit, trials) = (&fitted.holdout, &evidence.holdout);
        let noise = fitted.instruments.as_ref().map(|randomness| fit.spread(trials, randomness, h));
        verdict::remaining(fit, trials, noise.as_ref().unwrap_or(&fitted.train.randomness.noise), h)
    });
    let remaining = remaining.to_vec();
    if verdict == Verdict::PartlyNamed {
        remarks.push(verdict::left_over(&remaining));
    }
    effects.iter_mut().zip(named).for_each(|(found, named)| found.named = named);
    let not_shown: Vec<EffectSpec> =
        not_found_again(&taken_out, &fitted.train.model.effects).into_iter().cloned().collect();
    remarks.extend(not_shown.iter().map(as_given_only));
    effects.sort_by(|a: &Found, b: &Found| a.delta_bic.total_cmp(&b.delta_bic));
    located.sort_by(|a, b| b.share.total_cmp(&a.share));
    for found in effects.iter().chain(&terms) {
        remarks.extend(found.stability.as_ref().filter(|s| s.varies()).map(|s| varying(found, s)));
    }
    remarks.extend(one_clock(&effects, &fitted.train.randomness, &evidence.train));
    for other in hardly_told(&context, fitted) {
        let law = &fitted.train.model.effects[other.at];
        let found = effects.iter_mut().find(|found| found.named && found.effect == *law);
        if let Some(found) = found.filter(|found| is_another(found, &other.effect)) {
            remarks.push(as_well(found, &other.effect));
            if found.effect.id == other.effect.id {
                found.standard_error = with_the_other(found, &other);
            }
        }
    }
    remarks.extend(not_told_from_drifts(&context, fitted));
    if let Some(doubted) = doubted(&context, fitted) {
        let mut moved = Vec::new();
        for found in &mut effects {
            if let Some((widened, words)) = doubted.widened(&found.effect, &found.standard_error) {
                found.standard_error = widened;
                moved.extend(words);
            }
        }
        remarks.push(doubted.remark(&moved));
    }
    let size = |f: &Fitted| f.train.randomness.force.hypot(f.train.randomness.winch);
    let arm = base.train.randomness.arm;
    // Terms are of another library, weighed after it.
    let last_weighing = standing.chance.filter(|_| terms.is_empty());
    let delay_errors =
        standard_errors.iter().filter(|(column, _)| matches!(column, Column::Clock(_))).map(|(_, error)| *error);
    let instruments = instruments::summary(
        &fitted.train,
        &evidence.train,
        &evidence.noise,
        &delay_errors.collect::<Vec<_>>(),
        context.free_from,
    );
    remarks.extend(instruments.remarks());
    let horizon = context.reaches.main.horizon;
    let trials = verify::compared(base, fitted, evidence, horizon, fitted.instruments.as_ref());
    let detection_limits = detection_limits(&context, fitted);
    let Written { entries, remarks: of_the_way, candidates } = context.journal.written();
    remarks.extend(of_the_way);
    if at_rest(&detection_limits) {
        remarks.push(AT_REST.to_owned());
    }
    (context.progress)("done", 1.0);
    let of_survey = surveyed.iter().map(|error| error.effect.values.len()).sum();
    Ok(Discovery {
        verdict,
        base: base.train.model.clone(),
        criterion: fitted.score + context.penalty.of_parameters(of_survey),
        survey: surveyed,
        few_errors: false,
        model: fitted.train.model.clone(),
        effects,
        not_shown,
        ended_early,
        changed,
        terms,
        located,
        horizons,
        horizon,
        remaining,
        holdout_source,
        whiteness,
        instruments,
        remainder_force: BeforeAfter { before: size(base), after: size(fitted) },
        remainder_torque: BeforeAfter {
            before: arm * base.train.randomness.force,
            after: arm * fitted.train.randomness.force,
        },
        trials,
        null_test: last_weighing,
        candidates,
        outliers,
        journal: entries,
        detection_limits,
        remarks,
        seconds: hours.begun.elapsed().as_secs_f64(),
    })
}

/// What stands, beside the model as given: with the effects that were taken out of it to be found anew.
fn beside_as_given(context: &Context<'_>, standing: Standing, taken_out: &[EffectSpec]) -> Result<Standing, FitError> {
    if taken_out.is_empty() {
        return Ok(standing);
    }
    let (evidence, base) = (context.evidence, &standing.base);
    let mut model = base.train.model.clone();
    model.effects.extend_from_slice(taken_out);
    let mut train = begun_by_data(evidence, &model, &context.journal)?;
    let mut survey = free_parameters(&model, context.free_from);
    survey.retain(|free| free.effect < context.given);
    if !survey.is_empty() {
        let ended = refine_free(&mut train, &evidence.train, &survey, context.policy.rounds, None)?;
        context.journal.stuck(&train.model.effects, ended);
    }
    let holdout = held_by_data(evidence, &train, &context.journal)?;
    let base = Arc::new(context.finish(train, holdout, base.instruments.clone()));
    Ok(Standing { base, ..standing })
}

/// What was found, or the model as given where that is as good over every horizon of held-out data, or where chance may have
/// found it; with the gaps.
fn better_than_given(context: &Context<'_>, standing: Standing) -> (Standing, Vec<HorizonGap>) {
    let Standing { base, fit, .. } = &standing;
    let horizons = horizon_gaps(context, base, fit);
    if standing.accepted.is_empty() {
        return (standing, horizons);
    }
    let facts = HorizonFacts::all(&horizons);
    let reason = if !verdict::beats(&facts, context.likelier(base, fit), &POLICY) {
        "what was found does not beat the model as given on held-out data over every horizon"
    } else if verdict::may_be_chance(&facts, || relative_errors(context, &standing), &POLICY) {
        "no size of what was found is certain, and free runs show nothing of it"
    } else {
        return (standing, horizons);
    };
    let base = context.counted((**base).clone());
    let standing = standing.give_up(context, reason, base);
    let horizons = horizon_gaps(context, &standing.base, &standing.fit);
    (standing, horizons)
}

/// Standard error of the size of each effect that was found, in multiples of the size.
fn relative_errors(context: &Context<'_>, standing: &Standing) -> Vec<f64> {
    let fit = &standing.fit.train;
    let errors = by_samples(context, fit, &ByBlock::new(fit, &context.evidence.train, context.free_from));
    let of = |at: usize| {
        let effect = &fit.model.effects[at];
        verdict::relative_error(effect, &errors_of(&errors, effect, at))
    };
    (0..standing.accepted.len()).map(|k| of(context.at(k))).collect()
}

/// Standard errors of parameters and clocks by samples, and by how far what recorded forces lose with their error may move them.
fn by_samples(context: &Context<'_>, fit: &Fit, by_block: &ByBlock) -> Vec<(Column, f64)> {
    let mut errors = by_block.standard_errors(&fit.model);
    let free = free_values(&fit.model, context.free_from);
    if let Some(lost) = lost(fit, &context.evidence.train, &free) {
        for (column, error) in &mut errors {
            *error = error.hypot(match column {
                Column::Parameter(free) => lost.moves(*free),
                Column::Clock(clock) => lost.moves_clock(*clock),
                Column::Expression(_) => 0.0,
            });
        }
    }
    errors
}

/// What stands, and the model as given beside the instruments of what was found, as it is reported: its own may have stood for
/// that. With the gaps of these, which are `horizons` where the model as given stays.
fn beside_what_was_found(
    context: &Context<'_>,
    standing: Standing,
    horizons: Vec<HorizonGap>,
) -> Result<(Standing, Vec<HorizonGap>), FitError> {
    let plain = |fitted: &Fitted| instruments::parameters(&fitted.train.randomness) == 0;
    let Standing { base, fit, .. } = &standing;
    if standing.accepted.is_empty() || plain(base) && plain(fit) {
        return Ok((standing, horizons));
    }
    let beside = context.journal.or_remark(
        "Beside the instruments of what was found the model as given does not go with the data",
        beside_those_of(context, fit, base),
    )?;
    let Some(beside) = beside else { return Ok((standing, horizons)) };
    let standing = Standing { base: Arc::new(beside), ..standing };
    let horizons = horizon_gaps(context, &standing.base, &standing.fit);
    Ok((standing, horizons))
}

/// Gaps of two models over the horizons that are reported.
fn horizon_gaps(context: &Context<'_>, base: &Fitted, fitted: &Fitted) -> Vec<HorizonGap> {
    verify::horizon_gaps(base, fitted, context.evidence, &context.reaches.reported(), fitted.instruments.as_ref())
}

/// Horizons (s) that tell of the model, up to [`HORIZON`], over which more than noise is left.
fn with_more_than_noise(horizons: &[HorizonFacts]) -> Vec<f64> {
    let left = |h: &&HorizonFacts| h.tells(&POLICY) && h.reach.horizon <= HORIZON && h.after() > POLICY.at_noise;
    horizons.iter().filter(left).map(|h| h.reach.horizon).collect()
}

/// The errors of the survey that were found together with the laws.
fn surveyed(context: &Context<'_>, fitted: &Fitted, standard_errors: &[(Column, f64)]) -> Vec<SurveyError> {
    let one = |at: usize| {
        let effect = fitted.train.model.effects[at].clone();
        SurveyError { standard_error: errors_of(standard_errors, &effect, at), effect }
    };
    (context.free_from..context.given).map(one).collect()
}

/// What is known of each effect that was found, with standard errors by samples, by which it is judged whether it may be chance, and
/// by free runs as well.
fn explained(
    context: &Context<'_>,
    standing: &Standing,
    taken_out: &[EffectSpec],
    by_block: &ByBlock,
    [by_samples, standard_errors]: [&[(Column, f64)]; 2],
) -> Result<Explained, FitError> {
    let (given, trials) = (context.given, &context.evidence.train);
    let (fitted, accepted) = (&standing.fit, &standing.accepted);
    let unknown = |e: SpecError| FitError::Model(e.to_string());
    let times = time_errors(&fitted.train, trials, given, context.policy)?;
    let stability = stability(&fitted.train, by_block, given);
    let total: f64 = accepted.iter().map(|t| t.delta_bic.abs()).sum();
    let mut out = Explained::default();
    let found = standing.found(context).iter().zip(accepted).enumerate();
    for (((k, (effect, accepted)), times), stability) in found.zip(times).zip(stability) {
        let as_given = taken_out.iter().find(|given| stands_for(effect, given));
        let without = match as_given {
            Some(given) => before_its_change(context, standing, k, given).map(Cow::Owned),
            None => without(context, standing, k),
        };
        let without = without.as_deref();
        let delta_bic = match (as_given, without) {
            (Some(_), Some(without)) => fitted.score - without.score,
            _ => accepted.delta_bic,
        };
        let depends_on = effect.depends_on().map_err(unknown)?;
        let one_by_one = |place: &Place| place.one_by_one(fitted.train.model.parameters.cables());
        let places: Vec<Place> = effect.places().map_err(unknown)?.iter().flat_map(one_by_one).collect();
        let when = without.map(|without| verify::when(&fitted.train, &without.train, trials)).unwrap_or_default();
        let share = accepted.delta_bic.abs() / total.max(1e-9) / places.len() as f64;
        let confirmed = as_given.is_some() && delta_bic > -EVIDENCE;
        for place in places.iter().filter(|_| !confirmed) {
            add_place(&mut out.located, place, share, &when, &depends_on);
        }
        let mut alternatives = accepted.alternatives.clone();
        if let Some(without) = without {
            let others: Vec<EffectSpec> = alternatives.iter().map(|a| a.effect.clone()).collect();
            let alike = likeness(&without.train, &fitted.train.randomness, trials, effect, &others);
            for (alternative, correlation) in alternatives.iter_mut().zip(alike) {
                alternative.correlation = correlation;
            }
        }
        let mut found = Found {
            standard_error: errors_of(by_samples, effect, context.at(k)),
            named: false,
            delta_bic,
            holdout_gap_without: without.map(|without| without.gap[0] * context.reaches.main.attainable),
            alternatives,
            null_test: accepted.null_test,
            stability,
            onset: onset(effect, times),
            effect: effect.clone(),
            given: as_given.cloned(),
        };
        let standard_error = errors_of(standard_errors, effect, context.at(k));
        if effect.expression.is_some() {
            out.terms.push(Found { standard_error, ..found });
        } else if confirmed {
            out.as_given.push(Found { standard_error, ..found });
        } else {
            // Without what cannot be done without, nothing would be explained.
            let share = without.map_or(1.0, |without| fitted.takes_away(without));
            out.facts.push(EffectFacts::of(&found, share, &fitted.train.model, context.evidence, &POLICY));
            found.standard_error = standard_error;
            out.effects.push(found);
        }
    }
    Ok(out)
}

/// The model with everything that was found but the effect that was accepted as number `k`; none where that cannot be fitted.
fn without<'a>(context: &Context<'_>, standing: &'a Standing, k: usize) -> Option<Cow<'a, Fitted>> {
    let known = standing.accepted[k].without.as_deref();
    let known = known.or((standing.accepted.len() == 1 && context.given == 0).then_some(&*standing.base));
    if let Some(known) = known {
        return Some(Cow::Borrowed(known));
    }
    let (model, effect) = standing.without(context, k);
    let without = context.fit_without(&model, &standing.fit, 1);
    context.journal.tried(&effect, "what the others do without it", without).map(Cow::Owned)
}

/// The model with everything that was found and effect number `k`, which the model as `given` has, with the numbers that it has there.
fn before_its_change(context: &Context<'_>, standing: &Standing, k: usize, given: &EffectSpec) -> Option<Fitted> {
    let mut model = standing.fit.train.model.clone();
    let effect = &mut model.effects[context.at(k)];
    *effect = EffectSpec { cable: effect.cable, ..given.clone() };
    let before = context.fit_without(&model, &standing.fit, 1);
    context.journal.tried(given, "what the others do beside it as given", before)
}

/// What is said where the data are of a machine at rest.
const AT_REST: &str = "The machine hardly moves in these recordings: they show no friction and no drag of any size that it may \
                       have, so they neither find such a law nor clear the machine of it. Record it moving.";

/// When an effect begins and ends, with the standard errors of that.
fn onset(effect: &EffectSpec, [from, until]: [Option<f64>; 2]) -> Onset {
    let estimated = |time: Option<f64>, standard_error| Some(Estimated { value: time?, standard_error });
    Onset { from: estimated(effect.from, from), until: estimated(effect.until, until) }
}

/// Whether `other` is another law than what was found, and is not reported beside it; or the same one with other numbers than
/// its standard errors tell.
fn is_another(found: &Found, other: &EffectSpec) -> bool {
    if found.effect.id != other.id {
        return !found.alternatives.iter().any(|alternative| alternative.effect.id == other.id);
    }
    let values = found.effect.values.iter().zip(&other.values).zip(&found.standard_error);
    values.into_iter().any(|((value, other), error)| error.is_some_and(|error| (value - other).abs() > error))
}

/// Standard errors about the numbers found where the `other` ones may be the true ones.
fn with_the_other(found: &Found, other: &Other) -> Vec<Option<f64>> {
    let share = other.probability().sqrt();
    let apart = found.effect.values.iter().zip(&other.effect.values).map(|(one, other)| one - other);
    found.standard_error.iter().zip(apart).map(|(error, apart)| error.map(|error| error.hypot(share * apart))).collect()
}

/// That another law, or other numbers, explain as much as what was found.
fn as_well(found: &Found, other: &EffectSpec) -> String {
    let what = in_place(&found.effect);
    if found.effect.id == other.id {
        return format!(
            "The {what} may as well have {}: these data do not tell the two apart beyond doubt. Recordings with the cable at other \
             lengths do.",
            in_numbers(other, &found.standard_error)
        );
    }
    let info = cdpr::effect::find(&other.id);
    let separate_by = info.and_then(|info| info.look_alikes.iter().find(|alike| alike.id == found.effect.id));
    let tell = separate_by.map_or(String::new(), |alike| format!(" To tell: {}.", alike.separate_by));
    format!(
        "The {what} may stand for another law, which explains as much: {} ({}).{tell}",
        in_place(other),
        in_numbers(other, &[])
    )
}

/// What would explain the most and was refused because of the held-out data.
fn refused_law(law: &EffectSpec, delta_bic: f64) -> String {
    format!(
        "What makes the fitted data the likeliest is {} ({}; ΔBIC {}), but it does not predict the held-out data better: it may act in some of the \
         recordings only, or stand for something else.",
        in_place(law),
        in_numbers(law, &[]),
        significant(delta_bic, 3)
    )
}

/// That so many laws could not be tried, or not in full.
fn could_not_be_tried(laws: usize) -> String {
    let laws = if laws == 1 { "One law".to_owned() } else { format!("{laws} laws") };
    format!("{laws} could not be tried, or not in full (journal): what is missing may be among them.")
}

/// That an effect of the model as given was taken out and found to be as it is there.
fn found_again(found: &Found) -> String {
    format!(
        "The {} that the model as given has was looked for anew and is as it has it: {}.",
        in_place(&found.effect),
        in_numbers(&found.effect, &found.standard_error)
    )
}

/// That an effect of the model as given is not in what was found.
fn as_given_only(given: &EffectSpec) -> String {
    format!(
        "The model as given has {} ({}). These data do not show it: it was taken out.",
        in_place(given),
        in_numbers(given, &[])
    )
}

/// That an effect is not the same throughout.
fn varying(found: &Found, stability: &Stability) -> String {
    let what = match &found.effect.expression {
        Some(expression) => format!("term {}", printed(expression, &errors(found))),
        None => in_place(&found.effect),
    };
    format!(
        "The {what} is not the same throughout: its size differs from block to block by {:.0} % beyond its error. The law is not \
         quite this one, or something changed during the recordings.",
        100.0 * stability.spread
    )
}

fn errors_of(errors: &[(Column, f64)], effect: &EffectSpec, at: usize) -> Vec<Option<f64>> {
    let mut out = vec![None; term::values(effect).len()];
    for (column, error) in errors {
        if let Column::Parameter(free) = column
            && free.effect == at
            && error.is_finite()
        {
            out[free.parameter] = Some(*error);
        }
    }
    out
}

fn add_place(
    located: &mut Vec<Located>,
    place: &Place,
    share: f64,
    when: &[(usize, f64, f64)],
    depends_on: &[DependsOn],
) {
    if let Some(known) = located.iter_mut().find(|l| l.place == *place) {
        known.share += share;
        known.when = joined(&known.when, when);
        known.depends_on.extend(depends_on.iter().filter(|on| !known.depends_on.contains(on)).collect::<Vec<_>>());
        return;
    }
    located.push(Located { place: place.clone(), share, when: when.to_vec(), depends_on: depends_on.to_vec() });
}

/// The stretches `(trial, start, end)` of both lists, in order, those that meet or overlap as one.
fn joined(one: &[(usize, f64, f64)], other: &[(usize, f64, f64)]) -> Vec<(usize, f64, f64)> {
    let mut all = [one, other].concat();
    all.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let mut out: Vec<(usize, f64, f64)> = Vec::new();
    for (trial, start, end) in all {
        match out.last_mut() {
            Some(last) if last.0 == trial && start <= last.2 => last.2 = last.2.max(end),
            _ => out.push((trial, start, end)),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_effects_at_one_place_show_whenever_either_does() {
        let mut located = Vec::new();
        let place = Place::Winch(Some(2));
        add_place(&mut located, &place, 0.5, &[(0, 10.0, 20.0), (1, 0.0, 4.0)], &[DependsOn::Speed]);
        add_place(&mut located, &place, 0.25, &[(0, 2.0, 4.0), (0, 18.0, 30.0)], &[DependsOn::Speed, DependsOn::Time]);
        let [one] = &located[..] else { panic!("{located:?}") };
        assert_eq!(one.when, [(0, 2.0, 4.0), (0, 10.0, 30.0), (1, 0.0, 4.0)]);
        assert_eq!((one.share, &one.depends_on[..]), (0.75, &[DependsOn::Speed, DependsOn::Time][..]));
    }
}

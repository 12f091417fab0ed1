//! From recordings and a model to a verdict.

use std::time::Instant;

use cdpr::effect::{DependsOn, EffectSpec, Place};
use cdpr::model_file::Model;
use cdpr::winch::WinchCommand;

use crate::alike::likeness;
use crate::by_block::{ByBlock, Column};
use crate::check::check;
use crate::data::clean::remove_outliers;
use crate::data::{Trial, make_ready};
use crate::estimate::{FitError, noise_of_data};
use crate::fitted::{Evidence, Fitted};
use crate::instruments;
use crate::onset::time_errors;
use crate::outcome::{
    BeforeAfter, Discovery, Estimated, Found, HORIZON, HORIZONS, Located, Onset, Stability, SurveyError, Verdict,
    at_rest,
};
use crate::report::{self, channel_words, phrase, printed};
use crate::search::{EVIDENCE, NOTHING_LEFT, Progress, Search};
use crate::settle::{beyond_catalogue, or_single_term, settle};
use crate::stability::stability;
use crate::survey::{SEVERAL, most_longer, survey_errors, with_errors};
use crate::term;
use crate::verdict::{self, Disturbance, EffectFacts, Facts, HorizonFacts, POLICY};
use crate::verify;
use crate::write::{errors, label, place};

/// Why there is no verdict.
#[derive(Debug, thiserror::Error)]
pub enum DiscoverError {
    /// Trials that no search can use, or not as they were read.
    #[error("{0}")]
    Data(String),
    /// The model cannot be fitted to the data.
    #[error(transparent)]
    Fit(#[from] FitError),
}

/// What is done about a geometry that is not quite as given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Geometry {
    /// Its errors are found together with the laws, where they explain most of what is left without them.
    Corrected,
    /// Nothing.
    AsGiven,
}

/// Finds out what `model` is missing, from training trials; held-out trials verify.
///
/// With no held-out trial the last 30 % of the longest trial are held out. `progress` gets a message and a fraction.
///
/// # Errors
/// Data that no search can use or that are not of this robot as they were read, or a model that cannot be fitted to them.
pub fn discover(
    model: &Model,
    train: Vec<Trial>,
    holdout: Vec<Trial>,
    geometry: Geometry,
    progress: Progress<'_>,
) -> Result<Discovery, DiscoverError> {
    let begun = Instant::now();
    let cables = model.parameters.cables();
    if let Some(other) = train.iter().chain(&holdout).find(|trial| trial.cables() != cables) {
        let found = other.cables();
        return Err(DiscoverError::Data(format!(
            "{}: {found} winch forces, expected {cables}, one for each cable of the model",
            other.name
        )));
    }
    let command = model.parameters.winch.command;
    if command != WinchCommand::Force {
        let message = format!(
            "the model's winches are commanded by {}; the search takes recorded winch forces so far, with `command = \"force\"` \
             under `[winch]`",
            command.name()
        );
        return Err(DiscoverError::Data(message));
    }
    progress("cleaning the data", 0.0);
    let mut ready = prepare(train, holdout).map_err(DiscoverError::Data)?;
    progress("checking the data against the model", 0.01);
    let trials = ready.evidence.train.iter().chain(&ready.evidence.holdout);
    ready.remarks.extend(check(model, trials).map_err(DiscoverError::Data)?);
    let survey = (geometry == Geometry::Corrected)
        .then(|| survey_errors(model, &ready.evidence.train))
        .filter(|errors| !errors.is_empty());
    examine(model, survey, model.effects.len(), ready, begun, progress)
}

/// Recordings that a search can begin with.
#[derive(Clone)]
pub(crate) struct Ready {
    evidence: Evidence,
    /// What was held out, as a noun phrase.
    holdout_source: String,
    outliers: usize,
    remarks: Vec<String>,
}

/// Makes recordings ready, cleans them and holds some out.
pub(crate) fn prepare(mut train: Vec<Trial>, mut holdout: Vec<Trial>) -> Result<Ready, String> {
    if train.is_empty() {
        return Err("no training data; expected one recording or more".to_owned());
    }
    let remarks = make_ready(&mut train, &mut holdout, HORIZON)?;
    let outliers = train.iter_mut().chain(&mut holdout).map(remove_outliers).sum();
    let holdout_source = if holdout.is_empty() {
        hold_out(&mut train, &mut holdout)?
    } else {
        let names: Vec<&str> = holdout.iter().map(|t| t.name.as_str()).collect();
        format!("the trial{} {}", if names.len() > 1 { "s" } else { "" }, names.join(", "))
    };
    let all: Vec<Trial> = train.iter().chain(&holdout).cloned().collect();
    let noise = noise_of_data(&all);
    Ok(Ready { evidence: Evidence { train, holdout, noise, instruments: None }, holdout_source, outliers, remarks })
}

/// Finds out what `model` is missing, from recordings that are ready. Its effects from `free_from` on are errors of the
/// survey; those of `survey` are added where they explain what is left.
pub(crate) fn examine(
    model: &Model,
    survey: Option<Vec<EffectSpec>>,
    free_from: usize,
    ready: Ready,
    begun: Instant,
    progress: Progress<'_>,
) -> Result<Discovery, DiscoverError> {
    let Ready { evidence, holdout_source, outliers, mut remarks } = ready;
    progress("fitting the model as given", 0.02);
    let mut search = Search::new(&evidence, model.effects.len(), progress);
    search.free_from = free_from;
    let mut base = search.base(model)?;
    let mut fitted = search.catalogue_rounds(&mut base)?;
    if search.white_force_error()
        && let Some(instruments) = search.instruments.take()
    {
        drop(search);
        let evidence = evidence.with_expected_forces(instruments);
        return examine(
            model,
            survey,
            free_from,
            Ready { evidence, holdout_source, outliers, remarks },
            begun,
            progress,
        );
    }
    let mut alternatives = Vec::new();
    fitted = search.without_idle_instruments(fitted);
    fitted = settle(&mut search, &base, fitted, &mut alternatives)?;
    if let Some(errors) = survey.filter(|_| fitted.gap[0] > NOTHING_LEFT || search.taken.len() >= SEVERAL)
        && search.is_survey(&fitted)?
    {
        progress("finding errors of the geometry as well", 0.02);
        let ready = Ready {
            evidence: evidence.clone(),
            holdout_source: holdout_source.clone(),
            outliers,
            remarks: remarks.clone(),
        };
        match examine(&with_errors(model, &errors), None, free_from, ready, begun, progress) {
            Ok(mut discovery)
                if discovery.criterion < fitted.score - EVIDENCE
                    && left_over(&discovery) <= NOTHING_LEFT =>
            {
                discovery.remarks.insert(0, corrected(&discovery, base.gap[0], fitted.gap[0]));
                return Ok(discovery);
            }
            Ok(_) => remarks.push(
                "With errors of the geometry free beside every law, less is explained than they cost, or something is left: the geometry was taken as given."
                    .to_owned(),
            ),
            Err(error) => remarks.push(format!(
                "With errors of the geometry free beside every law the search fails ({error}): the geometry was taken as given."
            )),
        }
    }
    if fitted.gap[0] > NOTHING_LEFT {
        fitted = beyond_catalogue(&mut search, &base, fitted, &mut alternatives)?;
    } else if search.taken.len() > 1 && fitted.train.randomness.has_latents() {
        fitted = or_single_term(&mut search, &base, fitted, &mut alternatives)?;
    }
    fitted = search.refine_terms(fitted)?;
    progress("verifying on held-out data", 0.92);
    let reaches = search.reaches.reported();
    let mut horizons = verify::horizon_gaps(&base, &fitted, &evidence, &reaches, search.instruments.as_ref());
    if !search.taken.is_empty() && !verdict::beats(&HorizonFacts::all(&horizons), NOTHING_LEFT, &POLICY) {
        search.give_up(&fitted, "what was found does not beat the model as given on held-out data over every horizon");
        alternatives.clear();
        fitted = base.clone();
        horizons = verify::horizon_gaps(&base, &fitted, &evidence, &reaches, search.instruments.as_ref());
    }
    let (mut effects, mut terms) = (Vec::new(), Vec::new());
    let mut located: Vec<Located> = Vec::new();
    let mut facts = Vec::new();
    let given = search.given;
    let by_block = ByBlock::new(&fitted.train, &evidence.train, search.free_from);
    let errors_found = by_block.standard_errors(&fitted.train.model);
    let time_errors = time_errors(&fitted.train, &evidence.train, given)?;
    let error_of_survey = |at: usize| {
        let effect = fitted.train.model.effects[at].clone();
        SurveyError { standard_error: standard_errors(&errors_found, &effect, at), effect }
    };
    let surveyed: Vec<SurveyError> = (search.free_from..given).map(error_of_survey).collect();
    let of_survey = surveyed.iter().map(|error| error.effect.values.len()).sum();
    let mut stability = stability(&fitted.train, &by_block, given);
    let total: f64 = search.taken.iter().map(|t| t.delta_bic.abs()).sum();
    for (k, taken) in search.taken.iter().enumerate() {
        let at = given + k;
        let effect = fitted.train.model.effects[at].clone();
        let mut reduced = fitted.train.model.clone();
        reduced.effects.remove(at);
        let known = taken.without.as_deref().or((search.taken.len() == 1 && given == 0).then_some(&base));
        let without = match known {
            Some(known) => known,
            None => &search.fit_without(&reduced, &fitted, 1).unwrap_or_else(|_| base.clone()),
        };
        let unknown = |e: cdpr::effect::SpecError| FitError::Model(e.to_string());
        let depends_on = effect.depends_on().map_err(unknown)?;
        let places: Vec<Place> = effect
            .places()
            .map_err(unknown)?
            .iter()
            .flat_map(|place| place.one_by_one(model.parameters.cables()))
            .collect();
        let when = verify::when(&fitted.train, &without.train, &evidence.train);
        for place in &places {
            let share = taken.delta_bic.abs() / total.max(1e-9) / places.len() as f64;
            add_place(&mut located, place, share, &when, &depends_on);
        }
        let mut alternatives = alternatives.get(k).cloned().unwrap_or_default();
        let others: Vec<EffectSpec> = alternatives.iter().map(|a| a.effect.clone()).collect();
        let randomness = &fitted.train.randomness;
        let alike = likeness(&without.train, randomness, &evidence.train, &effect, &others);
        for (alternative, correlation) in alternatives.iter_mut().zip(alike) {
            alternative.correlation = correlation;
        }
        let found = Found {
            standard_error: standard_errors(&errors_found, &effect, at),
            named: false,
            delta_bic: taken.delta_bic,
            holdout_gap_without: Some(without.gap[0] * search.reaches.main.attainable),
            alternatives,
            null_test: taken.null_test,
            stability: stability[k].take(),
            onset: onset(&effect, time_errors[k]),
            effect: effect.clone(),
        };
        if effect.id == "expression" {
            terms.push(found);
        } else {
            facts.push(EffectFacts::of(&found, fitted.takes_away(without), &POLICY));
            effects.push(found);
        }
    }
    let whiteness = verify::whiteness(&fitted.train, &evidence.train, &fitted.train.randomness.noise);
    let coloured = whiteness
        .iter()
        .filter(|w| w.statistic > w.limit)
        .map(|w| channel_words(&w.channel.name()).replace('\u{a0}', " "))
        .collect();
    let facts = Facts {
        horizons: HorizonFacts::all(&horizons),
        main: search.reaches.main.horizon,
        coloured,
        disturbance: Disturbance::of(&fitted.train, &evidence.train),
        unrecorded: fitted.train.randomness.expected.map_or(0.0, |expected| expected.unrecorded),
        effects: facts,
        terms: terms.len(),
        chance: search.null_test,
    };
    let judgement = verdict::judge(&facts, &POLICY);
    let phrases: Vec<String> = effects.iter().map(in_words).collect();
    remarks.extend(judgement.reasons.iter().map(|reason| verdict::sentence(reason, &phrases)));
    let remaining = HORIZONS.map(|h| {
        let (fit, trials) = (&fitted.holdout, &evidence.holdout);
        let noise = search.instruments.as_ref().map(|randomness| fit.spread(trials, randomness, h));
        verdict::remaining(fit, trials, noise.as_ref().unwrap_or(&fitted.train.randomness.noise), h)
    });
    let remaining = remaining.to_vec();
    if judgement.verdict == Verdict::PartlyNamed {
        remarks.push(verdict::left_over(&remaining));
    }
    effects.iter_mut().zip(judgement.named).for_each(|(found, named)| found.named = named);
    effects.sort_by(|a: &Found, b: &Found| a.delta_bic.total_cmp(&b.delta_bic));
    located.sort_by(|a, b| b.share.total_cmp(&a.share));
    for found in effects.iter().chain(&terms) {
        remarks.extend(found.stability.as_ref().filter(|s| s.varies()).map(|s| varying(found, s)));
    }
    let size = |f: &Fitted| f.train.randomness.force.hypot(f.train.randomness.winch);
    let arm = base.train.randomness.arm;
    // Terms are of another library, weighed after it.
    let last_weighing = search.null_test.filter(|_| terms.is_empty());
    let delay_errors =
        errors_found.iter().filter(|(column, _)| matches!(column, Column::Clock(_))).map(|(_, error)| *error);
    let instruments =
        instruments::summary(&fitted.train, &evidence.train, &evidence.noise, &delay_errors.collect::<Vec<_>>());
    remarks.extend(instruments.remarks());
    remarks.append(&mut search.remarks);
    let (candidates, steps) = (search.tried.len(), std::mem::take(&mut search.steps));
    let horizon = search.reaches.main.horizon;
    let trials = verify::compared(&base, &fitted, &evidence, horizon, search.instruments.as_ref());
    let detection_limits = search.detection_limits(&fitted);
    if at_rest(&detection_limits) {
        remarks.push(AT_REST.to_owned());
    }
    progress("done", 1.0);
    Ok(Discovery {
        verdict: judgement.verdict,
        base: base.train.model.clone(),
        criterion: fitted.score + search.penalty.of_parameters(of_survey),
        survey: surveyed,
        model: fitted.train.model.clone(),
        effects,
        terms,
        located,
        horizons,
        horizon,
        remaining,
        holdout_source,
        whiteness,
        instruments,
        remainder_force: BeforeAfter { before: size(&base), after: size(&fitted) },
        remainder_torque: BeforeAfter {
            before: arm * base.train.randomness.force,
            after: arm * fitted.train.randomness.force,
        },
        trials,
        null_test: last_weighing,
        candidates,
        outliers,
        steps,
        detection_limits,
        remarks,
        seconds: begun.elapsed().as_secs_f64(),
    })
}

/// What is said where the data are of a machine at rest.
const AT_REST: &str = "The machine hardly moves in these recordings: they show no friction and no drag of any size that it may \
                       have, so they neither find such a law nor clear the machine of it. Record it moving.";

/// Cuts the last 30 % off the longest trial.
fn hold_out(train: &mut [Trial], holdout: &mut Vec<Trial>) -> Result<String, String> {
    let longest = (0..train.len()).max_by_key(|t| train[*t].len()).unwrap_or(0);
    let trial = &train[longest];
    let cut = trial.len() * 7 / 10;
    if trial.len() - cut < 50 {
        return Err(format!(
            "{} has {} samples: too few to hold a part out; expected 170 or more, or --holdout",
            trial.name,
            trial.len()
        ));
    }
    let name = format!("the last {:.0} s of {}", trial.time[trial.len() - 1] - trial.time[cut], trial.name);
    holdout.push(trial.part(cut..trial.len(), name.clone()));
    train[longest] = trial.part(0..cut, trial.name.clone());
    Ok(name)
}

/// When an effect begins and ends, with the standard errors of that.
fn onset(effect: &EffectSpec, [from, until]: [Option<f64>; 2]) -> Onset {
    let estimated = |time: Option<f64>, standard_error| Some(Estimated { value: time?, standard_error });
    Onset { from: estimated(effect.from, from), until: estimated(effect.until, until) }
}

/// An effect and its place.
fn in_words(found: &Found) -> String {
    phrase(&label(&found.effect), &place(&found.effect)).replace('\u{a0}', " ")
}

/// That an effect is not the same throughout.
fn varying(found: &Found, stability: &Stability) -> String {
    let what = match &found.effect.expression {
        Some(expression) => format!("term {}", printed(expression, &errors(found))),
        None => in_words(found),
    };
    format!(
        "The {what} is not the same throughout: its size differs from block to block by {:.0} % beyond its error. The law is not \
         quite this one, or something changed during the recordings.",
        100.0 * stability.spread
    )
}

/// What is left of the gap over the main horizon on held-out data, in multiples of what a model without fault would leave.
fn left_over(discovery: &Discovery) -> f64 {
    let main = discovery.horizons.iter().find(|gap| gap.horizon == discovery.horizon);
    main.map_or(f64::INFINITY, |gap| gap.holdout.after / gap.attainable)
}

/// What is said where the geometry was corrected; `before` is the gap of the model as given, `left` what laws alone leave of it.
fn corrected(discovery: &Discovery, before: f64, left: f64) -> String {
    let errors: Vec<&EffectSpec> = discovery.survey.iter().map(|error| &error.effect).collect();
    format!(
        "The geometry as given is off: in the middle of the workspace a cable is up to {} mm longer or shorter than it says. Errors \
         of anchors, attachments and what lengths count from were found together with the laws (calibration in discovery.json). Over \
         {:.0} s a model without fault would leave 1, the model as given leaves {}, and laws alone (--as-given) leave {}.",
        report::significant(1e3 * most_longer(&discovery.base, &errors), 2),
        discovery.horizon,
        report::significant(before, 2),
        report::significant(left, 2),
    )
}

fn standard_errors(errors: &[(Column, f64)], effect: &EffectSpec, at: usize) -> Vec<Option<f64>> {
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

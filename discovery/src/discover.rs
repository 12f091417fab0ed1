//! From recordings and a model to a verdict.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::time::Duration;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use cdpr::winch::WinchCommand;

use crate::calibrate::{Corrected, correct_before_search, leave_out_computed_poses};
use crate::check::check;
use crate::data::bursts::remove_bursts;
use crate::data::clean::remove_outliers;
use crate::data::filtered::{Filtered, thin_filtered};
use crate::data::held::{Held, leave_out_held};
use crate::data::holes::{cut_at_holes, with_rows_between};
use crate::data::wraps::unwrap;
use crate::data::{Trial, Undone, make_ready};
use crate::filter::error::FitError;
use crate::filter::estimate::noise_of_data;
use crate::hypothesis::survey::{most_longer, survey_errors, with_errors};
use crate::journal::Entry;
use crate::outcome::{Discovery, HORIZON, SurveyError};
use crate::report;
use crate::strategy::context::{Context, Progress};
use crate::strategy::fitted::Evidence;
use crate::strategy::geometry::{few_errors_would_do, survey_gains};
use crate::strategy::lost_forces::without_lost_forces;
use crate::strategy::policy::POLICY;
use crate::strategy::prune::prune;
use crate::strategy::search::search;
use crate::strategy::standing::Standing;
use crate::strategy::terms::{refine_terms, terms};
use crate::strategy::time_limit::{Hours, TimeLimit};
use crate::strategy::undoing::with_laws;
use crate::verdict::POLICY as VERDICT;
use crate::verdict::conclude::{About, conclude};
use crate::weigh::criterion::EVIDENCE;
use crate::write::in_place;

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
    /// Its errors are found together with the laws, where they explain most of what is left without them, and before them where
    /// recordings cannot be read by it and kinematics alone say what is off. Poses that were computed from lengths are left out.
    Corrected,
    /// Nothing; and poses count as measured.
    AsGiven,
}

/// How a search is done.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// What is done about the geometry.
    pub geometry: Geometry,
    /// How long is searched; what was found up to then is concluded, which takes a little longer. None for as long as it takes.
    pub time_limit: Option<Duration>,
}

/// The time that a search of these trials is given where nobody says how long: eight minutes, which nearly all take less than on one
/// processor, and more in proportion where there are more rows than in three recordings of 100 s at 50 Hz.
#[must_use]
pub fn usual_time_limit<'a>(trials: impl IntoIterator<Item = &'a Trial>) -> Duration {
    const USUAL: Duration = Duration::from_secs(8 * 60);
    const ROWS: f64 = 15_000.0;
    let rows: usize = trials.into_iter().map(Trial::len).sum();
    USUAL.mul_f64((rows as f64 / ROWS).max(1.0))
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
    settings: Settings,
    progress: Progress<'_>,
) -> Result<Discovery, DiscoverError> {
    let hours = Hours::from_now(settings.time_limit);
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
    let (mut train, mut holdout) = (train, holdout);
    let may_correct = settings.geometry == Geometry::Corrected;
    let left_out = may_correct.then(|| leave_out_computed_poses(model, train.iter_mut().chain(&mut holdout))).flatten();
    let mut ready = prepare(train, holdout).map_err(DiscoverError::Data)?;
    ready.remarks.extend(left_out);
    progress("checking the data against the model", 0.01);
    let (model, before) = readable(model, &mut ready, may_correct).map_err(DiscoverError::Data)?;
    let model = &*model;
    ready.cut_at_holes();
    if let Some((evidence, remark)) = without_lost_forces(&ready.evidence, model) {
        ready.evidence = evidence;
        ready.remarks.push(remark);
    }
    let survey = may_correct.then(|| survey_errors(model, &ready.evidence.train)).filter(|errors| !errors.is_empty());
    let mut discovery = examine(model, survey, model.effects.len(), ready, hours, progress)?;
    discovery.survey = both(before, discovery.survey);
    Ok(discovery)
}

/// The model by which the recordings can be read, with what was corrected of its geometry: as given, or where they are not that
/// robot's so, and kinematics alone say what is off, as corrected.
fn readable<'a>(
    model: &'a Model,
    ready: &mut Ready,
    may_correct: bool,
) -> Result<(Cow<'a, Model>, Vec<SurveyError>), String> {
    let evidence = &ready.evidence;
    let checked = |model: &Model| check(model, evidence.train.iter().chain(&evidence.holdout));
    let refused = match checked(model) {
        Ok(remarks) => {
            ready.remarks.extend(remarks);
            return Ok((Cow::Borrowed(model), Vec::new()));
        }
        Err(refused) if !may_correct => return Err(refused),
        Err(refused) => refused,
    };
    let Some(Corrected { model, errors, remark }) = correct_before_search(model, &evidence.train) else {
        return Err(refused);
    };
    // What is refused with the corrected geometry as well is said of the one that was given.
    let remarks = checked(&model).map_err(|_| refused)?;
    ready.remarks.push(remark);
    ready.remarks.extend(remarks);
    Ok((Cow::Owned(model), errors))
}

/// Errors of the survey that were corrected before the search, and those that were found in it, one for each place.
fn both(mut before: Vec<SurveyError>, found: Vec<SurveyError>) -> Vec<SurveyError> {
    for error in found {
        let same = |other: &&mut SurveyError| {
            let key = |error: &SurveyError| (error.effect.id.clone(), error.effect.cable, error.effect.channel.clone());
            key(other) == key(&error)
        };
        match before.iter_mut().find(same) {
            Some(known) => {
                known.effect.values.iter_mut().zip(&error.effect.values).for_each(|(known, more)| *known += more);
                known.standard_error = error.standard_error;
            }
            None => before.push(error),
        }
    }
    before
}

/// Recordings that a search can begin with.
#[derive(Clone)]
pub(crate) struct Ready {
    evidence: Evidence,
    /// What was held out, as a noun phrase.
    holdout_source: String,
    outliers: usize,
    remarks: Vec<String>,
    /// Where another search ended, whose laws this one goes on from.
    laws: Option<Box<Standing>>,
    /// The steps of the searches before this one.
    steps: Vec<Entry>,
    /// Effects of the model as given that were taken out, for their numbers are off.
    taken_out: Vec<EffectSpec>,
    /// Whether the numbers of those that it has are not asked for.
    as_given: bool,
}

impl Ready {
    /// Has each recording end where its winch forces are not known, and another one begin behind that; where single rows are missing the
    /// forces are in between. With remarks.
    fn cut_at_holes(&mut self) {
        let (mut lengths, mut between, mut left_out) = (Vec::new(), 0, 0);
        for trials in [&mut self.evidence.train, &mut self.evidence.holdout] {
            let cut = |trial: &Trial| {
                let (filled, rows) = with_rows_between(trial);
                let (parts, of_trial) = cut_at_holes(&filled);
                between += rows;
                left_out += filled.len() - parts.iter().map(Trial::len).sum::<usize>();
                lengths.extend(of_trial);
                parts
            };
            *trials = trials.iter().flat_map(cut).collect();
        }
        if between > 0 {
            self.remarks.push(format!(
                "{between} row{} missing between others: the forces there are taken to go straight from the row before to the one behind.",
                if between == 1 { " is" } else { "s are" }
            ));
        }
        let longest = lengths.iter().copied().fold(0.0, f64::max);
        if lengths.is_empty() {
            return;
        }
        let places = if lengths.len() == 1 { "place" } else { "places" };
        let without = match left_out {
            0 => String::new(),
            rows => format!("; {rows} rows there, or between two such places near each other, are left out"),
        };
        self.remarks.push(format!(
            "At {} {places} rows are missing or the log of the winch forces stood still, for {longest:.2} s at most: what the forces did there is \
             not known. Each recording counts as several{without}.",
            lengths.len()
        ));
    }

    /// What the same search begins again with: the recordings, its steps so far and what it begins again with, a phrase.
    fn again(&self, evidence: Evidence, mut steps: Vec<Entry>, with: &str) -> Self {
        steps.push(Entry::restarted(with));
        Self { evidence, laws: None, steps, ..self.clone() }
    }
}

/// Makes recordings ready, cleans them and holds some out.
pub(crate) fn prepare(mut train: Vec<Trial>, mut holdout: Vec<Trial>) -> Result<Ready, String> {
    if train.is_empty() {
        return Err("no training data; expected one recording or more".to_owned());
    }
    let mut remarks = make_ready(&mut train, &mut holdout, HORIZON)?;
    let turns: usize = train.iter_mut().chain(&mut holdout).map(unwrap).sum();
    if turns > 0 {
        let places = if turns == 1 { "place" } else { "places" };
        remarks.push(format!(
            "At {turns} {places} phi jumps by a turn, as an angle does that is shown within one: it is taken to go on."
        ));
    }
    remarks.extend(without_held(train.iter_mut().chain(&mut holdout)));
    let outliers =
        train.iter_mut().chain(&mut holdout).map(|trial| remove_bursts(trial) + remove_outliers(trial)).sum();
    remarks.extend(without_filtered(&mut train.iter_mut().chain(&mut holdout).collect::<Vec<_>>()));
    let holdout_source = if holdout.is_empty() {
        hold_out(&mut train, &mut holdout)?
    } else {
        let names: Vec<&str> = holdout.iter().map(|t| t.name.as_str()).collect();
        format!("the trial{} {}", if names.len() > 1 { "s" } else { "" }, names.join(", "))
    };
    let all: Vec<Trial> = train.iter().chain(&holdout).cloned().collect();
    let noise = noise_of_data(&all);
    let evidence = Evidence::new(train, holdout, noise);
    let (steps, taken_out) = (Vec::new(), Vec::new());
    Ok(Ready { evidence, holdout_source, outliers, remarks, laws: None, steps, taken_out, as_given: false })
}

/// Takes readings that were shown again as not measured; returns a remark on each device that did so.
fn without_held<'a>(trials: impl Iterator<Item = &'a mut Trial>) -> Vec<String> {
    let mut by_device: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for trial in trials {
        for Held { device, rows } in leave_out_held(trial) {
            let (held, all) = by_device.entry(device.name()).or_default();
            (*held, *all) = (*held + rows, *all + trial.len());
        }
    }
    let remark = |(device, (held, all)): (&str, (usize, usize))| {
        format!(
            "In {held} of {all} rows the {device} shows what it did in the row before, to the last digit, as neither motion nor noise does: \
             its sensor is slower than the log, or lost sight. There it counts as not measured."
        )
    };
    by_device.into_iter().map(remark).collect()
}

/// Takes readings that were filtered before they were written as often as they tell something new; returns a remark on each device.
fn without_filtered(trials: &mut [&mut Trial]) -> Vec<String> {
    let (filtered, apart) = thin_filtered(trials);
    let remark = |Filtered { device, cutoff }: Filtered| {
        format!(
            "The {} has no noise above {cutoff:.2} Hz: it was low-pass filtered before it was written. One reading in {apart:.2} s is used, for \
             those between tell nothing new. Readings as they were measured would tell more.",
            device.name()
        )
    };
    filtered.into_iter().map(remark).collect()
}

/// Finds out what `model` is missing, from recordings that are ready. Its effects from `free_from` on are errors of the
/// survey; those of `survey` are added where they explain what is left.
pub(crate) fn examine(
    model: &Model,
    survey: Option<Vec<EffectSpec>>,
    free_from: usize,
    mut ready: Ready,
    hours: Hours,
    progress: Progress<'_>,
) -> Result<Discovery, DiscoverError> {
    let Ready { laws, steps, .. } = &mut ready;
    let (laws, steps) = (laws.take(), std::mem::take(steps));
    let evidence = &ready.evidence;
    progress("fitting the model as given", 0.02);
    let (mut context, base) = Context::begin(evidence, model, free_from..model.effects.len(), progress)?;
    context.journal.begins_with(steps);
    context.geometry_may_be_off = survey.is_some();
    context.given_may_be_off = !ready.as_given;
    context.time = TimeLimit::new(hours);
    let standing = Standing::new(&context, base);
    let standing = match laws {
        Some(laws) => with_laws(&context, standing, &laws)?,
        None => standing,
    };
    let mut standing = search(&context, standing)?;
    let in_time = !context.time.is_over();
    if !in_time && standing.begins_anew() {
        context.time.leave_undone();
        standing = standing.with_nothing_begun_anew();
    }
    let steps = || context.journal.entries();
    if let Some(at) = standing.given_is_off {
        let mut without = model.clone();
        let effect = without.effects.remove(at);
        let name = in_place(&effect);
        progress("finding an effect of the model anew", 0.02);
        let with = format!("without the {name} of the model as given, whose numbers are off");
        let mut again = ready.again(evidence.clone(), steps(), &with);
        again.taken_out.push(effect);
        let why = match examine(&without, survey.clone(), free_from - 1, again, hours, progress) {
            Ok(found) if found.criterion < standing.fit.score - EVIDENCE => return Ok(found),
            Ok(_) => "does not explain more".to_owned(),
            Err(error) => format!("fails ({error})"),
        };
        let mut as_given = ready.again(evidence.clone(), steps(), "with the effects of the model as they are given");
        as_given.as_given = true;
        as_given.remarks.push(format!(
            "Other numbers of the {name} that the model has seem to explain more than any other effect, but a search for them {why}: it was \
             taken as given."
        ));
        return examine(model, survey, free_from, as_given, hours, progress);
    }
    if standing.undone_in_vain
        && let Some(recorded) = evidence.as_recorded.as_deref()
    {
        progress("taking forces as they were recorded", 0.02);
        let as_recorded = Evidence { forces_in_time: true, ..recorded.clone() };
        let as_recorded = ready.again(as_recorded, steps(), "with winch forces as they were recorded");
        let as_recorded = Ready { laws: Some(Box::new(standing)), ..as_recorded };
        return examine(model, survey.clone(), free_from, as_recorded, hours, progress).or_else(|error| {
            let undone = Evidence { as_recorded: None, ..evidence.clone() };
            let mut undone = ready.again(undone, steps(), "with winch forces that were recorded late");
            undone.remarks.push(format!(
                "With winch forces as they were recorded the search fails ({error}): they were taken to be recorded late."
            ));
            examine(model, survey, free_from, undone, hours, progress)
        });
    }
    if let Some(undone) = standing.to_undo {
        progress("undoing what recording did", 0.02);
        let why = match undone {
            Undone::Forces(_) => "with what recording did to winch forces undone",
            Undone::Clock(_) => "with a slow clock of the time stamps undone",
        };
        let before = ready.again(evidence.clone().before(undone), steps(), why);
        return examine(model, survey, free_from, before, hours, progress);
    }
    if in_time
        && standing.white_force_error()
        && let Some(instruments) = standing.fit.instruments
    {
        let expected = evidence.clone().with_expected_forces(instruments);
        let expected = ready.again(
            expected,
            steps(),
            "with the winch forces to be expected by those recorded, which have an error",
        );
        return examine(model, survey, free_from, expected, hours, progress);
    }
    if in_time
        && let Some(errors) = survey
        && (standing.geometry_is_off || survey_gains(&context, &standing)?.is_some())
    {
        progress("finding errors of the geometry as well", 0.02);
        let (before, alone) =
            (standing.base.gap[0], Alone { laws: standing.accepted.len(), leave: standing.fit.gap[0] });
        let jointly = ready.again(evidence.clone(), steps(), "with errors of the geometry free beside every law");
        let joint = examine(&with_errors(model, &errors), None, free_from, jointly, hours, progress);
        let as_corrected = |mut discovery: Discovery| {
            discovery.remarks.insert(0, corrected(&discovery, before, &alone));
            discovery
        };
        let mut tried = None;
        let mut joint = match joint {
            Ok(joint) => {
                let likelier = joint.criterion < standing.fit.score - EVIDENCE;
                let explains = likelier && left_over(&joint) <= POLICY.nothing_left;
                if explains && !(standing.geometry_is_off && joint.few_errors) {
                    return Ok(as_corrected(joint));
                }
                if !explains {
                    ready.remarks.push(
                        "With errors of the geometry free beside every law, less is explained than they cost, or something is left: the geometry was taken as given."
                            .to_owned(),
                    );
                }
                tried = Some(joint.journal.clone());
                likelier.then_some(joint)
            }
            Err(error) => {
                ready.remarks.push(format!(
                    "With errors of the geometry free beside every law the search fails ({error}): the geometry was taken as given."
                ));
                None
            }
        };
        if standing.geometry_is_off {
            // The search ended where it asked for them.
            let as_given = ready.again(evidence.clone(), tried.unwrap_or_else(steps), "with the geometry as given");
            let alone = match (examine(model, None, free_from, as_given, hours, progress), joint.take()) {
                (Err(error), Some(mut joint)) => {
                    joint.remarks.push(format!("With the geometry as given the search fails ({error})."));
                    return Ok(as_corrected(joint));
                }
                (alone, known) => {
                    joint = known;
                    alone?
                }
            };
            // What is left up to there is noise, whichever leaves less of it.
            let likelier = |joint: &Discovery| {
                joint.criterion < alone.criterion - EVIDENCE
                    && left_over(joint) <= left_over(&alone).max(VERDICT.at_noise)
            };
            return Ok(joint.filter(likelier).map_or(alone, as_corrected));
        }
    }
    context.time.keep(&standing);
    let with_terms = terms(&context, standing).and_then(|standing| refine_terms(&context, standing));
    let standing = context.time.or_what_stood(with_terms)?;
    let ended_early = context.time.has_cut();
    context.time.lift();
    // What came in last may do all that others were in for.
    let standing = if ended_early { prune(&context, standing)? } else { standing };
    let few_errors = few_errors_would_do(&context, &standing);
    let Ready { holdout_source, outliers, remarks, taken_out, .. } = ready.clone();
    let about = About { holdout_source, outliers, remarks, taken_out, hours, ended_early };
    Ok(Discovery { few_errors, ..conclude(context, standing, about)? })
}

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

/// What is left of the gap over the main horizon on held-out data, in multiples of what a model without fault would leave.
fn left_over(discovery: &Discovery) -> f64 {
    let main = discovery.horizons.iter().find(|gap| gap.horizon == discovery.horizon);
    main.map_or(f64::INFINITY, |gap| gap.holdout.after / gap.attainable)
}

/// Laws that a search for these alone had found when it gave way to errors of the geometry, and the gap that they leave.
struct Alone {
    laws: usize,
    leave: f64,
}

/// What is said where the geometry was corrected; `before` is the gap of the model as given.
fn corrected(discovery: &Discovery, before: f64, alone: &Alone) -> String {
    let errors: Vec<&EffectSpec> = discovery.survey.iter().map(|error| &error.effect).collect();
    let [longer, before, leave] =
        [1e3 * most_longer(&discovery.base, &errors), before, alone.leave].map(|number| report::significant(number, 2));
    let leave = match alone.laws {
        0 => String::new(),
        1 => format!(", and one law beside that geometry {leave}"),
        laws => format!(", and {laws} laws beside that geometry {leave}"),
    };
    let horizon = discovery.horizon;
    format!(
        "The geometry as given is off: in the middle of the workspace a cable is up to {longer} mm longer or shorter than it says. Errors \
         of anchors, attachments and what lengths count from were found together with the laws (calibration in discovery.json). Over \
         {horizon:.0} s a model without fault would leave 1, the model as given leaves {before}{leave}."
    )
}

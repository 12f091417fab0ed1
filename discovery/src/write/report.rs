//! The report's data.

use std::path::Path;

use crate::data::Channel;
use crate::journal::Entry;
use crate::outcome::{
    Alternative, BeforeAfter, Block, Compared, Discovery, Estimated, Found, Instruments, Located, NullTest, Stability,
    Verdict,
};
use crate::report::{
    self, ChannelGap, FileUsed, Gap, HorizonGap, Method, Remainder, Report, Robot, Setting, Span, Step, Term, Whiteness,
};
use crate::verdict::POLICY;

use super::detection::rows;
use super::label::{errors, in_place, label, law, parameters, place, sizes};
use super::series::trial;
use super::signature::signatures;
use super::trials::{all_channels, training_trials};

/// Most points of the platform's path.
const PATH: usize = 600;

/// Share of the time from which something shows throughout.
const THROUGHOUT: f64 = 0.9;

/// What the report says of the run beside its result.
#[derive(Clone, Debug, Default)]
pub struct About {
    /// What was examined, in a few words.
    pub title: String,
    /// The files read and written.
    pub files: Vec<FileUsed>,
    /// Settings of the run: name and value with unit.
    pub settings: Vec<Setting>,
}

/// The report's data.
#[must_use]
pub fn report(discovery: &Discovery, about: &About) -> Report {
    let channels: Vec<report::Channel> = all_channels(discovery).iter().map(|c| channel(*c, discovery)).collect();
    let names = short_names(&discovery.trials);
    let trials: Vec<report::Trial> =
        discovery.trials.iter().zip(&names).map(|(t, name)| report::Trial { name: name.clone(), ..trial(t) }).collect();
    Report {
        title: about.title.clone(),
        verdict: match discovery.verdict {
            Verdict::NoMissingEffect => report::Verdict::NoMissingEffect,
            Verdict::Named => report::Verdict::Named,
            Verdict::Ambiguous => report::Verdict::Ambiguous,
            Verdict::PartlyNamed => report::Verdict::PartlyNamed,
            Verdict::Unnamed => report::Verdict::Unnamed,
        },
        effects: discovery.effects.iter().map(|found| effect(found, &discovery.trials)).collect(),
        not_shown: discovery.not_shown.iter().map(in_place).collect(),
        ended_early: discovery.ended_early,
        changed: discovery.changed.as_ref().map(|said| shortened(said, &discovery.trials, &names)),
        located: discovery.located.iter().map(|l| located(l, &discovery.trials)).collect(),
        terms: discovery.terms.iter().map(|found| term(found, &discovery.trials)).collect(),
        gap: Gap { holdout_source: shortened(&discovery.holdout_source, &discovery.trials, &names), ..gap(discovery) },
        instruments: instruments(&discovery.instruments),
        remainder: Remainder {
            force: discovery.remainder_force.after,
            torque: discovery.remainder_torque.after,
            force_before: Some(discovery.remainder_force.before),
            torque_before: Some(discovery.remainder_torque.before),
        },
        signatures: signatures(discovery),
        robot: robot(discovery),
        files: about.files.clone(),
        settings: about.settings.clone(),
        method: Method {
            candidates: discovery.candidates,
            trials: discovery.trials.iter().filter(|t| !t.holdout).count(),
            samples: discovery.trials.iter().filter(|t| !t.holdout).map(numbers).sum(),
            seconds: discovery.seconds,
            null_test: null_test(discovery),
            steps: discovery.journal.iter().map(step).collect(),
        },
        limits: rows(&discovery.detection_limits),
        at_rest: discovery.at_rest(),
        remarks: discovery.remarks.clone(),
        corrected: !discovery.survey.is_empty(),
        channels,
        trials,
    }
}

/// The files' names without their folders, where that leaves them different.
fn short_names(trials: &[Compared]) -> Vec<String> {
    let file = |path: &str| match Path::new(path).file_name() {
        Some(name) => name.to_string_lossy().into_owned(),
        None => path.to_owned(),
    };
    // A part that was cut off another trial is called after it: `the last 30 s of runs/a.csv`.
    let short = |t: &Compared| {
        let name = &t.trial.name;
        let whole = trials.iter().map(|other| &other.trial.name).find(|other| *other != name && name.ends_with(*other));
        match whole {
            Some(other) => format!("{}{}", &name[..name.len() - other.len()], file(other)),
            None => file(name),
        }
    };
    let names: Vec<String> = trials.iter().map(short).collect();
    let mut different = names.clone();
    different.sort();
    different.dedup();
    if different.len() == names.len() { names } else { trials.iter().map(|t| t.trial.name.clone()).collect() }
}

/// The text with the trials' names in place of their paths, and without the folder of those of which it names the whole.
fn shortened(text: &str, trials: &[Compared], names: &[String]) -> String {
    let mut pairs: Vec<(&str, &str)> =
        trials.iter().map(|t| t.trial.name.as_str()).zip(names.iter().map(String::as_str)).collect();
    pairs.extend(pairs.clone().into_iter().filter_map(|(name, short)| Some((name.strip_suffix(short)?, ""))));
    // The longest first: one name may be part of another.
    pairs.sort_by_key(|(name, _)| std::cmp::Reverse(name.len()));
    let named = pairs.into_iter().filter(|(name, _)| !name.is_empty());
    named.fold(text.to_owned(), |text, (name, short)| text.replace(name, short))
}

/// Measurements that are there.
fn numbers(compared: &Compared) -> usize {
    compared.trial.measured.iter().flatten().filter(|v| v.is_finite()).count()
}

fn channel(channel: Channel, discovery: &Discovery) -> report::Channel {
    let test = discovery.whiteness.iter().find(|w| w.channel == channel);
    report::Channel {
        name: channel.name(),
        unit: channel.unit().to_owned(),
        noise: test.map_or(f64::NAN, |w| w.noise),
        samples: test.map_or(0, |w| w.samples),
        whiteness: test.map(|w| Whiteness {
            name: "Ljung-Box Q(20)".to_owned(),
            statistic: w.statistic,
            limit: w.limit,
            pass: w.statistic <= w.limit,
        }),
    }
}

/// What the instruments have beside white noise, a row each; channels of one device have one clock.
fn instruments(instruments: &Instruments) -> Vec<report::Instrument> {
    let row = |what: String, unit: &str, size: &Estimated| report::Instrument {
        what,
        value: size.value,
        standard_error: size.standard_error,
        unit: unit.to_owned(),
    };
    let mut rows: Vec<report::Instrument> = Vec::new();
    for c in &instruments.channels {
        let (name, unit) = (c.channel.name(), c.channel.unit());
        let count = c.resolution.map(|value| Estimated { value, standard_error: None });
        let sizes = [
            ("noise with memory of", unit, &c.coloured),
            ("its time constant,", "s", &c.time_constant),
            ("drift of", unit, &c.drift),
            ("origin from recording to recording of", unit, &c.origin),
            ("resolution of", unit, &count),
        ];
        for (what, unit, size) in sizes {
            rows.extend(size.iter().map(|size| row(format!("{what} {name}"), unit, size)));
        }
    }
    for (device, delay) in instruments.clocks() {
        rows.push(row(format!("delay of {device} against the recorded forces"), "s", &delay));
    }
    let late_forces = instruments.late_forces.iter();
    rows.extend(late_forces.map(|delay| row("delay of the recorded winch forces".into(), "s", delay)));
    let smoothed = instruments.smoothed_forces.iter();
    rows.extend(smoothed.map(|size| row("smoothing of the recorded winch forces".into(), "s", size)));
    let slow_clock = instruments.slow_clock.iter();
    rows.extend(slow_clock.map(|share| row("share by which the clock of the stamps is slow".into(), "", share)));
    rows.extend(
        instruments.winch_force.iter().map(|size| row("white error of the recorded winch forces".into(), "N", size)),
    );
    rows.extend(instruments.stamps.iter().map(|size| row("jitter of the time stamps".into(), "s", size)));
    rows
}

fn effect(found: &Found, trials: &[Compared]) -> report::Effect {
    report::Effect {
        id: found.effect.id.clone(),
        label: label(&found.effect),
        place: place(&found.effect),
        cable: found.effect.cable,
        named: found.named,
        equation: law(&found.effect),
        parameters: sizes(found),
        given: found.given.iter().flat_map(|given| parameters(given, &[])).collect(),
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
        alternatives: found.alternatives.iter().map(alternative).collect(),
        stability: found.stability.as_ref().map(|s| stability(s, trials)),
    }
}

fn alternative(other: &Alternative) -> report::Alternative {
    report::Alternative {
        id: other.effect.id.clone(),
        label: label(&other.effect),
        place: place(&other.effect),
        cable: other.effect.cable,
        parameters: parameters(&other.effect, &[]),
        delta_bic: other.delta_bic,
        correlation: other.correlation,
        indistinguishable: other.indistinguishable,
        separate_by: other.separate_by.clone(),
    }
}

fn term(found: &Found, trials: &[Compared]) -> Term {
    Term {
        target: place(&found.effect),
        expression: found.effect.expression.clone().unwrap_or_default(),
        standard_errors: errors(found),
        delta_bic: found.delta_bic,
        holdout_gap_without: found.holdout_gap_without,
        stability: found.stability.as_ref().map(|s| stability(s, trials)),
    }
}

fn stability(stability: &Stability, trials: &[Compared]) -> report::Stability {
    let training = training_trials(trials);
    let block = |b: &Block| {
        let span = Span { trial: *training.get(b.trial)?, start: b.start, end: b.end };
        Some(report::Block { span, size: b.size, standard_error: b.standard_error })
    };
    report::Stability {
        blocks: stability.blocks.iter().filter_map(block).collect(),
        chi_square: stability.chi_square,
        degrees: stability.degrees,
        p_value: stability.p_value,
        spread: stability.spread,
        constant: !stability.varies(),
    }
}

/// The tests of everything found as one: what chance did at best.
fn null_test(discovery: &Discovery) -> Option<report::NullTest> {
    let found: Vec<&Found> = discovery.effects.iter().chain(&discovery.terms).collect();
    let tests: Vec<&NullTest> = found.iter().filter_map(|f| f.null_test.as_ref()).collect();
    let last = discovery.null_test.as_ref();
    let exceeded = if found.is_empty() {
        last.map(|test| test.as_strong)
    } else if tests.len() == found.len() {
        tests.iter().map(|test| test.as_strong).max()
    } else {
        None
    };
    let runs = tests.iter().copied().chain(last).next()?.shifts;
    let followed = last.map(|test| test.over_threshold);
    Some(report::NullTest { runs, allowed: POLICY.by_chance, exceeded, followed })
}

fn located(located: &Located, trials: &[Compared]) -> report::Located {
    let training = training_trials(trials);
    let duration = |t: &Compared| t.trial.time[t.trial.len() - 1] - t.trial.time[0];
    let whole: f64 = training.iter().map(|t| duration(&trials[*t])).sum();
    let shown: f64 = located.when.iter().map(|(_, start, end)| end - start).sum();
    let spans = located.when.iter();
    let spans = spans.filter_map(|(t, start, end)| Some(Span { trial: *training.get(*t)?, start: *start, end: *end }));
    report::Located {
        place: located.place.to_string(),
        share_of_gap: located.share,
        when: if shown >= THROUGHOUT * whole { Vec::new() } else { spans.collect() },
        depends_on: located.depends_on.iter().map(|on| on.name().to_owned()).collect(),
    }
}

fn pair(pair: BeforeAfter) -> report::BeforeAfter {
    report::BeforeAfter { before: pair.before, after: pair.after }
}

fn gap(discovery: &Discovery) -> Gap {
    // A gap that could not be computed is not a number; nothing held out leaves none.
    let held_out = |gap: BeforeAfter| (gap.before.is_finite() && gap.after.is_finite()).then(|| pair(gap));
    let main = discovery.horizons.iter().find(|h| h.horizon == discovery.horizon);
    let nothing = report::BeforeAfter { before: f64::NAN, after: f64::NAN };
    let channels = main.map_or(&[][..], |h| &h.channels);
    Gap {
        horizon_s: discovery.horizon,
        train: main.map_or(nothing, |h| pair(h.train)),
        holdout: main.and_then(|h| held_out(h.holdout)),
        holdout_source: String::new(),
        channels: channels
            .iter()
            .map(|(c, train, holdout)| ChannelGap {
                channel: c.name(),
                train: pair(*train),
                holdout: holdout.and_then(held_out),
            })
            .collect(),
        horizons: discovery
            .horizons
            .iter()
            .map(|h| HorizonGap { horizon_s: h.horizon, train: pair(h.train), holdout: held_out(h.holdout) })
            .collect(),
    }
}

fn robot(discovery: &Discovery) -> Robot {
    let geometry = cdpr::geometry::Geometry::new(&discovery.base.parameters);
    let motion: Vec<&[f64; 6]> = discovery.trials.iter().flat_map(|t| &t.motion).collect();
    let every = motion.len().div_ceil(PATH).max(1);
    let first = motion.first().map_or([0.0; 3], |m| [m[0], m[1], m[2]]);
    Robot {
        anchors: geometry.anchor.to_vec(),
        attachments: geometry.attachment.to_vec(),
        pose: first,
        path: motion.iter().step_by(every).map(|m| [m[0], m[1]]).collect(),
    }
}

fn step(entry: &Entry) -> Step {
    let label = |effect| report::phrase(&label(effect), &place(effect));
    Step {
        label: entry.effect.as_ref().map_or_else(|| format!("the {}", entry.about()), label),
        outcome: entry.outcome.name(),
        delta_bic: entry.delta_bic,
        reason: entry.reason.clone(),
    }
}

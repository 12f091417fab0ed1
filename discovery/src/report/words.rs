//! The sentence at the top: what is missing, where, how large, how sure, and what it brings.

use serde::Serialize;

use super::data::{Alternative, BeforeAfter, Effect, Parameter, Report, Span, Verdict};
use super::formula::term;
use super::gather;
use super::grammar::{capital, count, join};
use super::limit::{not_excited, would_show};
use super::number::{gap, percent, plain, quantity, significant};
use super::place::Place;
use super::together::together;

/// The result in words, as at the top of the report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// The verdict in two or three words.
    pub badge: &'static str,
    /// The one sentence.
    pub headline: String,
    /// How large it is and what it brings, one sentence each.
    pub lead: Vec<String>,
    /// Where and when, how sure, and what stays unexplained, one sentence each.
    pub detail: Vec<String>,
    /// What to do next, where there is something: one sentence each.
    pub next: Vec<String>,
}

/// The result in words: a sentence, and the sentences that follow it.
#[must_use]
pub fn summary(report: &Report) -> Summary {
    let several = report.effects.len() > 1 || report.verdict != Verdict::Named;
    let mut lead: Vec<String> = report.effects.iter().filter(|e| e.named).map(|e| size(e, several)).collect();
    lead.extend(candidates(report));
    lead.extend(terms(report));
    lead.push(gap_sentence(report));
    let mut detail: Vec<String> = Vec::new();
    detail.extend(located(report));
    detail.extend(evidence(report).or_else(|| control_runs(report)));
    detail.push(remainder(report));
    if report.verdict == Verdict::NoMissingEffect {
        detail.extend(would_show(report).map(|list| format!("These data would have shown, with 99\u{a0}%, {list}.")));
        detail.extend(not_excited(report).map(|list| format!("They do not tell of {list}.")));
    }
    Summary {
        badge: match report.verdict {
            Verdict::NoMissingEffect if report.at_rest => "These data cannot tell",
            Verdict::NoMissingEffect => "No missing effect",
            Verdict::Named => "Found and named",
            Verdict::Ambiguous => "Found, not yet unique",
            Verdict::PartlyNamed => "Found in part",
            Verdict::Unnamed if report.ended_early => "Not tried in full",
            Verdict::Unnamed if report.terms.is_empty() => "Not explained",
            Verdict::Unnamed => "Outside the catalogue",
        },
        headline: headline(report),
        lead,
        detail,
        next: next_steps(report),
    }
}

/// Force (N) up to which a disturbance is none to speak of.
const NO_FORCE: f64 = 0.1;

fn headline(report: &Report) -> String {
    let mut found = of_laws(report);
    if !report.not_shown.is_empty() {
        let (does, it) = if report.not_shown.len() == 1 { ("does", "it") } else { ("do", "them") };
        let what = capital(&join(&report.not_shown, "and"));
        found = format!("{found} {what} {does} not show in these data, though the model has {it}.");
    }
    match report.verdict {
        Verdict::NoMissingEffect => found,
        _ if report.corrected => format!("{found} Its geometry was off as well."),
        _ => found,
    }
}

/// That effects which the model has are there with other numbers.
fn other_numbers(report: &Report) -> Option<String> {
    let changed = of_all(report.effects.iter().filter(|e| e.named && !e.given.is_empty()), &effect_phrase);
    let (are, it) = (is_are(changed.len()), if changed.len() == 1 { "it" } else { "them" });
    (!changed.is_empty()).then(|| capital(&format!("{} {are} not as the model has {it}", join(&changed, "and"))))
}

fn of_laws(report: &Report) -> String {
    let lacks = |e: &&Effect| e.named && e.given.is_empty();
    let named = of_all(report.effects.iter().filter(lacks), &effect_phrase);
    let changed = other_numbers(report);
    let and_changed = |missing: Option<String>| {
        let changed = changed.iter().map(|changed| format!("{changed}."));
        missing.into_iter().chain(changed).collect::<Vec<_>>().join(" ")
    };
    match report.verdict {
        Verdict::NoMissingEffect if report.at_rest => {
            "These data cannot tell whether anything is missing: the machine hardly moves in them.".to_owned()
        }
        Verdict::NoMissingEffect if best_gap(report).0.after <= 1.1 && report.corrected => {
            "No law is missing: with its geometry corrected the model agrees with the measurements to within their noise."
                .to_owned()
        }
        Verdict::NoMissingEffect if best_gap(report).0.after <= 1.1 => {
            "Nothing is missing: the model agrees with the measurements to within their noise.".to_owned()
        }
        Verdict::NoMissingEffect if all_white(report) && report.remainder.force > NO_FORCE => format!(
            "No effect is missing, but a disturbance of about {}\u{a0}N was not recorded.",
            significant(report.remainder.force, 2)
        ),
        Verdict::NoMissingEffect => "No missing effect was found that the data support.".to_owned(),
        Verdict::Named => and_changed((!named.is_empty()).then(|| missing(&named))),
        Verdict::Ambiguous => ambiguous(report),
        Verdict::PartlyNamed => partly_named(report, changed),
        Verdict::Unnamed => and_changed(Some(unnamed(report, &named))),
    }
}

/// A phrase of each effect; what several cables have is said once.
fn of_all<'a>(effects: impl IntoIterator<Item = &'a Effect>, phrase: &dyn Fn(&Effect) -> String) -> Vec<String> {
    together(effects.into_iter().map(|effect| (phrase(effect), Place::parse(&effect.place))))
}

fn unnamed(report: &Report, named: &[String]) -> String {
    let places = unknown_places(report);
    let unknown = join(&places, "and");
    let (are, so_are) = (is_are(named.len()), is_are(places.len()));
    match (named, unknown.as_str()) {
        ([], _) if report.changed.is_some() => report.changed.clone().unwrap_or_default(),
        ([], "") if report.ended_early => {
            "The search ran out of time before all was tried: it found no law that is missing, and clears the model of none.".to_owned()
        }
        ([], "") => "Something is missing from the model that nothing tried explains.".to_owned(),
        ([], what) => capital(&format!("{what} {so_are} missing from the model, of a kind outside the catalogue.")),
        (named, "") => capital(&format!(
            "{} {are} missing from the model, and so is something outside the catalogue.",
            join(named, "and")
        )),
        (named, what) => capital(&format!(
            "{} {are} missing from the model, and so {so_are} {what} of a kind outside the catalogue.",
            join(named, "and")
        )),
    }
}

fn is_are(count: usize) -> &'static str {
    if count == 1 { "is" } else { "are" }
}

/// What was found with a name, and that it is not all.
fn partly_named(report: &Report, changed: Option<String>) -> String {
    let either = |e: &Effect| {
        if twins(e).next().is_some() { format!("either {}", choices(e)) } else { effect_phrase(e) }
    };
    let all = of_all(report.effects.iter().filter(|e| e.named && e.given.is_empty()), &either);
    let missing =
        (!all.is_empty()).then(|| format!("{} {} missing from the model", join(&all, "and"), is_are(all.len())));
    let found: Vec<String> = [changed, missing].into_iter().flatten().collect();
    let but = if report.ended_early {
        "the search ran out of time before all was tried"
    } else {
        "that is not all: more than the noise is left"
    };
    capital(&format!("{}, but {but}.", found.join("; ")))
}

fn missing(named: &[String]) -> String {
    match named {
        [one] => capital(&format!("{one} is missing from the model.")),
        _ => format!("{} effects are missing from the model: {}.", capital(&count(named.len())), join(named, "and")),
    }
}

fn ambiguous(report: &Report) -> String {
    let (open, sure): (Vec<&Effect>, Vec<&Effect>) = report.effects.iter().partition(|e| twins(e).next().is_some());
    let either = |e: &Effect| {
        let all = choices(e);
        match twins(e).count() {
            1 => format!("either {all}"),
            _ => format!("one of {all}"),
        }
    };
    let (either, sure) = (of_all(open, &either), of_all(sure, &effect_phrase));
    match (sure.as_slice(), either.as_slice()) {
        (sure, []) => capital(&format!("{} would explain the gap, but the data do not settle it.", join(sure, "and"))),
        ([], either) => {
            let are = is_are(either.len());
            capital(&format!("{} {are} missing from the model; these data cannot tell which.", join(either, "and")))
        }
        (sure, either) => capital(&format!(
            "{} {} missing from the model, and so {} {}; these data cannot tell which.",
            join(sure, "and"),
            is_are(sure.len()),
            is_are(either.len()),
            join(either, "and")
        )),
    }
}

/// An effect and its twins: `Coulomb friction or capstan loss on winch 3`.
fn choices(effect: &Effect) -> String {
    if twins(effect).all(|a| a.place == effect.place) {
        let mut labels = vec![effect.label.as_str()];
        labels.extend(twins(effect).map(|a| a.label.as_str()));
        return phrase(&join(&labels, "or"), &effect.place);
    }
    let mut all = vec![effect_phrase(effect)];
    all.extend(twins(effect).map(alternative_phrase));
    join(&all, "or")
}

/// The alternatives that the evidence cannot tell from the effect.
fn twins(effect: &Effect) -> impl Iterator<Item = &Alternative> {
    effect.alternatives.iter().filter(|a| a.indistinguishable)
}

/// `Coulomb friction on winch 3`.
pub(super) fn effect_phrase(effect: &Effect) -> String {
    phrase(&effect.label, &effect.place)
}

fn alternative_phrase(alternative: &Alternative) -> String {
    phrase(&alternative.label, &alternative.place)
}

/// A label and its place: `Coulomb friction` and `winch[3]` make `Coulomb friction on winch 3`.
#[must_use]
pub fn phrase(label: &str, place: &str) -> String {
    let place = Place::parse(place).phrase();
    // "drag on the platform on the platform" and its like.
    if label.ends_with(&place) { label.to_owned() } else { format!("{label} {place}") }
}

/// Effects that the model got without a name.
fn candidates(report: &Report) -> Option<String> {
    let all: Vec<String> = report
        .effects
        .iter()
        .filter(|e| !e.named)
        .map(|e| format!("{} ({})", effect_phrase(e), parameters(&e.parameters)))
        .collect();
    let does = if all.len() == 1 {
        "explains a part and is in the model, but is no cause"
    } else {
        "explain a part and are in the model, but are no causes"
    };
    (!all.is_empty()).then(|| capital(&format!("{} {does}.", join(&all, "and"))))
}

fn size(effect: &Effect, several: bool) -> String {
    let mut own = parameters(&effect.parameters);
    if !effect.given.is_empty() {
        own = format!("{own}; the model as given has {}", parameters(&effect.given));
    }
    if twins(effect).next().is_some() {
        let mut sizes = vec![format!("as {}, {own}", effect.label)];
        sizes.extend(twins(effect).map(|a| format!("as {}, {}", a.label, parameters(&a.parameters))));
        return capital(&format!("{}.", sizes.join("; ")));
    }
    if several { capital(&format!("{}: {own}.", effect_phrase(effect))) } else { format!("Its size: {own}.") }
}

/// The sizes worth a sentence: what may as well be zero is left to the tables.
fn parameters(list: &[Parameter]) -> String {
    let told = |(k, p): &(usize, &Parameter)| *k == 0 || p.standard_error.is_none_or(|e| p.value.abs() > 2.0 * e);
    let parts: Vec<String> = list
        .iter()
        .enumerate()
        .filter(told)
        .map(|(_, p)| p)
        .map(|p| {
            let value = quantity(&p.name, p.value, p.standard_error, &p.unit);
            format!("{} {value}", p.name.replace('_', " "))
        })
        .collect();
    if parts.is_empty() { "size not given".to_owned() } else { join(&parts, "and") }
}

fn terms(report: &Report) -> Option<String> {
    if report.terms.is_empty() {
        return None;
    }
    let list: Vec<String> = report
        .terms
        .iter()
        .map(|t| format!("{} ({})", term(&t.expression, &t.standard_errors), Place::parse(&t.target).noun()))
        .collect();
    Some(format!("The best description found is {}, added to the model as it stands.", join(&list, "and")))
}

fn located(report: &Report) -> Option<String> {
    let places = gather(&report.located, report.robot.anchors.len());
    let (first, others) = places.split_first()?;
    let mut text = format!("{} of the gap sits {}", percent(first.share_of_gap), Place::parse(&first.place).phrase());
    text.push_str(&match first.when.as_slice() {
        [] => ", throughout the data".to_owned(),
        [one] => format!(", from {} s", seconds(one)),
        many => format!(", in {} stretches of time", count(many.len())),
    });
    if !first.depends_on.is_empty() {
        text.push_str(&format!(", and depends on {}", join(&first.depends_on, "and")));
    }
    text.push('.');
    let others: Vec<String> = others
        .iter()
        .filter(|l| l.share_of_gap >= 0.1)
        .map(|l| format!("{} {}", percent(l.share_of_gap), Place::parse(&l.place).phrase()))
        .collect();
    if !others.is_empty() {
        text.push_str(&format!(" Further parts: {}.", join(&others, "and")));
    }
    Some(text)
}

fn seconds(span: &Span) -> String {
    format!("{} to {}", plain(span.start), plain(span.end))
}

fn evidence(report: &Report) -> Option<String> {
    let causes = || report.effects.iter().filter(|e| e.named);
    let weakest =
        causes().map(|e| e.delta_bic).chain(report.terms.iter().map(|t| t.delta_bic)).fold(f64::NEG_INFINITY, f64::max);
    if !weakest.is_finite() {
        return None;
    }
    let several = causes().count() + report.terms.len() > 1;
    let mut text = format!(
        "The evidence is {} (ΔBIC {}{})",
        strength(weakest),
        significant(weakest, 3),
        if several { " for the weakest of them" } else { "" }
    );
    text.push('.');
    text.extend(control_runs(report).map(|runs| format!(" {runs}")));
    Some(text)
}

/// What the false-alarm check says of what was found, or of the best explanation where nothing was, in a sentence.
#[must_use]
pub fn control_runs(report: &Report) -> Option<String> {
    let test = report.method.null_test?;
    let (n, runs) = (test.exceeded?, test.runs);
    Some(if report.effects.is_empty() && report.terms.is_empty() {
        let refused = if n <= test.allowed {
            " It was refused for another reason: fitted in full it explains too little, or not what was held out."
        } else {
            ""
        };
        format!(
            "In {n} of {runs} control runs on data shifted in time and frequency, chance explains as much as the best candidate does.{refused}"
        )
    } else {
        let times = match n {
            0 => "never explained as much".to_owned(),
            1 => "explained as much once".to_owned(),
            n => format!("explained as much {n} times"),
        };
        format!("In {runs} control runs on data shifted in time and frequency, chance {times}.")
    })
}

/// How the false-alarm check was made, and what it says.
pub(super) fn control_method(report: &Report) -> Option<String> {
    let test = report.method.null_test?;
    let mut text = format!(
        "As a check on false alarms, all explanations are weighed again {} times on data shifted in time and frequency \
         against their signatures, where only chance can make the two agree.",
        test.runs
    );
    match control_runs(report) {
        Some(runs) => text.push_str(&format!(" {runs}")),
        None => text.push_str(" The recordings are too short to tell."),
    }
    if let Some(followed) = test.followed.filter(|_| !report.effects.is_empty() || !report.terms.is_empty()) {
        text.push_str(&match followed {
            0 => " In the last weighing, which added nothing more, chance never reached what the search would follow.".to_owned(),
            n => format!(" In the last weighing, which added nothing more, chance reached what the search would follow {n} times."),
        });
    }
    text.push_str(" While an effect is missing the data are no pure noise, and chance looks stronger than it is.");
    Some(text)
}

/// Kass and Raftery's (1995) words for a difference in BIC; negative supports the effect.
pub(super) fn strength(delta_bic: f64) -> &'static str {
    match -delta_bic {
        d if d > 10.0 => "very strong",
        d if d > 6.0 => "strong",
        d if d > 2.0 => "positive",
        _ => "weak",
    }
}

/// The gap to quote: held-out where there is one.
pub(super) fn best_gap(report: &Report) -> (BeforeAfter, bool) {
    match report.gap.holdout {
        Some(gap) => (gap, true),
        None => (report.gap.train, false),
    }
}

fn gap_sentence(report: &Report) -> String {
    let (value, held_out) = best_gap(report);
    let on = if !held_out {
        "On the data fitted (none were held out)".to_owned()
    } else if report.gap.holdout_source.is_empty() {
        "On data that were not fitted".to_owned()
    } else {
        format!("On data that were not fitted ({})", report.gap.holdout_source)
    };
    let horizon = plain(report.gap.horizon_s);
    if report.verdict == Verdict::NoMissingEffect {
        return format!(
            "{on}, the model's prediction over {horizon}\u{a0}s is off by {} times the noise of the measurements; 1 is the best possible.",
            gap(value.after)
        );
    }
    let change = if value.after < value.before { "falls" } else { "goes" };
    format!(
        "{on}, the error of the model's prediction over {horizon}\u{a0}s {change} from {} to {} times the noise of the measurements; 1 is the best possible.",
        gap(value.before),
        gap(value.after)
    )
}

/// Whether what remains was tested in some channel and looks like pure noise in every one.
fn all_white(report: &Report) -> bool {
    let mut tested = report.channels.iter().filter_map(|c| c.whiteness.as_ref()).peekable();
    tested.peek().is_some() && tested.all(|w| w.pass)
}

fn remainder(report: &Report) -> String {
    let r = &report.remainder;
    let white = report.channels.iter().filter_map(|c| c.whiteness.as_ref());
    let (tested, passed) = white.fold((0, 0), |(n, k), w| (n + 1, k + usize::from(w.pass)));
    let colour = match (tested, passed) {
        (0, _) => String::new(),
        (n, k) if n == k => ", and what remains looks like pure noise in every channel".to_owned(),
        (n, k) => format!(", and what remains looks like pure noise in {k} of {n} channels"),
    };
    format!(
        "Unexplained are {}\u{a0}N and {}\u{a0}N\u{a0}m (root mean square on the platform){colour}.",
        significant(r.force, 2),
        significant(r.torque, 2)
    )
}

fn next_steps(report: &Report) -> Vec<String> {
    let mut steps: Vec<String> = Vec::new();
    for effect in report.effects.iter().filter(|e| e.named) {
        for twin in twins(effect) {
            let step = format!(
                "To tell {} from {}: {}.",
                effect_phrase(effect),
                alternative_phrase(twin),
                twin.separate_by.trim_end_matches('.')
            );
            if !steps.contains(&step) {
                steps.push(step);
            }
        }
    }
    if !steps.is_empty() {
        steps.push(format!("{PLAN} plans such a recording, within what the machine may do."));
    }
    steps
}

/// The call that plans the next experiment.
const PLAN: &str = "cdpr experiment --from discovery.json --limits limits.toml -o plan.csv";

fn unknown_places(report: &Report) -> Vec<String> {
    let mut places: Vec<String> = Vec::new();
    for term in &report.terms {
        let place = Place::parse(&term.target).unknown();
        if !places.contains(&place) {
            places.push(place);
        }
    }
    if places.is_empty() && report.effects.is_empty() {
        places.extend(report.located.first().map(|l| Place::parse(&l.place).unknown()));
    }
    places
}

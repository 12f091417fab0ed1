//! The HTML page.

use minijinja::{AutoEscape, Environment, UndefinedBehavior, Value, context};
use serde::Serialize;

use super::check::{ReportError, check};
use super::data::{BeforeAfter, Parameter, Report, Verdict};
use super::number::{self, gap, percent, significant};
use super::picture::{gap_picture, most_telling};
use super::place::{Place, channel_words};
use super::{formula, grammar, heat, limit, robot, signature, stability, words};

const TEMPLATE: &str = include_str!("../../assets/report.html");
const STYLE: &str = include_str!("../../assets/report.css");
const SCRIPT: &str = include_str!("../../assets/report.js");
const UPLOT_SCRIPT: &str = include_str!("../../assets/uPlot.iife.min.js");
const UPLOT_STYLE: &str = include_str!("../../assets/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../../assets/uPlot.LICENSE");

/// Makes the page: a complete HTML document that needs no other file and no network.
///
/// # Errors
/// See [`ReportError`]: data that do not fit together. A page that could not be put together is a defect of this
/// module.
pub fn render(input: &Report) -> Result<String, ReportError> {
    check(input)?;
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    add_filters(&mut environment);
    environment.add_template("report.html", TEMPLATE)?;
    let picture = match most_telling(input) {
        Some((trial, channel)) => gap_picture(input, trial, channel)?,
        None => String::new(),
    };
    let drawing = robot::draw(input);
    let signatures: Vec<Value> = input
        .signatures
        .iter()
        .filter_map(|s| {
            let svg = safe(signature::draw(s)?);
            let [x, y] = signature::titles(s);
            Some(context! { label => s.label, x, y, svg })
        })
        .collect();
    let scale = heat::Scale::of(&input.trials);
    let heat_maps: Vec<_> = input.trials.iter().enumerate().filter_map(|(k, t)| heat::draw(&scale, k, t)).collect();
    let (best, held_out) = words::best_gap(input);
    let whiteness_tested = input.channels.iter().any(|c| c.whiteness.is_some());
    let page = environment.get_template("report.html")?.render(context! {
        style => safe(format!("{UPLOT_STYLE}\n{STYLE}")),
        uplot => safe(format!("/*\n{UPLOT_LICENCE}*/\n{UPLOT_SCRIPT}")),
        script => safe(SCRIPT.to_owned()),
        data => safe(plot_data(input)?),
        title => input.title,
        version => env!("CARGO_PKG_VERSION"),
        summary => words::summary(input),
        verdict => input.verdict,
        effects => input.effects,
        causes => input.effects.iter().filter(|e| e.named).count(),
        alternatives => input.effects.iter().any(|e| !e.alternatives.is_empty()),
        located => input.located,
        terms => input.terms,
        single => single(input),
        gap => input.gap,
        best => best,
        held_out => held_out,
        dumbbells => dumbbells(input, held_out),
        decades => decades(input, held_out),
        channels => input.channels,
        whiteness_tested => whiteness_tested,
        instruments => input.instruments,
        remainder => input.remainder,
        trial_names => input.trials.iter().map(|t| &t.name).collect::<Vec<_>>(),
        has_series => input.trials.iter().any(|t| !t.series.is_empty()),
        signatures => signatures,
        heat_maps => heat_maps,
        heat_key => scale.key(),
        robot => safe(drawing.svg),
        marked => drawing.marked.join(", "),
        scale_note => robot::scale_note(drawing.enlarged),
        picture => safe(picture),
        files => input.files,
        settings => input.settings,
        method => input.method,
        control_runs => words::control_method(input),
        stability => stability::draw(input),
        remarks => input.remarks,
        limits => limits(input),
        at_rest => input.at_rest,
    })?;
    Ok(page)
}

/// A law and from where on it shows.
#[derive(Serialize)]
struct LimitRow<'a> {
    label: &'a str,
    parameter: &'a str,
    shows: String,
    excited: bool,
    shape: &'a [Parameter],
}

fn limits(report: &Report) -> Vec<LimitRow<'_>> {
    let rows = report.limits.iter().map(|limit| LimitRow {
        label: &limit.label,
        parameter: &limit.parameter,
        shows: limit::shows(limit),
        excited: limit.excited,
        shape: &limit.shape,
    });
    rows.collect()
}

/// Whether nothing was added, so that before and after are the same model.
fn single(report: &Report) -> bool {
    report.verdict == Verdict::NoMissingEffect
}

fn safe(text: String) -> Value {
    Value::from_safe_string(text)
}

fn add_filters(environment: &mut Environment<'_>) {
    environment.add_filter("sig", |v: f64, digits: Option<i32>| significant(v, digits.unwrap_or(3)));
    environment.add_filter("plain", number::plain);
    environment.add_filter("gap", gap);
    environment.add_filter("correlation", number::correlation);
    environment.add_filter("percent", percent);
    environment.add_filter("count", |v: usize| number::decimals(v as f64, 0));
    environment.add_filter("strength", words::strength);
    environment.add_filter("capital", |text: &str| grammar::capital(text));
    environment.add_filter("words", |text: &str| text.replace('_', " "));
    environment.add_filter("place", |text: &str| Place::parse(text).noun());
    environment.add_filter("phrase", |text: &str| Place::parse(text).phrase());
    environment.add_filter("channel", |text: &str| channel_words(text));
    environment.add_filter("expression", |text: &str, errors: Vec<f64>| formula::printed(text, &errors));
    environment.add_filter("numbers", |text: &str, errors: Vec<f64>| formula::numbers(text, &errors).join(", "));
    environment.add_filter("quantity", |name: &str, value: f64, error: Option<f64>, unit: &str| {
        number::quantity(name, value, error, unit)
    });
}

/// A channel's gap before and after, with positions on the common logarithmic axis in per cent.
#[derive(Serialize)]
struct Dumbbell {
    channel: String,
    gap: BeforeAfter,
    before_at: f64,
    after_at: f64,
    left: f64,
    width: f64,
}

fn dumbbells(report: &Report, held_out: bool) -> Vec<Dumbbell> {
    let mut rows = vec![("all channels".to_owned(), words::best_gap(report).0)];
    rows.extend(report.gap.channels.iter().filter_map(|c| {
        let gap = if held_out { c.holdout? } else { c.train };
        Some((channel_words(&c.channel), gap))
    }));
    let (low, high) = log_range(report, held_out);
    let at = |v: f64| 100.0 * (v.max(low).log10() - low.log10()) / (high.log10() - low.log10());
    rows.into_iter()
        .map(|(channel, gap)| {
            let (before_at, after_at) = (at(gap.before), at(gap.after));
            let left = before_at.min(after_at);
            Dumbbell { channel, gap, before_at, after_at, left, width: (before_at - after_at).abs() }
        })
        .collect()
}

/// Round values on the dumbbells' axis: position in per cent and text.
fn decades(report: &Report, held_out: bool) -> Vec<(f64, String)> {
    let (low, high) = log_range(report, held_out);
    let span = high.log10() - low.log10();
    [1.0, 10.0, 100.0, 1000.0, 1e4, 1e5]
        .into_iter()
        .filter(|v| *v <= high)
        .map(|v: f64| (100.0 * (v.log10() - low.log10()) / span, significant(v, 1)))
        .collect()
}

/// From a little below the noise floor to a little above the largest gap shown.
fn log_range(report: &Report, held_out: bool) -> (f64, f64) {
    let all = report.gap.channels.iter().filter_map(|c| if held_out { c.holdout } else { Some(c.train) });
    let high = all
        .chain([words::best_gap(report).0])
        .flat_map(|g| [g.before, g.after])
        .filter(|v| v.is_finite())
        .fold(3.0_f64, f64::max);
    (0.7, 1.25 * high)
}

/// What the script plots.
#[derive(Serialize)]
struct PlotData<'a> {
    /// True where the model before and after are the same.
    single: bool,
    channels: Vec<PlotChannel<'a>>,
    trials: Vec<PlotTrial<'a>>,
}

#[derive(Serialize)]
struct PlotChannel<'a> {
    name: &'a str,
    label: String,
    unit: &'a str,
}

#[derive(Serialize)]
struct PlotTrial<'a> {
    name: &'a str,
    holdout: bool,
    time: Vec<f64>,
    series: Vec<PlotSeries<'a>>,
    /// When the place with the largest share of the gap shows: start and end in s.
    spans: Vec<(f64, f64)>,
    edges: &'a [f64],
    rows: Vec<PlotRow<'a>>,
}

#[derive(Serialize)]
struct PlotSeries<'a> {
    channel: &'a str,
    measured: Vec<f64>,
    before: Vec<f64>,
    after: Vec<f64>,
    expected: f64,
}

#[derive(Serialize)]
struct PlotRow<'a> {
    channel: &'a str,
    before: Vec<f64>,
    after: Vec<f64>,
}

/// The plots' numbers as JSON that may stand inside a `<script>` element.
fn plot_data(report: &Report) -> Result<String, ReportError> {
    let channels = report
        .channels
        .iter()
        .map(|c| PlotChannel { name: &c.name, label: channel_words(&c.name), unit: &c.unit })
        .collect();
    let trials = report
        .trials
        .iter()
        .enumerate()
        .map(|(i, t)| PlotTrial {
            name: &t.name,
            holdout: t.holdout,
            time: shortened(&t.time, 9),
            series: t
                .series
                .iter()
                .map(|s| PlotSeries {
                    channel: &s.channel,
                    measured: shortened(&s.measured, 9),
                    before: shortened(&s.before, 9),
                    after: shortened(&s.after, 9),
                    expected: s.expected,
                })
                .collect(),
            spans: report
                .located
                .first()
                .map_or(&[][..], |l| &l.when)
                .iter()
                .filter(|w| w.trial == i)
                .map(|w| (w.start, w.end))
                .collect(),
            edges: &t.residuals.edges,
            rows: t
                .residuals
                .rows
                .iter()
                .map(|r| PlotRow {
                    channel: &r.channel,
                    before: shortened(&r.before, 3),
                    after: shortened(&r.after, 3),
                })
                .collect(),
        })
        .collect();
    let json = serde_json::to_string(&PlotData { single: single(report), channels, trials })?;
    // `</script>` or `<!--` inside a string must not end or change the script element.
    Ok(json.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026"))
}

/// Values to so many significant digits: shorter text, and far below the noise.
fn shortened(values: &[f64], digits: usize) -> Vec<f64> {
    let short = |v: &f64| format!("{v:.*e}", digits - 1).parse().unwrap_or(f64::NAN);
    values.iter().map(short).collect()
}

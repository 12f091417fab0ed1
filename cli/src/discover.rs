//! `cdpr discover`: what a model is missing, from recordings; written as data, model, FMU and report.

use std::fmt::Write as _;
use std::fs;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::Duration;

use anyhow::Context;
use cdpr::model_file::Model;
use cdpr::parameters::CableModel;
use cdpr_discovery::data::{ColumnMap, DataError, Trial, read_trial};
use cdpr_discovery::outcome::{Discovery, Found, Verdict};
use cdpr_discovery::report::{self, FileUsed, Report, Setting};
use cdpr_discovery::write::{self, About, discovery_json, gap_csv};
use cdpr_discovery::{DiscoverError, Geometry, Settings, discover, usual_time_limit};

use crate::failure::BadInput;
use crate::progress::Progress;
use crate::{fmu, model, number, terminal, whole};

/// Find the physical effect that a model is missing, from recordings of the real robot.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr discover --data circle.csv sweep.csv --holdout check.csv --out found\n  \
    cdpr discover --data run.csv --model model.toml --map map.toml --out found\n\n\
    A recording is a table with a header, one row a sample: time (s), winch_force[i] of each cable (N), \
    disturbance_force_x, disturbance_force_y (N), disturbance_torque (N m) where not zero, and any of x, y (m), phi (rad), \
    cable_length[i], unstretched_length[i] (m), tension[i] (N) from which the pose can be told. Inputs are held from \
    row to row; a gap in a measurement is an empty cell or nan. Without --holdout the last part of the longest \
    recording is held out.\n\n\
    Times are seconds, or dates as 2026-05-04T10:20:30.125Z; these and Unix times are counted from the first sample.\n\n\
    A map names the columns of a table from elsewhere and their units. Keys are column, unit, scale and offset; the value is \
    scale * unit * cell + offset, offset in SI:\n  \
    time = { column = \"t\", unit = \"ms\" }\n  \
    phi = { column = \"yaw\", unit = \"degrees\" }\n  \
    \"winch_force[1]\" = { column = \"F1\", unit = \"kN\", scale = -1 }\n  \
    \"winch_force[2]\" = { column = \"I2\", unit = \"A\", scale = 85 }      (newtons an ampere)\n  \
    x = \"pos_x\"\n\
    Units: s ms us ns min h; m mm cm um km in ft; rad mrad deg (degrees) rev; N kN MN daN kgf lbf; N.m kN.m; and with a scale \
    A mA V mV counts %.\n\n\
    Before the search the recordings are checked against the model: units, signs, exchanged columns, origins, frames, clocks. \
    What is clearly wrong ends with exit code 2 and says what to write in the map. More in docs/recordings.md.\n\n\
    Into DIR go report.html, discovery.json, model.toml (the model with what was found), CablePlatform.fmu (the same, \
    packed) and gap.csv (the numbers behind the plots).")]
pub(crate) struct Arguments {
    /// Recordings to search
    #[arg(long, value_name = "FILE.csv", num_args = 1.., required = true)]
    data: Vec<PathBuf>,
    /// Recordings that are not fitted: an effect must earn its place on them
    #[arg(long, value_name = "FILE.csv", num_args = 1..)]
    holdout: Vec<PathBuf>,
    /// The model as it is; the default model without it
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Columns and units of the recordings, where they are not ours
    #[arg(long, value_name = "FILE.toml")]
    map: Option<PathBuf>,
    /// Search with the geometry as it is given, and all poses as measured; without it errors of anchors, attachments and what
    /// lengths count from are found together with the laws, where they explain most of what laws alone leave, and before them where
    /// lengths without a pose cannot be read by it; and a pose that was computed from lengths is left out
    #[arg(long)]
    as_given: bool,
    /// Minutes after which the search ends and what it has found is written, which takes a little longer; without it 8, and more
    /// in proportion where there are more than 15000 rows
    #[arg(long, value_name = "MINUTES", value_parser = number::positive)]
    time_limit: Option<f64>,
    /// Folder for the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let (_, base) = model::read(arguments.model.as_deref())?;
    let cables = base.parameters.cables();
    let map = match &arguments.map {
        Some(path) => ColumnMap::read(path, cables).map_err(bad_data)?,
        None => ColumnMap::default(),
    };
    let read = |paths: &[PathBuf]| -> Result<Vec<Trial>, BadInput> {
        paths.iter().map(|p| read_trial(p, &map, cables).map_err(bad_data)).collect()
    };
    let train = read(&arguments.data)?;
    let holdout = read(&arguments.holdout)?;
    if arguments.out.exists() && !arguments.out.is_dir() {
        return Err(BadInput::in_file(&arguments.out, "a file, expected a folder").into());
    }
    fmu::try_temporary_folder()?;
    model::folder(&arguments.out)?;
    let geometry = if arguments.as_given { Geometry::AsGiven } else { Geometry::Corrected };
    let time_limit = match arguments.time_limit {
        Some(minutes) => Duration::try_from_secs_f64(60.0 * minutes).unwrap_or(Duration::MAX),
        None => usual_time_limit(train.iter().chain(&holdout)),
    };
    let settings = Settings { geometry, time_limit: Some(time_limit) };
    let discovery = search(&base, train, holdout, settings)?;
    let results = write_results(&discovery, about(arguments, &base, discovery.horizon), &arguments.out)?;
    let mut out = terminal::out();
    write!(out, "{}", results.summary)?;
    writeln!(out, "\nWritten:")?;
    let width = results.files.iter().map(|file| file.path.chars().count()).max().unwrap_or_default();
    for FileUsed { path, role } in &results.files {
        writeln!(out, "  {path:<width$}  {role}")?;
    }
    Ok(())
}

fn bad_data(error: DataError) -> BadInput {
    BadInput(error.to_string())
}

/// Searches, with a progress bar.
pub(crate) fn search(
    base: &Model,
    train: Vec<Trial>,
    holdout: Vec<Trial>,
    settings: Settings,
) -> anyhow::Result<Discovery> {
    let progress = Mutex::new(Progress::new("searching"));
    let tell = |message: &str, share: f64| {
        // A panic in another thread ends the work; its bar does not matter any more.
        if let Ok(mut progress) = progress.lock() {
            progress.tell(message, share);
        }
    };
    discover(base, train, holdout, settings, &tell).map_err(|error| match error {
        DiscoverError::Data(message) => BadInput(message).into(),
        DiscoverError::Fit(_) => error.into(),
    })
}

fn about(arguments: &Arguments, base: &Model, horizon: f64) -> About {
    let list = |role: &'static str, paths: &[PathBuf]| -> Vec<FileUsed> {
        paths.iter().map(|path| file(role, path)).collect()
    };
    let mut files = list("training data", &arguments.data);
    files.extend(list("held-out data", &arguments.holdout));
    files.extend(arguments.model.iter().map(|path| file("model as given", path)));
    files.extend(arguments.map.iter().map(|path| file("column map", path)));
    About { title: title(&arguments.data), files, settings: settings(base, horizon) }
}

fn file(role: &str, path: &Path) -> FileUsed {
    FileUsed { role: role.to_owned(), path: path.display().to_string() }
}

/// The first recordings' names.
fn title(data: &[PathBuf]) -> String {
    let name = |path: &PathBuf| path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    match data {
        [] => String::new(),
        [one] => name(one),
        [one, two] => format!("{} and {}", name(one), name(two)),
        [one, rest @ ..] => format!("{} and {} more recordings", name(one), rest.len()),
    }
}

/// What the report lists as settings, the main horizon (s) among them.
pub(crate) fn settings(base: &Model, horizon: f64) -> Vec<Setting> {
    let cable_model = match base.parameters.cable_model {
        CableModel::Rigid => "rigid",
        CableModel::MasslessSpring => "massless_spring",
        CableModel::LumpedMass => "lumped_mass",
    };
    [("cable model", cable_model.to_owned()), ("main horizon", format!("{horizon} s"))]
        .map(|(name, value)| Setting { name: name.to_owned(), value })
        .to_vec()
}

/// What was written, and the summary for the terminal.
pub(crate) struct Results {
    pub(crate) summary: String,
    pub(crate) files: Vec<FileUsed>,
    pub(crate) report: Report,
}

/// Writes every file of a discovery into a folder, each whole or not at all.
pub(crate) fn write_results(discovery: &Discovery, mut about: About, out: &Path) -> anyhow::Result<Results> {
    let place = |name: &str| out.join(name);
    let model_toml = discovery.model.to_toml();
    let found = match (discovery.verdict, &discovery.survey[..]) {
        (Verdict::NoMissingEffect, _) if !discovery.not_shown.is_empty() => "the model without what does not show",
        (Verdict::NoMissingEffect, []) => "the model, nothing added",
        (Verdict::NoMissingEffect, _) => "the model, its geometry corrected",
        _ => "the model with what was found",
    };
    let files = [
        ("report.html", "the report, for a browser"),
        ("discovery.json", "the result, for programs"),
        ("model.toml", found),
        ("CablePlatform.fmu", "the same as an FMU"),
        ("gap.csv", "the numbers behind the plots"),
    ]
    .map(|(name, role)| file(role, &place(name)));
    about.files.extend(files.clone());
    let report = write::report(discovery, &about);
    let page = report::render(&report)?;
    // Should writing end half-way, no older report stands beside a newer model.
    for file in &files {
        remove_older(Path::new(&file.path))?;
    }
    whole::write(&place("model.toml"), &model_toml)?;
    whole::write(&place("gap.csv"), gap_csv(discovery))?;
    whole::write(&place("report.html"), page)?;
    whole::write(&place("discovery.json"), discovery_json(discovery)?)?;
    // Last: packing needs more than this folder, and what was found is not lost with it.
    fmu::pack(&model_toml, &[], &place("CablePlatform.fmu"))?;
    Ok(Results { summary: summary(discovery, &report, &place("discovery.json")), files: files.to_vec(), report })
}

/// Removes a file of an earlier run, if there is one.
fn remove_older(path: &Path) -> anyhow::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("{}: the file of an earlier run cannot be removed", path.display()))
        }
        _ => Ok(()),
    }
}

/// The result on one screen; `json` is where it is written for programs.
fn summary(discovery: &Discovery, report: &Report, json: &Path) -> String {
    let words = report::summary(report);
    let mut text = format!("{}\n\n", words.headline);
    let mut line = |key: &str, value: &str| {
        let _ = writeln!(text, "  {key:<12} {value}");
    };
    line("verdict", words.badge);
    for found in &discovery.effects {
        line(if found.named { "effect" } else { "candidate" }, &found_text(found));
        if let Some(given) = &found.given {
            line("  as given", &sized(given, &write::parameters(given, &[])));
        }
        for twin in found.alternatives.iter().filter(|a| a.indistinguishable) {
            let sizes = write::parameters(&twin.effect, &[]);
            line("  or", &format!("{}  (ΔBIC {})", sized(&twin.effect, &sizes), signed(twin.delta_bic)));
            line("", &format!("to tell: {}", twin.separate_by));
        }
    }
    for term in &discovery.terms {
        line("term", &found_text(term));
    }
    if discovery.verdict == Verdict::Ambiguous {
        let command = format!("cdpr experiment --from {} --limits limits.toml -o plan.csv", json.display());
        line("plan it", &format!("{command}  (cdpr experiment --help shows limits.toml)"));
    }
    for located in report::gather(&report.located, report.robot.anchors.len()).iter().take(3) {
        let depends = if located.depends_on.is_empty() {
            String::new()
        } else {
            format!(", depends on {}", located.depends_on.join(", "))
        };
        line("where", &format!("{} ({:.0} % of the gap{depends})", located.place, 100.0 * located.share_of_gap));
    }
    let (set, source) = match report.gap.holdout {
        Some(_) => ("held-out data", format!(" ({})", report.gap.holdout_source)),
        None => ("fitted data", String::new()),
    };
    line("gap", &format!("on {set}{source}; 1 is the noise of the measurements"));
    for horizon in &report.gap.horizons {
        let gap = horizon.holdout.unwrap_or(horizon.train);
        let change = format!("{:>6} -> {}", report::gap_text(gap.before), report::gap_text(gap.after));
        line("", &format!("{:>4} s ahead {change}", horizon.horizon_s));
    }
    let rest = &report.remainder;
    let number = |value: f64| report::significant(value, 2);
    let before = |value: Option<f64>| value.map_or(String::new(), |v| format!(" (before: {})", number(v)));
    line(
        "unexplained",
        &format!(
            "{} N{}, {} N m{}",
            number(rest.force),
            before(rest.force_before),
            number(rest.torque),
            before(rest.torque_before)
        ),
    );
    if let Some(runs) = report::control_runs(report) {
        line("chance", &runs);
    }
    if discovery.verdict == Verdict::NoMissingEffect {
        if let Some(list) = report::would_show(report) {
            line("would show", &format!("{list}; all in the report"));
        }
        if let Some(list) = report::not_excited(report) {
            line("cannot tell", &list);
        }
    }
    for remark in &report.remarks {
        line("remark", remark);
    }
    // Spaces that do not break are for pages.
    text.replace(['\u{a0}', '\u{202f}'], " ")
}

fn found_text(found: &Found) -> String {
    let text = match &found.effect.expression {
        Some(term) => format!("on {}: {}", write::place(&found.effect), report::term(term, &write::errors(found))),
        None => sized(&found.effect, &write::sizes(found)),
    };
    format!("{text}  (ΔBIC {})", signed(found.delta_bic))
}

/// `winch_coulomb_friction on winch[3]: force 180.2 ± 1.9 N`.
fn sized(effect: &cdpr::effect::EffectSpec, parameters: &[report::Parameter]) -> String {
    let place = write::place(effect);
    let list: Vec<String> = parameters
        .iter()
        .map(|p| {
            format!("{} {}", p.name.replace('_', " "), report::quantity(&p.name, p.value, p.standard_error, &p.unit))
        })
        .collect();
    format!("{}: {}", report::phrase(&effect.id, &place), list.join(", "))
}

fn signed(value: f64) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", report::significant(value, 3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_of_an_earlier_run_is_removed_and_a_missing_one_is_no_error() {
        let folder = tempfile::tempdir().unwrap();
        let report = folder.path().join("report.html");
        fs::write(&report, "old").unwrap();
        remove_older(&report).unwrap();
        assert!(!report.exists());
        remove_older(&report).unwrap();
        fs::create_dir(&report).unwrap();
        assert!(remove_older(&report).unwrap_err().to_string().contains("report.html: the file of an earlier run"));
    }
}

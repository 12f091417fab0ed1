//! `cdpr experiment`: the motion, within limits, that tells apart what a discovery left open.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use cdpr::signal::indexed;
use cdpr_discovery::experiment::{Aim, Expected, Limits, Lowered, Plan, PlanError, Used, plan};
use cdpr_discovery::report;
use cdpr_discovery::write;
use cdpr_fmu_build::whole_file;

use crate::failure::BadInput;
use crate::progress::Progress;
use crate::whole::WholeFile;
use crate::{model, output, terminal};

/// A file of more bytes than this is taken for something else.
const LARGEST: u64 = 1 << 28;

/// Plan the motion that tells apart what `cdpr discover` could not, or that shows smaller effects.
#[derive(clap::Args)]
#[command(after_help = "Examples:\n  \
    cdpr experiment --from found/discovery.json --limits limits.toml -o plan.csv\n  \
    cdpr experiment --from found/discovery.json --lower winch_viscous_friction@3 --limits limits.toml -o plan.csv\n\n\
    limits.toml says what the machine may do; unknown keys are errors:\n  \
    x = [-20.0, 20.0]                # m\n  \
    y = [-20.0, 20.0]                # m\n  \
    phi = [-0.1, 0.1]                # rad\n  \
    speed = 1.0                      # m/s, of the platform\n  \
    angular_speed = 0.03             # rad/s\n  \
    tension = [3000.0, 45000.0]      # N, of each cable\n  \
    duration = 100.0                 # s\n  \
    interval = 0.02                  # s, from sample to sample\n  \
    start = [0.0, 0.0, 0.0]          # optional: where the machine stands (m, m, rad), else the model's start\n  \
    fastest = 0.16                   # optional: highest frequency of the motion (Hz), else the robot's own\n  \
    [noise]                          # optional: white noise of a sensor, else what the recordings had\n  \
    unstretched_length = 0.001       # m, all cables; \"unstretched_length[2]\" for one\n\n\
    The plan is a table of time (s), pose, speed and acceleration asked for (x, y, phi, vx, vy, omega, ax, ay, alpha), winch_force[i] (N) by \
    which the model follows, held from row to row, and tension[i] (N). cdpr inverse --trajectory and cdpr simulate --input read \
    it. Drive the machine along it twice, tensions as in the plan, and give cdpr discover one recording as --data, the other as \
    --holdout.\n\n\
    Where no motion within the limits is expected to tell anything apart, nothing is written and the exit code is 1. More in \
    docs/experiment.md.")]
pub(crate) struct Arguments {
    /// What `cdpr discover` wrote
    #[arg(long, value_name = "discovery.json")]
    from: PathBuf,
    /// What the machine may do
    #[arg(long, value_name = "limits.toml")]
    limits: PathBuf,
    /// The model with what was found; without it the model.toml beside the discovery
    #[arg(long, value_name = "FILE.toml")]
    model: Option<PathBuf>,
    /// Lower the detection limits of an effect instead: its id, and the cable where it is one
    #[arg(long, value_name = "EFFECT[@CABLE]", value_parser = aim)]
    lower: Option<Aim>,
    /// Table of the motion
    #[arg(short, long, value_name = "PLAN.csv", value_parser = output::table())]
    output: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let discovery = text(&arguments.from, "a discovery.json of cdpr discover")?;
    let limits = text(&arguments.limits, "limits of a motion")?;
    let bad_limits = |error: PlanError| BadInput::in_file(&arguments.limits, error);
    let limits = Limits::from_toml(&limits).map_err(bad_limits)?;
    let beside = arguments.from.with_file_name("model.toml");
    let (_, found) = model::read(Some(arguments.model.as_ref().unwrap_or(&beside)))?;
    let progress = Mutex::new(Progress::new("planning"));
    let tell = |message: &str, share: f64| {
        // A panic in another thread ends the work; its bar does not matter any more.
        if let Ok(mut progress) = progress.lock() {
            progress.tell(message, share);
        }
    };
    let aim = arguments.lower.clone().unwrap_or(Aim::TellApart);
    let planned = plan(&discovery, &found, &limits, &aim, &tell).map_err(|error| match error {
        PlanError::Limits(_) => anyhow::Error::from(bad_limits(error)),
        PlanError::Discovery(_) => BadInput::in_file(&arguments.from, error).into(),
        PlanError::NothingOpen(_) => {
            BadInput::in_file(&arguments.from, format!("{error}; an experiment is planned for the verdict `ambiguous`, or with --lower EFFECT for a detection limit"))
                .into()
        }
        PlanError::Drive(_) => error.into(),
    })?;
    drop(progress);
    let table = table(&planned);
    let serves = planned.pairs.iter().any(Expected::told_apart) || planned.lowered.iter().any(Lowered::better);
    if !serves {
        let what = match aim {
            Aim::TellApart => "tell the explanations apart",
            Aim::Lower { .. } => "show smaller effects",
        };
        let advice = advice(&planned);
        let tried = planned.tried;
        anyhow::bail!(
            "no motion within these limits is expected to {what}; the best of {tried} does this:\n{table}\n{advice}"
        );
    }
    write_plan(&planned, &arguments.output)?;
    if whole_file::is_stream(&arguments.output) {
        return Ok(());
    }
    let mut out = terminal::out();
    write!(out, "{table}")?;
    if planned.pairs.iter().any(|pair| !pair.told_apart()) {
        write!(out, "\nNot all are told apart. {}", advice(&planned))?;
    }
    writeln!(out, "\nWritten: {}", arguments.output.display())?;
    writeln!(
        out,
        "Record it twice, then: cdpr discover --data first.csv --holdout second.csv --out DIR, with the model as it was given"
    )?;
    Ok(out.flush()?)
}

/// An effect of which smaller sizes are to show: `winch_lag`, or `winch_lag@2` on one cable.
fn aim(text: &str) -> Result<Aim, String> {
    let (id, cable) = match text.split_once('@') {
        None => (text, None),
        Some((id, cable)) => match cable.parse::<usize>() {
            Ok(cable) if cable > 0 => (id, Some(cable)),
            _ => return Err(format!("{cable:?} is no cable, expected a number from 1 on")),
        },
    };
    match cdpr::effect::find(id) {
        Some(_) => Ok(Aim::Lower { id: id.to_owned(), cable }),
        None => Err(format!("no effect has the id {id:?}; cdpr effects lists them")),
    }
}

/// The text of a file.
fn text(path: &Path, expected: &str) -> Result<String, BadInput> {
    let mut text = String::new();
    let read = File::open(path).and_then(|file| file.take(LARGEST).read_to_string(&mut text));
    read.map_err(|error| match error.kind() {
        ErrorKind::InvalidData => BadInput::in_file(path, format!("not a text, expected {expected}")),
        _ => BadInput::in_file(path, error),
    })?;
    Ok(text)
}

fn write_plan(plan: &Plan, path: &Path) -> anyhow::Result<()> {
    let cables = plan.rows.first().map_or(0, |row| row.tension.len());
    let mut csv = csv::Writer::from_writer(WholeFile::create(path)?);
    let motion = ["time", "x", "y", "phi", "vx", "vy", "omega", "ax", "ay", "alpha"];
    let mut header: Vec<String> = motion.map(str::to_owned).to_vec();
    for name in ["winch_force", "tension"] {
        header.extend((0..cables).map(|i| indexed(name, i)));
    }
    csv.write_record(&header)?;
    for row in &plan.rows {
        let numbers = std::iter::once(row.time).chain(row.motion.into_iter().flatten());
        let all = numbers.chain(row.winch_force).chain(row.tension);
        csv.write_record(all.map(|value| format!("{value:?}")))?;
    }
    csv.into_inner().map_err(csv::IntoInnerError::into_error)?.finish()
}

/// What is expected, and what the motion uses of the limits.
fn table(plan: &Plan) -> String {
    let mut text = String::new();
    let mut line = |cells: [&str; 5]| {
        let [pair, now, planned, asked, note] = cells;
        let row = format!("{pair:<58} {now:>9} {planned:>9} {asked:>9}  {note}");
        let _ = writeln!(text, "{}", row.trim_end());
    };
    let number = |value: f64| report::significant(value, 3);
    if !plan.pairs.is_empty() {
        line(["difference of the criterion, if the first is true", "so far", "planned", "asked", ""]);
    }
    for pair in &plan.pairs {
        let of = |effect: &cdpr::effect::EffectSpec| report::phrase(&effect.id, &write::place(effect));
        let note = if pair.told_apart() { "told apart" } else { "open" };
        let names = format!("{} against {}", of(&pair.truth), of(&pair.rival)).replace(['\u{a0}', '\u{202f}'], " ");
        let now = pair.now.map_or(String::new(), number);
        line([&names, &now, &number(pair.planned), &number(pair.asked), note]);
    }
    if !plan.lowered.is_empty() {
        line(["smallest size that shows", "so far", "planned", "", ""]);
    }
    for limit in &plan.lowered {
        let size = |size: Option<f64>| size.map_or("nothing".to_owned(), number);
        let place = limit.cable.map_or(String::new(), |cable| format!(" on cable {cable}"));
        let name = format!("{}{place}: {} ({})", limit.id, limit.parameter, limit.unit);
        let note = if limit.at_most { "shows up to this size" } else { "" };
        line([&name, &size(limit.now), &size(limit.planned), "", note]);
    }
    let _ = writeln!(text);
    for Used { name, unit, range, limit } in &plan.used {
        let [low, high] = range.map(number);
        let [least, most] = limit.map(number);
        let _ = writeln!(text, "{name:<14} {low:>10} to {high:>10} {unit:<6} of {least} to {most}");
    }
    text
}

/// What to change where not all is told apart.
fn advice(plan: &Plan) -> String {
    let binding: Vec<&str> = plan.used.iter().filter(|used| used.binds()).map(|used| used.name).collect();
    if binding.is_empty() {
        return "No limit binds: a longer recording or less noise tells more; what no motion tells apart is the same for this \
                robot.\n"
            .to_owned();
    }
    format!(
        "The limits that bind: {}. Wider ones or a longer recording may tell more; what comes to nothing is the same for this robot \
         along every motion.\n",
        binding.join(", ")
    )
}

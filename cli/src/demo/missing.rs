//! Second chapter: effects hidden in recordings are found, named, added, and the gap shrinks.

use std::io::Write;
use std::path::Path;

use anyhow::Context;
use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use cdpr_discovery::data::{ColumnMap, read_trial};
use cdpr_discovery::outcome::{Compared, Discovery};
use cdpr_discovery::report::{self, FileUsed, Report};
use cdpr_discovery::write::{self, About};
use cdpr_discovery::{Geometry, Settings};
use cdpr_fmu_build::temporary::TemporaryFolder;

use super::Made;
use super::importer::Fmu;
use super::record::{LENGTH_NOISE, POSE_NOISE, Plan, STEP, record};
use super::replay;
use crate::discover::{Results, search, settings, write_results};
use crate::{fmu, model, terminal, whole};

/// The recording that is searched, and the one held back.
const RECORDINGS: [(&str, Plan); 2] =
    [("recording.csv", Plan { duration: 80.0, seed: 7 }), ("check.csv", Plan { duration: 50.0, seed: 8 })];

/// What the robot has and the model does not.
fn hidden() -> anyhow::Result<Vec<EffectSpec>> {
    Ok(vec![
        EffectSpec::new("winch_coulomb_friction", Some(3), &[180.0, 0.02])?,
        EffectSpec::new("platform_quadratic_drag", None, &[60.0, 0.0, 0.0])?,
    ])
}

/// Records, searches, adds, and shows that the gap shrinks, through FMI too.
pub(super) fn tell(out: &Path) -> anyhow::Result<Vec<Made>> {
    let folder = out.join("missing_effect");
    model::folder(&folder)?;
    let base = Model::default();
    let robot = Model { effects: hidden()?, ..Model::default() };
    let paths = RECORDINGS.map(|(name, _)| folder.join(name));
    for ((_, plan), path) in RECORDINGS.iter().zip(&paths) {
        record(&robot, &base, plan, path)?;
    }
    introduce()?;
    let read = |path: &Path| read_trial(path, &ColumnMap::default(), base.parameters.cables());
    // The same on every machine, however slow.
    let search_settings = Settings { geometry: Geometry::Corrected, time_limit: None };
    let discovery = search(&base, vec![read(&paths[0])?], vec![read(&paths[1])?], search_settings)?;
    let file = |role: &str, path: &Path| FileUsed { role: role.to_owned(), path: path.display().to_string() };
    let about = About {
        title: "demonstration on generated recordings".to_owned(),
        files: vec![file("training data", &paths[0]), file("held-out data", &paths[1])],
        settings: settings(&base, discovery.horizon),
    };
    let results = write_results(&discovery, about, &folder)?;
    let picture = folder.join("gap.svg");
    let (trial, channel) = report::most_telling(&results.report).context("no recording to draw")?;
    whole::write(&picture, report::gap_picture(&results.report, trial, channel)?)?;
    found(&robot, &discovery, &results)?;
    through_fmi(&base, &discovery, &results.report, &folder)?;
    let [recording, check] = paths;
    Ok(vec![
        Made { path: folder.join("report.html"), what: "the report; open it in a browser" },
        Made { path: folder.join("CablePlatform.fmu"), what: "the FMU with what was found" },
        Made { path: folder.join("model.toml"), what: "the model inside" },
        Made { path: picture, what: "how the gap shrinks, as a picture" },
        Made { path: folder.join("gap.csv"), what: "the numbers behind it" },
        Made { path: folder.join("discovery.json"), what: "the result, for programs" },
        Made { path: recording, what: "the recording that was searched" },
        Made { path: check, what: "the recording held back" },
    ])
}

fn introduce() -> anyhow::Result<()> {
    let [(_, search), (_, check)] = &RECORDINGS;
    let mut out = terminal::out();
    writeln!(out, "\nNow a robot that is not quite the model: winch 3 rubs, and the air brakes the platform.")?;
    writeln!(
        out,
        "Under control it follows a path of a few metres for {} s, and another for {} s that is held back. Recorded",
        search.duration, check.duration
    )?;
    writeln!(
        out,
        "{:.0} times a second: the winch forces, the pose to {:.0} mm and {:.2} mrad, the paid-out cables to {:.0} mm.",
        1.0 / STEP,
        1e3 * POSE_NOISE[0],
        1e3 * POSE_NOISE[2],
        1e3 * LENGTH_NOISE
    )?;
    writeln!(out, "The model as it stands and the recordings are all that `cdpr discover` gets. It finds:\n")?;
    Ok(out.flush()?)
}

/// The summary, and what was found beside what was hidden.
fn found(robot: &Model, discovery: &Discovery, results: &Results) -> anyhow::Result<()> {
    let mut out = terminal::out();
    writeln!(out, "{}", results.summary)?;
    writeln!(out, "What was hidden, and what was found:")?;
    for effect in &robot.effects {
        let same = discovery.effects.iter().find(|f| f.effect.id == effect.id && f.effect.cable == effect.cable);
        let fitted = same.map(|f| write::parameters(&f.effect, &f.standard_error));
        for (k, p) in write::parameters(effect, &[]).iter().enumerate() {
            let hidden = report::quantity(&p.name, p.value, None, &p.unit);
            let found = match fitted.as_ref().and_then(|list| list.get(k)) {
                Some(p) => report::quantity(&p.name, p.value, p.standard_error, &p.unit),
                None => "not found".to_owned(),
            };
            let name = format!("{}, {}", effect.id, p.name);
            let line = format!("  {name:<42} {hidden:>14}   {found}");
            writeln!(out, "{}", line.replace(['\u{a0}', '\u{202f}'], " "))?;
        }
    }
    Ok(())
}

/// Drives the FMUs without and with what was found over the recording held back.
fn through_fmi(base: &Model, discovery: &Discovery, shown: &Report, folder: &Path) -> anyhow::Result<()> {
    let as_given = TemporaryFolder::new()?;
    let before = as_given.path().join("CablePlatform.fmu");
    fmu::pack(&base.to_toml(), &[], &before)?;
    let held_back = discovery.trials.iter().find(|t| t.holdout).context("no recording was held back")?;
    let noise: Vec<f64> = held_back
        .trial
        .channels
        .iter()
        .map(|c| shown.channels.iter().find(|s| s.name == c.name()).map_or(f64::NAN, |s| s.noise))
        .collect();
    let by_fmi = |path: &Path, states: fn(&Compared) -> &Vec<Vec<f64>>| {
        replay::gap(&Fmu::open(path)?, held_back, states(held_back), &noise)
    };
    let before = by_fmi(&before, |t| &t.before)?;
    let after = by_fmi(&folder.join("CablePlatform.fmu"), |t| &t.after)?;
    let mut out = terminal::out();
    writeln!(out, "\nThe same through FMI, the FMU running free for 5 s at a time over the recording held back:")?;
    writeln!(out, "  the FMU of the model as it was is off by {} times the noise,", report::gap_text(before))?;
    writeln!(out, "  the FMU with what was found by {}.", report::gap_text(after))?;
    Ok(())
}

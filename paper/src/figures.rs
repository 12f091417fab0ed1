//! The figures in the paper's layout, and the numbers behind them.

use std::path::Path;

use crate::CABLES;

use crate::figure::{BLUE, Column, Figure, GREEN, Line, ORANGE, Panel};
use crate::run::{Area, Inverse, Series};
use crate::{PaperError, Runs, write_whole};

/// Of the inverse dynamics every tenth instant is shown, 0.1 s apart.
const SHOWN: usize = 10;

const AXES: [(&str, usize); 3] = [("x (m)", 0), ("y (m)", 1), ("φ (rad)", 2)];

/// Panels of x, y and φ of several runs, and of the strains of one.
fn pose_and_strain(runs: &[(&str, plotters::style::RGBColor, bool, &Series)], strained: &Series) -> Vec<Panel> {
    let mut panels: Vec<Panel> = AXES
        .iter()
        .map(|(label, k)| {
            let lines = runs
                .iter()
                .map(|(name, colour, dashed, series)| {
                    let line = Line::new(name, *colour, &series.time, series.coordinate(*k));
                    if *dashed { line.dashed() } else { line }
                })
                .collect();
            Panel::new(label, lines)
        })
        .collect();
    // One legend is enough for panels with the same lines.
    for panel in &mut panels[1..] {
        panel.lines.iter_mut().for_each(|l| l.label.clear());
    }
    panels.push(strain(strained));
    panels
}

fn strain(series: &Series) -> Panel {
    Panel::new("strain", Line::of_cables(&series.time, |i| series.strain(i)))
}

/// Twelve digits, nothing where there is no number.
fn number(value: f64) -> String {
    if !value.is_finite() {
        return String::new();
    }
    let rounded: f64 = format!("{value:.11e}").parse().unwrap_or(value);
    if rounded != 0.0 && rounded.abs() < 1e-5 { format!("{rounded:e}") } else { rounded.to_string() }
}

fn table(folder: &Path, name: &str, columns: &[(&str, &Series)]) -> Result<(), PaperError> {
    let path = folder.join(format!("{name}.csv"));
    let failed = |error: &dyn std::fmt::Display| PaperError::Write {
        path: path.clone(),
        error: std::io::Error::other(error.to_string()),
    };
    let mut csv = csv::Writer::from_writer(Vec::new());
    let mut header = vec!["run".to_owned(), "time".to_owned(), "x".to_owned(), "y".to_owned(), "phi".to_owned()];
    for what in ["cable_length", "unstretched_length", "tension"] {
        header.extend((1..=CABLES).map(|i| format!("{what}[{i}]")));
    }
    csv.write_record(&header).map_err(|e| failed(&e))?;
    for (run, s) in columns {
        for k in 0..s.time.len() {
            let mut row = vec![(*run).to_owned(), number(s.time[k])];
            row.extend(s.pose[k].map(number));
            for values in [s.length[k], s.unstretched[k], s.tension[k]] {
                row.extend(values.iter().copied().map(number));
            }
            csv.write_record(&row).map_err(|e| failed(&e))?;
        }
    }
    let bytes = csv.into_inner().map_err(|e| failed(&e))?;
    write_whole(&path, &bytes)
}

fn inverse_table(folder: &Path, name: &str, run: &Inverse) -> Result<(), PaperError> {
    let path = folder.join(format!("{name}.csv"));
    let mut text = String::from("time,x,y,phi");
    for what in ["tension", "unstretched_length", "unstretched_length_rate", "winch_force"] {
        (1..=CABLES).for_each(|i| text += &format!(",{what}[{i}]"));
    }
    text.push('\n');
    for instant in run.instants.iter().step_by(SHOWN) {
        let pose = instant.motion.derivative(0);
        let mut row = vec![instant.time];
        row.extend(pose);
        for values in [&instant.tension, &instant.unstretched, &instant.unstretched_rate, &instant.winch_force] {
            row.extend(values);
        }
        text += &row.into_iter().map(number).collect::<Vec<_>>().join(",");
        text.push('\n');
    }
    write_whole(&path, text.as_bytes())
}

pub(crate) fn write(folder: &Path, runs: &Runs) -> Result<(), PaperError> {
    fig8(folder, runs)?;
    fig9(folder, runs)?;
    inverse(folder, runs)?;
    massless(folder, runs)
}

fn fig8(folder: &Path, runs: &Runs) -> Result<(), PaperError> {
    for (name, area, lumped, mismatch) in [
        ("fig8", Area::Physical, &runs.lumped, &runs.mismatch_lumped),
        ("fig8_area_as_printed", Area::Printed, &runs.lumped_printed, &runs.mismatch_printed),
    ] {
        let figure = Figure {
            title: format!(
                "Fig. 8: released at rest at [0.1 m, 0.1 m, 0.1 rad] under 1 kN in each cable ({})",
                area.name()
            ),
            columns: vec![
                Column {
                    title: "consistent signs, until a cable meets the platform".to_owned(),
                    panels: pose_and_strain(
                        &[("rigid", BLUE, false, &runs.rigid), ("elastic", ORANGE, true, lumped)],
                        lumped,
                    ),
                },
                Column {
                    title: "moment row with the opposite sign: the paper's picture".to_owned(),
                    panels: pose_and_strain(
                        &[("rigid", BLUE, false, &runs.mismatch_rigid), ("elastic", ORANGE, true, mismatch)],
                        mismatch,
                    ),
                },
            ],
        };
        figure.write(folder, name)?;
        let rows = [
            ("rigid", &runs.rigid),
            ("elastic", lumped),
            ("mismatch_rigid", &runs.mismatch_rigid),
            ("mismatch_elastic", mismatch),
        ];
        table(folder, name, &rows)?;
    }
    Ok(())
}

fn fig9(folder: &Path, runs: &Runs) -> Result<(), PaperError> {
    let column = |area: Area, lumped: &Series| {
        let y = |label: &str, colour, series: &Series| Line::new(label, colour, &series.time, series.coordinate(1));
        let lag = runs.pull_rigid.pose.iter().zip(&lumped.pose).map(|(r, e)| e[1] - r[1]);
        Column {
            title: area.name().to_owned(),
            panels: vec![
                Panel::new("y (m)", vec![y("rigid", BLUE, &runs.pull_rigid), y("elastic", ORANGE, lumped).dashed()]),
                Panel::new("y elastic - y rigid (m)", vec![Line::new("", GREEN, &lumped.time, lag)]),
                strain(lumped),
            ],
        }
    };
    let figure = Figure {
        title: "Fig. 9: cables 1 and 2 pulled with 1 kN, cables 3 and 4 with nothing".to_owned(),
        columns: vec![column(Area::Physical, &runs.pull_lumped), column(Area::Printed, &runs.pull_lumped_printed)],
    };
    figure.write(folder, "fig9")?;
    let rows = [
        ("rigid", &runs.pull_rigid),
        ("massless_spring", &runs.pull_massless),
        ("elastic", &runs.pull_lumped),
        ("elastic_area_as_printed", &runs.pull_lumped_printed),
    ];
    table(folder, "fig9", &rows)
}

fn inverse(folder: &Path, runs: &Runs) -> Result<(), PaperError> {
    let time: Vec<f64> = runs.inverse_lumped.instants.iter().step_by(SHOWN).map(|i| i.time).collect();
    let of = |run: &Inverse, pick: &dyn Fn(&cdpr::inverse::Instant, usize) -> f64| {
        Line::of_cables(&time, |i| run.instants.iter().step_by(SHOWN).map(move |at| pick(at, i)))
    };
    let unlabelled = |lines: Vec<Line>| lines.into_iter().map(Line::unlabelled).collect::<Vec<_>>();
    let difference = |elastic: &Inverse| {
        unlabelled(Line::of_cables(&time, |i| {
            let pairs = elastic.instants.iter().zip(&runs.inverse_rigid.instants).step_by(SHOWN);
            pairs.map(move |(e, r)| e.winch_force[i] - r.winch_force[i])
        }))
    };
    let position = |k: usize| {
        runs.inverse_lumped.instants.iter().step_by(SHOWN).map(move |i| i.motion.pose[k][0]).collect::<Vec<_>>()
    };
    let figure = Figure {
        title: "Inverse dynamics: winch forces of a prescribed motion under a gust".to_owned(),
        columns: vec![
            Column {
                title: "motion, tensions between 0.5 and 2.5 kN, winch forces".to_owned(),
                panels: vec![
                    Panel::new(
                        "x, y (m)",
                        vec![Line::new("x", BLUE, &time, position(0)), Line::new("y", ORANGE, &time, position(1))],
                    ),
                    Panel::new("φ (rad)", vec![Line::new("", BLUE, &time, position(2))]),
                    Panel::new("tension (N)", of(&runs.inverse_lumped, &|at, i| at.tension[i])),
                    Panel::new("winch force (N)", unlabelled(of(&runs.inverse_lumped, &|at, i| at.winch_force[i]))),
                ],
            },
            Column {
                title: "what elasticity changes: upper half with 4e-4 m², lower half with 4e-4 cm² as printed"
                    .to_owned(),
                panels: vec![
                    Panel::new("paid-out rate (m/s)", of(&runs.inverse_lumped, &|at, i| at.unstretched_rate[i])),
                    Panel::new("force - rigid force (N)", difference(&runs.inverse_lumped)),
                    Panel::new(
                        "paid-out rate (m/s)",
                        unlabelled(of(&runs.inverse_printed, &|at, i| at.unstretched_rate[i])),
                    ),
                    Panel::new("force - rigid force (N)", difference(&runs.inverse_printed)),
                ],
            },
        ],
    };
    figure.write(folder, "inverse_dynamics")?;
    inverse_table(folder, "inverse_dynamics", &runs.inverse_lumped)?;
    inverse_table(folder, "inverse_dynamics_rigid", &runs.inverse_rigid)?;
    inverse_table(folder, "inverse_dynamics_area_as_printed", &runs.inverse_printed)
}

fn massless(folder: &Path, runs: &Runs) -> Result<(), PaperError> {
    let difference = |other: &Series, k: usize| {
        runs.rigid.pose.iter().zip(&other.pose).map(|(a, b)| b[k] - a[k]).collect::<Vec<_>>()
    };
    let panels = |other: &Series| {
        let mut panels: Vec<Panel> = AXES
            .iter()
            .map(|(label, k)| {
                Panel::new(&format!("Δ{label}"), vec![Line::new("", BLUE, &other.time, difference(other, *k))])
            })
            .collect();
        panels.push(strain(other));
        panels
    };
    let figure = Figure {
        title: "Elastic against rigid cables: deviation of the platform, release of Fig. 8".to_owned(),
        columns: vec![
            Column { title: "massless spring (37)-(40): moves as rigid".to_owned(), panels: panels(&runs.massless) },
            Column {
                title: "lumped mass, Fig. 5(b): elasticity changes the motion".to_owned(),
                panels: panels(&runs.lumped),
            },
        ],
    };
    figure.write(folder, "massless_spring_and_rigid")?;
    let rows = [("rigid", &runs.rigid), ("massless_spring", &runs.massless), ("lumped_mass", &runs.lumped)];
    table(folder, "massless_spring_and_rigid", &rows)
}

//! Other readings of a recording: what its columns may be, if not what they were read as.

use nalgebra::{Matrix2, Vector2};

use super::instants::Window;
use super::misfit::{lengths, poses};
use crate::data::clean::median;
use crate::data::{Channel, Trial};
use crate::model::examined::{Examined, gauss_newton_pose};

/// Share of the robot's size from which an offset is no error of a calibration any more but another origin.
pub(super) const ANOTHER_ORIGIN: f64 = 0.02;
/// Angle (rad) from which a frame is not slightly off but another one.
const ANOTHER_FRAME: f64 = 0.1;

/// A column that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Column {
    Force(usize),
    Measured(Channel),
}

impl Column {
    fn name(self) -> String {
        match self {
            Self::Force(i) => format!("winch_force[{}]", i + 1),
            Self::Measured(channel) => channel.name(),
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Force(_) => "N",
            Self::Measured(channel) => channel.unit(),
        }
    }
}

/// Another reading.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Change {
    /// Times by a factor, the name of the unit.
    Time(f64, &'static str),
    /// Columns by a factor, the name of the unit or none.
    Scale(Vec<Column>, f64, Option<&'static str>),
    /// Columns in another order: the k-th is what stands in the `order[k]`-th.
    Order(Vec<Column>, Vec<usize>),
    /// Columns by a sign and an offset each.
    Offset(Vec<Column>, f64, Vec<f64>),
    /// Poses in another frame: angle (rad), whether mirrored, shift (m, m, rad).
    Frame { angle: f64, mirrored: bool, shift: [f64; 3] },
}

impl Change {
    /// The windows under this reading.
    pub(super) fn apply(&self, channels: &[Channel], windows: &[Window]) -> Vec<Window> {
        let mut out = windows.to_vec();
        if let Self::Time(factor, _) = self {
            for window in &mut out {
                window.step *= factor;
                window.instants.iter_mut().for_each(|instant| instant.time *= factor);
            }
            return out;
        }
        for instant in out.iter_mut().flat_map(|w| &mut w.instants) {
            let old = instant.clone();
            let place = |column: Column| match column {
                Column::Force(i) => Some(i),
                Column::Measured(channel) => channels.iter().position(|c| *c == channel),
            };
            let get = |column: Column| match (column, place(column)) {
                (Column::Force(i), _) => old.inputs.winch_force[i],
                (_, Some(j)) => old.shown[j],
                (_, None) => f64::NAN,
            };
            let mut set = |column: Column, value: f64| match (column, place(column)) {
                (Column::Force(i), _) => instant.inputs.winch_force[i] = value,
                (_, Some(j)) => instant.shown[j] = value,
                (_, None) => {}
            };
            match self {
                Self::Time(..) => {}
                Self::Scale(columns, factor, _) => columns.iter().for_each(|c| set(*c, factor * get(*c))),
                Self::Order(columns, order) => {
                    columns.iter().zip(order).for_each(|(to, from)| set(*to, get(columns[*from])));
                }
                Self::Offset(columns, sign, offsets) => {
                    columns.iter().zip(offsets).for_each(|(c, offset)| set(*c, sign * get(*c) + offset));
                }
                Self::Frame { angle, mirrored, shift } => {
                    let [x, y, phi] = [0, 1, 2].map(|k| Column::Measured(Channel::Pose(k)));
                    let hand = if *mirrored { -1.0 } else { 1.0 };
                    let (sin, cos) = angle.sin_cos();
                    let (a, b) = (get(x), hand * get(y));
                    set(x, cos * a - sin * b + shift[0]);
                    set(y, sin * a + cos * b + shift[1]);
                    set(phi, hand * get(phi) + shift[2]);
                }
            }
        }
        out
    }

    /// Whether it puts winch forces in another order.
    pub(super) fn exchanges_forces(&self) -> bool {
        matches!(self, Self::Order(columns, _) if matches!(columns[0], Column::Force(_)))
    }

    /// Whether it lets lengths count from another zero.
    pub(super) fn is_origin(&self) -> bool {
        matches!(self, Self::Offset(..))
    }

    /// What is seen, and what to write in the map.
    pub(super) fn words(&self) -> String {
        let list = |columns: &[Column]| columns.iter().map(|c| c.name()).collect::<Vec<_>>().join(", ");
        let be = |columns: &[Column]| if columns.len() == 1 { "is" } else { "are" };
        match self {
            Self::Time(_, unit) => format!(
                "time is in {unit} by the motion and the forces, not in s. Write in the map: time = {{ column = \"...\", unit \
                 = \"{unit}\" }}"
            ),
            Self::Scale(columns, factor, Some(unit)) => format!(
                "{} {} in {unit} by size, not in {}. Write unit = \"{unit}\" for {} in the map (or multiply the scale that \
                 stands there by {}).",
                list(columns),
                be(columns),
                columns[0].unit(),
                if columns.len() == 1 { "it" } else { "each" },
                short(*factor),
            ),
            Self::Scale(columns, ..) => format!(
                "{} {} of the other sign. Write scale = -1 for {} in the map.",
                list(columns),
                if columns.len() == 1 { "is" } else { "are all" },
                if columns.len() == 1 { "it" } else { "each" },
            ),
            Self::Order(columns, order) => {
                let moved = (0..columns.len()).filter(|k| order[*k] != *k);
                let pairs: Vec<String> = moved
                    .map(|k| format!("{} stands in the column of {}", columns[k].name(), columns[order[k]].name()))
                    .collect();
                format!("columns are exchanged: {}. Give each its own `column` in the map.", pairs.join(", "))
            }
            Self::Offset(columns, sign, offsets) => {
                let (what, scale) =
                    if *sign < 0.0 { ("run backwards", "scale = -1, ") } else { ("count from another zero", "") };
                let each: Vec<String> = columns
                    .iter()
                    .zip(offsets)
                    .map(|(c, offset)| format!("{} {scale}offset = {}", c.name(), short(*offset)))
                    .collect();
                format!(
                    "lengths {what} than the model's at the recorded poses. Write in the map: {}; or the model is of another \
                     robot: see to its anchors.",
                    each.join("; ")
                )
            }
            Self::Frame { angle, mirrored, shift } => {
                let turned = if angle.abs() > 1e-3 {
                    format!("turned by {} deg", short(angle.to_degrees()))
                } else {
                    String::new()
                };
                let parts = [
                    if *mirrored { "mirrored (y and phi of the other sign)".to_owned() } else { String::new() },
                    turned,
                    match shift.map(|v| (1e4 * v).round() / 1e4) {
                        [0.0, 0.0, 0.0] => String::new(),
                        _ => {
                            format!("shifted by {} m, {} m, {} rad", short(shift[0]), short(shift[1]), short(shift[2]))
                        }
                    },
                ];
                let parts: Vec<String> = parts.into_iter().filter(|p| !p.is_empty()).collect();
                let how = match (angle.abs() > 1e-3, mirrored) {
                    (false, false) => format!(
                        "Write offset = {}, {} and {} for x, y and phi in the map.",
                        short(shift[0]),
                        short(shift[1]),
                        short(shift[2])
                    ),
                    (false, true) => "Write scale = -1 for y and phi in the map, and the shift as offset.".to_owned(),
                    _ => "Turn the recorded poses into the model's frame (quarters of a turn by other columns and scale = -1 \
                          in the map)."
                        .to_owned(),
                };
                format!(
                    "the frame of the recorded pose is not the model's: into that it is {}. {how}",
                    parts.join(", then ")
                )
            }
        }
    }
}

/// A number with four digits.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{value:.digits$}")
}

/// The columns of one kind that are there.
fn kinds(trial: &Trial) -> Vec<Vec<Column>> {
    let of = |wanted: fn(&Channel) -> bool| -> Vec<Column> {
        trial.channels.iter().copied().filter(wanted).map(Column::Measured).collect()
    };
    let forces = (0..trial.inputs[0].winch_force.len()).map(Column::Force).collect();
    let kinds = [
        forces,
        of(|c| matches!(c, Channel::CableLength(_))),
        of(|c| matches!(c, Channel::UnstretchedLength(_))),
        of(|c| matches!(c, Channel::Tension(_))),
    ];
    kinds.into_iter().filter(|kind| !kind.is_empty()).collect()
}

/// Other units, of time and of whole kinds of columns.
pub(super) fn units(trial: &Trial) -> Vec<Change> {
    const LENGTHS: [(f64, &str); 4] = [(1e-3, "mm"), (1e-2, "cm"), (0.3048, "ft"), (1e3, "km")];
    const FORCES: [(f64, &str); 4] = [(1e3, "kN"), (9.806_65, "kgf"), (4.448_221_615_260_5, "lbf"), (1e6, "MN")];
    const ANGLES: [(f64, &str); 2] = [(std::f64::consts::PI / 180.0, "deg"), (1e-3, "mrad")];
    let mut out: Vec<Change> =
        [(1e-3, "ms"), (1e-6, "us"), (60.0, "min")].map(|(f, unit)| Change::Time(f, unit)).into();
    let mut add = |columns: &[Column], units: &[(f64, &'static str)]| {
        if !columns.is_empty() {
            out.extend(units.iter().map(|(factor, unit)| Change::Scale(columns.to_vec(), *factor, Some(unit))));
        }
    };
    for kind in kinds(trial) {
        add(&kind, if kind[0].unit() == "N" { &FORCES } else { &LENGTHS });
    }
    let has = |k: &usize| trial.channels.contains(&Channel::Pose(*k));
    let column = |k: usize| Column::Measured(Channel::Pose(k));
    add(&(0..2).filter(has).map(column).collect::<Vec<_>>(), &LENGTHS);
    add(&(2..3).filter(has).map(column).collect::<Vec<_>>(), &ANGLES);
    out
}

/// Other readings of whole kinds of columns of a trial, as it stands in `windows`: units, signs, origins, frames.
pub(super) fn of_whole_kinds(model: &Examined, trial: &Trial, windows: &[Window]) -> Vec<Change> {
    let mut out = units(trial);
    for columns in kinds(trial) {
        if matches!(columns[0], Column::Measured(Channel::CableLength(_) | Channel::UnstretchedLength(_))) {
            out.extend(origins(model, trial, windows, &columns));
        } else {
            out.push(Change::Scale(columns, -1.0, None));
        }
    }
    let pose = [0, 1, 2].map(Channel::Pose);
    if pose.iter().all(|c| trial.channels.contains(c)) {
        out.extend(frames(model, trial, windows));
        out.push(Change::Order([0, 1].map(|k| Column::Measured(pose[k])).to_vec(), vec![1, 0]));
        out.extend((0..3).map(|k| Change::Scale(vec![Column::Measured(pose[k])], -1.0, None)));
    }
    out
}

/// Every other reading of a trial, as it stands in `windows`: those of whole kinds, single columns, and other orders.
pub(super) fn all(model: &Examined, trial: &Trial, windows: &[Window]) -> Vec<Change> {
    let mut out = of_whole_kinds(model, trial, windows);
    let mut single = Vec::new();
    for change in &out {
        if let Change::Scale(columns, factor, unit) = change {
            single
                .extend(columns.iter().filter(|_| columns.len() > 1).map(|c| Change::Scale(vec![*c], *factor, *unit)));
        }
    }
    out.extend(single);
    for columns in kinds(trial) {
        out.extend(orders(columns.len()).into_iter().map(|order| Change::Order(columns.clone(), order)));
    }
    out
}

/// Two columns exchanged, or all numbered from another one on or the other way round.
fn orders(n: usize) -> Vec<Vec<usize>> {
    let mut out = Vec::new();
    for a in 0..n {
        for b in a + 1..n {
            out.push(
                (0..n)
                    .map(|k| {
                        if k == a {
                            b
                        } else if k == b {
                            a
                        } else {
                            k
                        }
                    })
                    .collect(),
            );
        }
    }
    for first in 0..n {
        out.push((0..n).map(|k| (first + k) % n).collect());
        out.push((0..n).map(|k| (first + n - k) % n).collect());
    }
    out.retain(|order: &Vec<usize>| order.iter().enumerate().any(|(k, from)| k != *from));
    out.sort();
    out.dedup();
    out
}

/// Lengths that count from another zero, forwards or backwards.
fn origins(model: &Examined, trial: &Trial, windows: &[Window], columns: &[Column]) -> Vec<Change> {
    let poses = poses(model, &trial.channels, windows);
    let geometry = model.plant.geometry();
    let offsets = |sign: f64| -> Option<Vec<f64>> {
        columns
            .iter()
            .map(|column| {
                let Column::Measured(channel) = column else { return None };
                let j = trial.channels.iter().position(|c| c == channel)?;
                let (i, sensor, stretches) = match channel {
                    Channel::CableLength(i) => (*i, 0, false),
                    Channel::UnstretchedLength(i) => (*i, 1, model.plant.unstretched_index(*i).is_some()),
                    _ => return None,
                };
                let all = windows.iter().zip(&poses).flat_map(|(w, poses)| w.instants.iter().zip(poses));
                let missing = all.map(|(instant, pose)| {
                    let tension = instant.inputs.winch_force[i].max(0.0);
                    let strain = tension / model.plant.data().cables[i].axial_stiffness;
                    let length = cdpr::kinematics::cable_lengths(geometry, pose)[i];
                    let length = if stretches { length / (1.0 + strain) } else { length };
                    model.plant.shown_lengths(i, length, length)[sensor] - sign * instant.shown[j]
                });
                Some(median(missing.collect())).filter(|offset| offset.is_finite())
            })
            .collect()
    };
    let usual = cdpr::kinematics::cable_lengths(geometry, &[0.0; 3]);
    let size = usual.iter().sum::<f64>() / usual.len() as f64;
    let far = |offsets: &Vec<f64>| offsets.iter().any(|offset| offset.abs() > ANOTHER_ORIGIN * size);
    [1.0, -1.0]
        .into_iter()
        .filter_map(|sign| Some(Change::Offset(columns.to_vec(), sign, offsets(sign).filter(far)?)))
        .collect()
}

/// A pose as recorded, and as the lengths say.
type Pair = ([f64; 3], [f64; 3]);

/// Other frames of the pose: the one in which the poses agree best with those that the lengths say (a Procrustes problem), and
/// quarters of a turn.
fn frames(model: &Examined, trial: &Trial, windows: &[Window]) -> Vec<Change> {
    use std::f64::consts::FRAC_PI_2;
    let mut out = Vec::new();
    for mirrored in [false, true] {
        out.extend((-1..3).filter(|q| mirrored || *q != 0).map(|q| Change::Frame {
            angle: f64::from(q) * FRAC_PI_2,
            mirrored,
            shift: [0.0; 3],
        }));
    }
    let pose = [0, 1, 2].map(|k| trial.channels.iter().position(|c| *c == Channel::Pose(k)));
    let [Some(x), Some(y), Some(phi)] = pose else { return out };
    let geometry = model.plant.geometry();
    let mut pairs = Vec::new();
    for instant in windows.iter().flat_map(|w| w.instants.iter().step_by(4)) {
        let lengths = lengths(model, &trial.channels, instant);
        let told = lengths.iter().flatten().count() > 3;
        let shown = [x, y, phi].map(|j| instant.shown[j]);
        if told && shown.iter().all(|v| v.is_finite()) {
            let found = gauss_newton_pose(geometry, &lengths, &[None; 3], [0.0; 3]);
            let model_lengths = cdpr::kinematics::cable_lengths(geometry, &found);
            let fits =
                lengths.iter().zip(&model_lengths).all(|(l, m)| l.is_none_or(|l| (l - m).abs() < ANOTHER_ORIGIN * m));
            if fits {
                pairs.push((shown, found));
            }
        }
    }
    if pairs.len() < 10 {
        return out;
    }
    let n = pairs.len() as f64;
    let mean = |of: &dyn Fn(&Pair) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let usual = cdpr::kinematics::cable_lengths(geometry, &[0.0; 3]);
    let size = usual.iter().sum::<f64>() / usual.len() as f64;
    for mirrored in [false, true] {
        let hand = if mirrored { -1.0 } else { 1.0 };
        let from = |p: &Pair| Vector2::new(p.0[0], hand * p.0[1]);
        let to = |p: &Pair| Vector2::new(p.1[0], p.1[1]);
        let centre_from = Vector2::new(mean(&|p| from(p)[0]), mean(&|p| from(p)[1]));
        let centre_to = Vector2::new(mean(&|p| to(p)[0]), mean(&|p| to(p)[1]));
        let (mut cos, mut sin) = (0.0, 0.0);
        for p in &pairs {
            let (a, b) = (from(p) - centre_from, to(p) - centre_to);
            cos += a.dot(&b);
            sin += a.perp(&b);
        }
        let angle: f64 = sin.atan2(cos);
        let turn = Matrix2::new(angle.cos(), -angle.sin(), angle.sin(), angle.cos());
        let moved = centre_to - turn * centre_from;
        let shift = [moved[0], moved[1], median(pairs.iter().map(|p| p.1[2] - hand * p.0[2]).collect())];
        let another =
            moved.norm() > ANOTHER_ORIGIN * size || angle.abs() > ANOTHER_FRAME || shift[2].abs() > ANOTHER_FRAME;
        if mirrored || another {
            out.push(Change::Frame { angle, mirrored, shift });
        }
    }
    out
}

//! Recordings as equations of the geometry.

mod alone;

use cdpr::geometry::Geometry;
use cdpr::model_file::Model;
use cdpr::winch::WinchCommand;
use nalgebra::{DMatrix, DVector};

use super::CalibrateError;
use crate::data::clean::noise_by_differences;
use crate::data::counts::least_noise;
use crate::data::{Channel, Trial};
use crate::hypothesis::survey::{ANCHORS, ATTACHMENTS};
use crate::model::examined::{Examined, gauss_newton_pose};
use crate::model::sizes::Sizes;

/// A number that is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Unknown {
    /// Coordinate of an anchor: cable and axis.
    Anchor(usize, usize),
    /// Coordinate of an attachment.
    Attachment(usize, usize),
    /// What a length sensor shows too much.
    Offset(Channel),
}

impl Unknown {
    /// The cable that it belongs to.
    pub(super) fn cable(self) -> usize {
        match self {
            Self::Anchor(cable, _) | Self::Attachment(cable, _) => cable,
            Self::Offset(Channel::CableLength(cable) | Channel::UnstretchedLength(cable) | Channel::Tension(cable)) => {
                cable
            }
            Self::Offset(Channel::Pose(_)) => unreachable!("only lengths have offsets here"),
        }
    }

    pub(super) fn name(self) -> String {
        let of = |what: &str, cable: usize, axis: usize| format!("{what}[{}].{}", cable + 1, ["x", "y"][axis]);
        match self {
            Self::Anchor(cable, axis) => of("anchor", cable, axis),
            Self::Attachment(cable, axis) => of("attachment", cable, axis),
            Self::Offset(channel) => format!("{} offset", channel.name()),
        }
    }
}

/// A measured length at a sample.
struct Length {
    channel: Channel,
    cable: usize,
    value: f64,
    noise: f64,
    /// Tension (N), where the length is an unstretched one.
    tension: f64,
}

/// A sample with lengths.
pub(super) struct Sample {
    /// As measured; where an axis is not, as the lengths tell it with the geometry as given.
    pose: [f64; 3],
    /// Noise of each axis, where it is measured.
    pose_noise: [Option<f64>; 3],
    time: f64,
    lengths: Vec<Length>,
    /// Which recording it is of.
    pub(super) trial: usize,
}

/// Everything that the recordings say.
pub(super) struct Problem {
    examined: Examined,
    pub(super) geometry: Geometry,
    pub(super) unknowns: Vec<Unknown>,
    /// By how much each may plausibly be off (m).
    pub(super) plausible: DVector<f64>,
    /// How far the platform may be from where it is sought, along an axis that was not measured (m, m, rad).
    range: [f64; 3],
    pub(super) samples: Vec<Sample>,
}

/// The equations of one sample at some corrections.
pub(super) struct Equations {
    /// Measured minus expected (m).
    pub(super) residual: DVector<f64>,
    /// What a unit of each unknown does to what is expected.
    pub(super) slopes: DMatrix<f64>,
    /// The root `L` of the covariance `L Lᵀ` of the residuals by noise.
    pub(super) root: DMatrix<f64>,
    /// What the axes of the pose that were not measured do to what is expected over their whole range, a column each (m).
    pub(super) free: DMatrix<f64>,
    pub(super) channels: Vec<Channel>,
}

/// Fewest samples of a calibration.
const FEWEST: usize = 50;
/// Most steps to a pose that lengths tell.
const STEPS: usize = 20;
/// Step, as a share of the axis's range, from which on a pose is found: a millionth of any noise.
const FOUND: f64 = 1e-10;

impl Problem {
    pub(super) fn new(model: &Model, trials: &[Trial]) -> Result<Self, CalibrateError> {
        let examined = Examined::new(model).map_err(|e| CalibrateError::Model(e.to_string()))?;
        let geometry = *examined.plant.geometry();
        let cables = geometry.cables();
        if let Some(i) = geometry.pulley_radius.iter().position(|radius| *radius != 0.0) {
            return Err(CalibrateError::Pulley { cable: i + 1 });
        }
        if trials.is_empty() {
            return Err(CalibrateError::Data("no recordings; expected one or more".to_owned()));
        }
        let mut samples = Vec::new();
        for (t, trial) in trials.iter().enumerate() {
            samples.extend(of_trial(model, &examined, t, trial)?);
        }
        if samples.len() < FEWEST {
            return Err(CalibrateError::Data(format!(
                "{} samples with a length and what is measured of the pose, expected {FEWEST} or more",
                samples.len()
            )));
        }
        let mut unknowns = Vec::new();
        // Where all cables meet in a point there is no attachment to be off.
        let point = geometry.attachment.iter().flatten().all(|coordinate| *coordinate == 0.0);
        let measured = |channel: Channel| samples.iter().any(|s| s.lengths.iter().any(|l| l.channel == channel));
        for cable in 0..cables {
            let channels = [Channel::CableLength(cable), Channel::UnstretchedLength(cable)];
            let channels: Vec<Channel> = channels.into_iter().filter(|c| measured(*c)).collect();
            if channels.is_empty() {
                continue;
            }
            unknowns.extend((0..2).map(|axis| Unknown::Anchor(cable, axis)));
            unknowns.extend((0..2).filter(|_| !point).map(|axis| Unknown::Attachment(cable, axis)));
            unknowns.extend(channels.into_iter().map(Unknown::Offset));
        }
        let sizes = Sizes::of(&model.parameters);
        let plausible = unknowns.iter().map(|unknown| match unknown {
            Unknown::Attachment(..) => ATTACHMENTS * sizes.arm,
            _ => ANCHORS * sizes.reach,
        });
        let plausible = DVector::from_iterator(unknowns.len(), plausible);
        let range = [sizes.reach, sizes.reach, 1.0];
        let problem = Self { examined, geometry, unknowns, plausible, range, samples };
        problem.within_numbers(trials)?;
        problem.enough()?;
        Ok(problem)
    }

    /// That lengths, poses and tensions are so small that squares of them are numbers.
    fn within_numbers(&self, trials: &[Trial]) -> Result<(), CalibrateError> {
        let given = DVector::zeros(self.unknowns.len());
        for sample in &self.samples {
            let equations = self.equations_at(sample, &sample.pose, &given);
            let is_number = |row: usize| {
                let of = |matrix: &DMatrix<f64>| matrix.row(row).iter().all(|v| v.is_finite());
                equations.residual[row].powi(2).is_finite() && of(&equations.root) && of(&equations.slopes)
            };
            if let Some(row) = (0..sample.lengths.len()).find(|row| !is_number(*row)) {
                let length = &sample.lengths[row];
                let [x, y, phi] = sample.pose;
                if cdpr::kinematics::cable_lengths(&self.geometry, &[x, y, phi])[length.cable] == 0.0 {
                    return Err(CalibrateError::Data(format!(
                        "{}: the platform is at the anchor of cable {} at {} s (x = {x} m, y = {y} m), expected it away from there, where \
                         a cable has a direction: leave out such rows.",
                        trials[sample.trial].name,
                        length.cable + 1,
                        sample.time
                    )));
                }
                return Err(CalibrateError::Data(format!(
                    "{}: {} is {:e} m at {} s, with the platform at x = {:e} m, y = {:e} m, expected numbers of the size of the \
                     robot: is the unit right (`scale` in the map)?",
                    trials[sample.trial].name,
                    length.channel.name(),
                    length.value,
                    sample.time,
                    sample.pose[0],
                    sample.pose[1]
                )));
            }
        }
        Ok(())
    }

    /// That lengths are left over where axes of the pose are to be told by them.
    fn enough(&self) -> Result<(), CalibrateError> {
        let given = DVector::zeros(self.unknowns.len());
        let over = |sample: &Sample| {
            let equations = self.equations(sample, &given);
            equations.left_over().ncols() > 0
        };
        if self.samples.iter().any(over) {
            return Ok(());
        }
        let axes = ["x", "y", "phi"].into_iter().zip(self.samples[0].pose_noise);
        let missing: Vec<&str> = axes.filter(|(_, noise)| noise.is_none()).map(|(name, _)| name).collect();
        Err(CalibrateError::Data(format!(
            "{} not measured, and no length is left over once the others tell {}; expected more lengths, or x, y and phi",
            missing.join(", "),
            if missing.len() == 1 { "it" } else { "them" }
        )))
    }

    /// What corrections of a plausible size, all of those of a cable, could make of its lengths (m).
    pub(super) fn plausible_of(&self, cable: usize) -> f64 {
        let own = self.unknowns.iter().zip(self.plausible.iter()).filter(|(unknown, _)| unknown.cable() == cable);
        own.map(|(_, plausible)| plausible).sum()
    }

    /// The lengths that are measured.
    pub(super) fn lengths(&self) -> Vec<Channel> {
        let offset = |unknown: &Unknown| match unknown {
            Unknown::Offset(channel) => Some(*channel),
            _ => None,
        };
        self.unknowns.iter().filter_map(offset).collect()
    }

    /// The misfit of a length with the model as given, root mean square, in standard deviations of its noise and the pose's.
    pub(super) fn misfit_as_given(&self, channel: Channel) -> f64 {
        let given = DVector::zeros(self.unknowns.len());
        let (mut sum, mut count) = (0.0, 0.0);
        for sample in &self.samples {
            let Some(row) = sample.lengths.iter().position(|length| length.channel == channel) else { continue };
            let equations = self.equations(sample, &given);
            sum += equations.residual[row].powi(2) / equations.root.row(row).norm_squared();
            count += 1.0;
        }
        f64::sqrt(sum / count)
    }

    /// Whether every axis of the pose of which lengths say anything is measured.
    pub(super) fn pose_is_measured(&self) -> bool {
        let given = DVector::zeros(self.unknowns.len());
        self.samples.iter().all(|sample| self.equations_at(sample, &sample.pose, &given).free.amax() == 0.0)
    }

    /// Of each sample in which a channel was measured what the model as given has there, and what was shown.
    pub(super) fn shown(&self, channel: Channel) -> Vec<(f64, f64)> {
        let given = DVector::zeros(self.unknowns.len());
        let mut out = Vec::new();
        for sample in &self.samples {
            let Some(row) = sample.lengths.iter().position(|length| length.channel == channel) else { continue };
            let shown = sample.lengths[row].value;
            out.push((shown - self.equations(sample, &given).residual[row], shown));
        }
        out
    }

    /// The value of an unknown as given (m).
    pub(super) fn given(&self, unknown: Unknown) -> f64 {
        match unknown {
            Unknown::Anchor(cable, axis) => self.geometry.anchor[cable][axis],
            Unknown::Attachment(cable, axis) => self.geometry.attachment[cable][axis],
            Unknown::Offset(Channel::CableLength(cable)) => self.examined.plant.length_sensor_biases(cable)[0],
            Unknown::Offset(Channel::UnstretchedLength(cable)) => self.examined.plant.length_sensor_biases(cable)[1],
            Unknown::Offset(_) => unreachable!("only lengths have offsets here"),
        }
    }

    /// The equations of a sample with so much added to the unknowns, at the pose as measured, and along axes that were not
    /// measured, where the lengths tell it to be.
    pub(super) fn equations(&self, sample: &Sample, change: &DVector<f64>) -> Equations {
        let mut pose = sample.pose;
        let mut equations = self.equations_at(sample, &pose, change);
        for _ in 0..STEPS {
            let step = equations.step();
            if step.amax() <= FOUND {
                break;
            }
            let axes = (0..3).filter(|axis| sample.pose_noise[*axis].is_none());
            axes.zip(step.iter()).for_each(|(axis, step)| pose[axis] += step * self.range[axis]);
            equations = self.equations_at(sample, &pose, change);
        }
        equations
    }

    fn equations_at(&self, sample: &Sample, pose: &[f64; 3], change: &DVector<f64>) -> Equations {
        let rows = sample.lengths.len();
        let mut slopes = DMatrix::zeros(rows, self.unknowns.len());
        let mut by_pose = DMatrix::zeros(rows, 3);
        let mut residual = DVector::zeros(rows);
        let at = |wanted: Unknown| self.unknowns.iter().position(|u| *u == wanted);
        let added = |wanted: Unknown| at(wanted).map_or(0.0, |k| change[k]);
        let [x, y, phi] = *pose;
        let (sin, cos) = phi.sin_cos();
        for (row, length) in sample.lengths.iter().enumerate() {
            let cable = length.cable;
            let point = |of: fn(usize, usize) -> Unknown, given: [f64; 2]| {
                [0, 1].map(|axis| given[axis] + added(of(cable, axis)))
            };
            let anchor = point(Unknown::Anchor, self.geometry.anchor[cable]);
            let b = point(Unknown::Attachment, self.geometry.attachment[cable]);
            let arm = [cos * b[0] - sin * b[1], sin * b[0] + cos * b[1]];
            let apart = [x + arm[0] - anchor[0], y + arm[1] - anchor[1]];
            let distance = apart[0].hypot(apart[1]);
            let u = apart.map(|v| v / distance);
            let (plant, is_paid_out) = (&self.examined.plant, matches!(length.channel, Channel::UnstretchedLength(_)));
            let (real, slope) =
                if is_paid_out { self.paid_out(sample.time, length, distance) } else { (distance, 1.0) };
            let sensor = usize::from(is_paid_out);
            let shown = plant.shown_lengths(cable, real, real)[sensor] + added(Unknown::Offset(length.channel));
            residual[row] = length.value - shown;
            let slope = slope * plant.length_sensor_slopes(cable, real)[sensor];
            for axis in 0..2 {
                if let Some(k) = at(Unknown::Anchor(cable, axis)) {
                    slopes[(row, k)] = -slope * u[axis];
                }
                by_pose[(row, axis)] = slope * u[axis];
            }
            for (axis, turned) in [[cos, sin], [-sin, cos]].into_iter().enumerate() {
                if let Some(k) = at(Unknown::Attachment(cable, axis)) {
                    slopes[(row, k)] = slope * (turned[0] * u[0] + turned[1] * u[1]);
                }
            }
            by_pose[(row, 2)] = slope * (arm[0] * u[1] - arm[1] * u[0]);
            if let Some(k) = at(Unknown::Offset(length.channel)) {
                slopes[(row, k)] = 1.0;
            }
        }
        let own: Vec<f64> = sample.lengths.iter().map(|length| length.noise).collect();
        let root = root(&own, &by_pose, sample.pose_noise.map(|noise| noise.unwrap_or(0.0)));
        let axes = (0..3).filter(|axis| sample.pose_noise[*axis].is_none());
        let free: Vec<DVector<f64>> = axes.map(|axis| by_pose.column(axis) * self.range[axis]).collect();
        let free = if free.is_empty() { DMatrix::zeros(rows, 0) } else { DMatrix::from_columns(&free) };
        let channels = sample.lengths.iter().map(|l| l.channel).collect();
        Equations { residual, slopes, root, free, channels }
    }

    /// What of a distance (m) is paid out, and how much more of one more metre.
    fn paid_out(&self, time: f64, length: &Length, distance: f64) -> (f64, f64) {
        let plant = &self.examined.plant;
        if plant.unstretched_index(length.cable).is_none() {
            return (distance, 1.0);
        }
        let states = [0.0; cdpr::dynamics::MAX_EFFECT_STATES];
        let own = &states[..plant.effect_states(length.cable).len()];
        let paid = plant.unstretched_length_for(length.cable, time, distance, length.tension, own);
        (paid, paid / distance)
    }
}

impl Equations {
    /// Residuals, or what changes them, by columns, with the noise made white.
    pub(super) fn whitened(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        self.root.solve_lower_triangular(columns).unwrap_or_else(|| unreachable!("noise above zero on every row"))
    }

    /// What the unmeasured axes do to the whitened rows, where the lengths tell more of it than the axes' range: directions of
    /// the rows, directions of the axes, and how much more. Along the others the pose is held.
    fn white_free(&self) -> (DMatrix<f64>, DMatrix<f64>, Vec<f64>) {
        if self.free.ncols() == 0 {
            return (DMatrix::zeros(self.free.nrows(), 0), DMatrix::zeros(0, 0), Vec::new());
        }
        let solved = self.whitened(&self.free);
        let (rows, axes) = solved.shape();
        if !solved.iter().all(|value| value.is_finite()) {
            return (DMatrix::zeros(rows, 0), DMatrix::zeros(axes, 0), Vec::new());
        }
        let eigen = (solved.transpose() * &solved).symmetric_eigen();
        let told: Vec<usize> = (0..axes).filter(|k| eigen.eigenvalues[*k] > 1.0).collect();
        let sizes: Vec<f64> = told.iter().map(|k| eigen.eigenvalues[*k].sqrt()).collect();
        let of_axes = DMatrix::from_fn(axes, told.len(), |r, c| eigen.eigenvectors[(r, told[c])]);
        let of_rows = &solved * &of_axes;
        let of_rows = DMatrix::from_fn(rows, told.len(), |r, c| of_rows[(r, c)] / sizes[c]);
        (of_rows, of_axes, sizes)
    }

    /// Step to the pose that the lengths tell, as shares of the unmeasured axes' ranges (Gauss-Newton).
    fn step(&self) -> DVector<f64> {
        let (of_rows, of_axes, sizes) = self.white_free();
        let residual = self.whitened(&DMatrix::from_columns(std::slice::from_ref(&self.residual)));
        let along = of_rows.transpose() * residual.column(0);
        of_axes * DVector::from_fn(sizes.len(), |k, _| along[k] / sizes[k])
    }

    /// Orthonormal directions of the whitened rows about which the unmeasured axes say nothing, as columns.
    pub(super) fn left_over(&self) -> DMatrix<f64> {
        let rows = self.residual.len();
        let (taken, ..) = self.white_free();
        let (axes, mut all) = (taken.ncols(), DMatrix::identity(rows, rows));
        all = all.insert_columns(0, axes, 0.0);
        all.columns_mut(0, axes).copy_from(&taken);
        // In the order of the rows, so that the directions follow the pose without a leap.
        all.qr().q().columns(axes, rows - axes).into_owned()
    }
}

/// The root `L` of the covariance `L Lᵀ` of lengths that have noise of their `own` and that of a pose, by what the pose does to them
/// (a row a length). No squares are taken: the noise of a pose may be any multiple of that of lengths.
fn root(own: &[f64], by_pose: &DMatrix<f64>, pose: [f64; 3]) -> DMatrix<f64> {
    let rows = own.len();
    let stacked = DMatrix::from_fn(rows + 3, rows, |r, c| match r.checked_sub(rows) {
        None if r == c => own[r],
        None => 0.0,
        Some(axis) => by_pose[(c, axis)] * pose[axis],
    });
    let mut root = stacked.qr().r().transpose();
    // What is not known of a length by those before it is its own noise at least.
    for (k, own) in own.iter().enumerate() {
        root[(k, k)] = root[(k, k)].abs().max(*own).copysign(root[(k, k)]);
    }
    root
}

/// The samples of a recording.
fn of_trial(model: &Model, examined: &Examined, t: usize, trial: &Trial) -> Result<Vec<Sample>, CalibrateError> {
    let wrong = |message: String| CalibrateError::Data(format!("{}: {message}", trial.name));
    let cables = examined.plant.cables();
    if trial.cables() != cables {
        return Err(wrong(format!(
            "{} winch forces, expected {cables}, one for each cable of the model",
            trial.cables()
        )));
    }
    let place = |wanted: Channel| trial.channels.iter().position(|c| *c == wanted);
    let has = |wanted: Channel| place(wanted).filter(|j| trial.measured.iter().any(|row| row[*j].is_finite()));
    let lengths: Vec<Channel> = (0..cables)
        .flat_map(|i| [Channel::CableLength(i), Channel::UnstretchedLength(i)])
        .filter(|c| has(*c).is_some())
        .collect();
    if lengths.is_empty() {
        return Err(wrong(
            "no length is measured; expected columns cable_length[i] or unstretched_length[i]".to_owned(),
        ));
    }
    let elastic = examined.plant.unstretched_index(0).is_some();
    let by_force = model.parameters.winch.command == WinchCommand::Force;
    for channel in &lengths {
        if let Channel::UnstretchedLength(i) = *channel
            && elastic
            && !(by_force && trial.inputs.iter().any(|inputs| inputs.winch_force[i].is_finite()))
            && has(Channel::Tension(i)).is_none()
        {
            return Err(wrong(format!(
                "unstretched_length[{0}] needs the tension by which cable {0} is stretched: a column tension[{0}], or \
                 winch_force[{0}] of winches commanded by force",
                i + 1
            )));
        }
    }
    let noise = |channel: Channel| {
        let noise = place(channel).map_or(f64::NAN, |j| noise_by_differences(trial, j));
        let least = least_noise(std::slice::from_ref(trial), channel, noise);
        if noise.is_nan() { least } else { noise.max(least) }
    };
    let pose_at = [0, 1, 2].map(|k| has(Channel::Pose(k)));
    let pose_noise: [Option<f64>; 3] = std::array::from_fn(|k| pose_at[k].map(|_| noise(Channel::Pose(k))));
    let lengths: Vec<(Channel, usize, f64)> =
        lengths.into_iter().map(|c| (c, place(c).unwrap_or_default(), noise(c))).collect();
    let sensor = examined.plant.pose_sensor();
    if !sensor.is_plain() && pose_at.contains(&None) && pose_at != [None; 3] {
        return Err(wrong(
            "behind `pose_sensor_frame` or `pose_sensor_scale` it takes x, y and phi, or none of them".to_owned(),
        ));
    }
    let mut out: Vec<Sample> = Vec::new();
    for (k, row) in trial.measured.iter().enumerate() {
        let behind = sensor.behind(&pose_at.map(|j| j.map_or(0.0, |j| row[j])));
        let measured: [Option<f64>; 3] = std::array::from_fn(|axis| pose_at[axis].map(|_| behind[axis]));
        if measured.iter().flatten().any(|v| !v.is_finite()) {
            continue;
        }
        let length = |(channel, j, noise): &(Channel, usize, f64)| {
            let (Channel::CableLength(cable) | Channel::UnstretchedLength(cable)) = *channel else { return None };
            let shown = has(Channel::Tension(cable)).map(|j| row[j]).filter(|v| v.is_finite());
            let force = Some(trial.inputs[k].winch_force[cable]).filter(|force| by_force && force.is_finite());
            let tension = shown.or(force);
            let known = tension.is_some() || !elastic || matches!(channel, Channel::CableLength(_));
            let tension = tension.unwrap_or_default().max(0.0);
            let whole = row[*j].is_finite() && known;
            whole.then_some(Length { channel: *channel, cable, value: row[*j], noise: *noise, tension })
        };
        let lengths: Vec<Length> = lengths.iter().filter_map(length).collect();
        if !lengths.is_empty() {
            // Sought from where it was last; the equations see to the stretch of the cables.
            let last = out.last().map_or([0.0; 3], |sample| sample.pose);
            let shown = |i: usize| lengths.iter().find(|l| l.cable == i).map(|l| l.value);
            let pose = if measured.iter().any(Option::is_none) {
                let shown: Vec<Option<f64>> = (0..cables).map(shown).collect();
                let guess = std::array::from_fn(|axis| measured[axis].unwrap_or(last[axis]));
                gauss_newton_pose(examined.plant.geometry(), &shown, &measured, guess)
            } else {
                measured.map(Option::unwrap_or_default)
            };
            out.push(Sample { pose, pose_noise, time: trial.time[k], lengths, trial: t });
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two lengths of one cable beside a pose with noise far above theirs: the covariance itself was no longer positive, and a
    /// calibration ended with a panic.
    #[test]
    fn the_root_of_a_covariance_holds_whatever_the_pose_has_of_noise() {
        let by_pose = DMatrix::from_row_slice(3, 3, &[0.6, 0.8, 0.0, 0.6, 0.8, 0.0, -1.0, 0.0, 2.0]);
        let own = [1e-3, 2e-3, 1e-3];
        for noise in [1e-3, 1.0, 1e9, 1e100] {
            let root = root(&own, &by_pose, [noise, 0.5 * noise, 0.0]);
            let pose = DMatrix::from_diagonal(&DVector::from_column_slice(&[noise * noise, 0.25 * noise * noise, 0.0]));
            let mut covariance = &by_pose * pose * by_pose.transpose();
            own.iter().enumerate().for_each(|(k, own)| covariance[(k, k)] += own * own);
            let error = (&root * root.transpose() - &covariance).amax() / covariance.amax();
            assert!(error < 1e-14, "{noise}: {error}");
            assert!((0..3).all(|k| root[(k, k)].abs() >= own[k]), "{noise}: {root}");
        }
    }
}

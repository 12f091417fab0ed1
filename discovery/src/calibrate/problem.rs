//! Recordings as equations of the geometry.

use cdpr::geometry::Geometry;
use cdpr::model_file::Model;
use cdpr::winch::WinchCommand;
use nalgebra::{DMatrix, DVector};

use super::CalibrateError;
use crate::data::clean::noise_by_differences;
use crate::data::{Channel, Trial};
use crate::model::Examined;
use crate::sizes::Sizes;

/// How exactly anybody who builds such a machine knows where its anchors are and what its encoders count from, as a share of
/// its reach.
const ANCHORS: f64 = 2e-3;
/// The same of attachments, as a share of their arm.
const ATTACHMENTS: f64 = 0.05;

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

/// A sample with a pose and lengths.
pub(super) struct Sample {
    pose: [f64; 3],
    pose_noise: [f64; 3],
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
    pub(super) samples: Vec<Sample>,
}

/// The equations of one sample at some corrections.
pub(super) struct Equations {
    /// Measured minus expected (m).
    pub(super) residual: DVector<f64>,
    /// What a unit of each unknown does to what is expected.
    pub(super) slopes: DMatrix<f64>,
    /// Covariance of the residuals by noise.
    pub(super) covariance: DMatrix<f64>,
    pub(super) channels: Vec<Channel>,
}

/// Fewest samples of a calibration.
const FEWEST: usize = 50;

impl Problem {
    pub(super) fn new(model: &Model, trials: &[Trial]) -> Result<Self, CalibrateError> {
        let examined = Examined::new(model).map_err(|e| CalibrateError::Model(e.to_string()))?;
        let geometry = *examined.plant.geometry();
        let cables = geometry.cables();
        if trials.is_empty() {
            return Err(CalibrateError::Data("no recordings; expected one or more".to_owned()));
        }
        let mut samples = Vec::new();
        for (t, trial) in trials.iter().enumerate() {
            samples.extend(of_trial(model, &examined, t, trial)?);
        }
        if samples.len() < FEWEST {
            return Err(CalibrateError::Data(format!(
                "{} samples with a whole pose and a length, expected {FEWEST} or more",
                samples.len()
            )));
        }
        let mut unknowns = Vec::new();
        let measured = |channel: Channel| samples.iter().any(|s| s.lengths.iter().any(|l| l.channel == channel));
        for cable in 0..cables {
            let channels = [Channel::CableLength(cable), Channel::UnstretchedLength(cable)];
            let channels: Vec<Channel> = channels.into_iter().filter(|c| measured(*c)).collect();
            if channels.is_empty() {
                continue;
            }
            unknowns.extend((0..2).map(|axis| Unknown::Anchor(cable, axis)));
            unknowns.extend((0..2).map(|axis| Unknown::Attachment(cable, axis)));
            unknowns.extend(channels.into_iter().map(Unknown::Offset));
        }
        let sizes = Sizes::of(&model.parameters);
        let plausible = unknowns.iter().map(|unknown| match unknown {
            Unknown::Attachment(..) => ATTACHMENTS * sizes.arm,
            _ => ANCHORS * sizes.reach,
        });
        let plausible = DVector::from_iterator(unknowns.len(), plausible);
        Ok(Self { examined, geometry, unknowns, plausible, samples })
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

    /// The equations of a sample with so much added to the unknowns.
    pub(super) fn equations(&self, sample: &Sample, change: &DVector<f64>) -> Equations {
        let rows = sample.lengths.len();
        let mut slopes = DMatrix::zeros(rows, self.unknowns.len());
        let mut by_pose = DMatrix::zeros(rows, 3);
        let mut residual = DVector::zeros(rows);
        let mut covariance = DMatrix::zeros(rows, rows);
        let at = |wanted: Unknown| self.unknowns.iter().position(|u| *u == wanted);
        let added = |wanted: Unknown| at(wanted).map_or(0.0, |k| change[k]);
        let [x, y, phi] = sample.pose;
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
            covariance[(row, row)] = length.noise * length.noise;
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
        let pose = DMatrix::from_diagonal(&DVector::from_iterator(3, sample.pose_noise.iter().map(|s| s * s)));
        covariance += &by_pose * pose * by_pose.transpose();
        let channels = sample.lengths.iter().map(|l| l.channel).collect();
        Equations { residual, slopes, covariance, channels }
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
    let missing: Vec<&str> = ["x", "y", "phi"]
        .into_iter()
        .enumerate()
        .filter(|(k, _)| has(Channel::Pose(*k)).is_none())
        .map(|(_, n)| n)
        .collect();
    if !missing.is_empty() {
        return Err(wrong(format!(
            "{} not measured; a calibration compares lengths with the pose and needs x, y and phi",
            missing.join(", ")
        )));
    }
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
            && !by_force
            && has(Channel::Tension(i)).is_none()
        {
            return Err(wrong(format!(
                "unstretched_length[{0}] needs the tension by which cable {0} is stretched: a column tension[{0}], or winches \
                 commanded by force",
                i + 1
            )));
        }
    }
    let noise = |channel: Channel| {
        let noise = place(channel).map_or(f64::NAN, |j| noise_by_differences(trial, j));
        if noise.is_nan() { channel.noise_floor() } else { noise.max(channel.noise_floor()) }
    };
    let pose_noise = [0, 1, 2].map(|k| noise(Channel::Pose(k)));
    let lengths: Vec<(Channel, usize, f64)> =
        lengths.into_iter().map(|c| (c, place(c).unwrap_or_default(), noise(c))).collect();
    let pose_at = [0, 1, 2].map(|k| place(Channel::Pose(k)).unwrap_or_default());
    let bias = examined.plant.pose_sensor_bias();
    let mut out = Vec::new();
    for (k, row) in trial.measured.iter().enumerate() {
        let pose: [f64; 3] = std::array::from_fn(|axis| row[pose_at[axis]] - bias[axis]);
        if pose.iter().any(|v| !v.is_finite()) {
            continue;
        }
        let length = |(channel, j, noise): &(Channel, usize, f64)| {
            let (Channel::CableLength(cable) | Channel::UnstretchedLength(cable)) = *channel else { return None };
            let shown = has(Channel::Tension(cable)).map(|j| row[j]).filter(|v| v.is_finite());
            let tension = shown.unwrap_or(trial.inputs[k].winch_force[cable]).max(0.0);
            let known = by_force || shown.is_some() || !elastic || matches!(channel, Channel::CableLength(_));
            let whole = row[*j].is_finite() && known;
            whole.then_some(Length { channel: *channel, cable, value: row[*j], noise: *noise, tension })
        };
        let lengths: Vec<Length> = lengths.iter().filter_map(length).collect();
        if !lengths.is_empty() {
            out.push(Sample { pose, pose_noise, time: trial.time[k], lengths, trial: t });
        }
    }
    Ok(out)
}

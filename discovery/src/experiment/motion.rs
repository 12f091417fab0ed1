//! The family of motions that are tried: a few smooth waves in each coordinate and in the pretension, within the limits by
//! construction.

use std::f64::consts::TAU;

use cdpr::geometry::Geometry;
use cdpr::kinematics::cables;
use cdpr::model_file::Model;
use cdpr::per_cable::PerCable;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix3xX, Vector3};

use crate::model::sizes::Sizes;

use super::PlanError;
use super::limits::{Limits, inside};

/// Waves of each coordinate.
const WAVES: usize = 5;
/// Coordinates: x, y, φ and the pretension.
const COORDINATES: usize = 4;
/// Numbers of a coordinate: its waves' amplitudes and phases, its middle and its extent.
const NUMBERS: usize = 2 * WAVES + 2;
/// Numbers from 0 to 1 that make a motion: those of the coordinates, and the time to fade in.
pub(super) const GENES: usize = COORDINATES * NUMBERS + 1;

/// Highest frequency where none is asked for, times the period in which the platform swings on its cables: slow enough for a
/// controller to follow.
const FASTEST: f64 = 0.3;
/// Shares of the duration in which a motion fades in, and out again.
const FADES: [f64; 2] = [0.03, 0.3];
/// Points at which a motion is looked at in a period of its fastest wave.
const POINTS: f64 = 24.0;
/// Fewest points.
const FEWEST_POINTS: f64 = 500.0;
/// Share of a speed limit that is used: between points it may be a little more.
const SPEED_MARGIN: f64 = 0.99;
/// Share of the tension's range that is left free at both ends for what the platform's control adds.
const TENSION_MARGIN: f64 = 0.04;

/// All motions that are tried.
pub(super) struct Family {
    limits: Limits,
    start: [f64; 3],
    fastest: f64,
    statics: Statics,
}

/// One motion.
#[derive(Clone, Debug)]
pub(super) struct Motion {
    start: [f64; 3],
    duration: f64,
    fade: f64,
    /// Of each pose coordinate the middle, minus the start, and its waves.
    middle: [f64; 3],
    waves: [Waves; COORDINATES],
    /// What all of a coordinate is multiplied by, to keep its speed.
    slower: [f64; 3],
    /// Middle of the mean tension (N).
    pretension: f64,
}

/// A sum of waves.
#[derive(Clone, Debug)]
struct Waves {
    /// Amplitude, angular frequency (rad/s), phase.
    terms: [[f64; 3]; WAVES],
    /// Taken off, so that the sum is about zero.
    mean: f64,
}

impl Waves {
    /// The value with its first two derivatives.
    fn at(&self, time: f64) -> [f64; 3] {
        self.terms.iter().fold([-self.mean, 0.0, 0.0], |sum, [amplitude, rate, phase]| {
            let (sin, cos) = (rate * time + phase).sin_cos();
            [sum[0] + amplitude * sin, sum[1] + amplitude * rate * cos, sum[2] - amplitude * rate * rate * sin]
        })
    }

    fn scaled(mut self, factor: f64) -> Self {
        self.terms.iter_mut().for_each(|term| term[0] *= factor);
        self.mean *= factor;
        self
    }
}

/// A quintic from 0 to 1 as `share` goes from 0 to 1, with derivatives to the share.
fn fade(share: f64) -> [f64; 3] {
    let s = share.clamp(0.0, 1.0);
    let value = s.powi(3) * (10.0 + s * (6.0 * s - 15.0));
    [value, 30.0 * (s * (1.0 - s)).powi(2), 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)]
}

impl Motion {
    /// From 0 at rest to 1 and back, with derivatives.
    fn gate(&self, time: f64) -> [f64; 3] {
        let way = time.min(self.duration - time);
        let side = if time <= 0.5 * self.duration { 1.0 } else { -1.0 };
        let [value, slope, bend] = fade(way / self.fade);
        [value, side * slope / self.fade, bend / self.fade.powi(2)]
    }

    /// Pose, twist and acceleration at a time (s).
    pub(super) fn at(&self, time: f64) -> [[f64; 3]; 3] {
        let [g, dg, ddg] = self.gate(time);
        let mut out = [[0.0; 3]; 3];
        for axis in 0..3 {
            let [w, dw, ddw] = self.waves[axis].at(time);
            let w = w + self.middle[axis];
            let s = self.slower[axis];
            out[0][axis] = self.start[axis] + s * g * w;
            out[1][axis] = s * (dg * w + g * dw);
            out[2][axis] = s * (ddg * w + 2.0 * dg * dw + g * ddw);
        }
        out
    }

    /// Mean tension that is asked for (N).
    pub(super) fn mean_tension(&self, time: f64) -> f64 {
        self.pretension + self.gate(time)[0] * self.waves[3].at(time)[0]
    }

    pub(super) fn duration(&self) -> f64 {
        self.duration
    }
}

impl Family {
    pub(super) fn new(model: &Model, limits: &Limits) -> Result<Self, PlanError> {
        let geometry = Geometry::new(&model.parameters);
        for x in limits.pose[0] {
            for y in limits.pose[1] {
                let pose = [x, y, 0.5 * (limits.pose[2][0] + limits.pose[2][1])];
                let refused = |e| PlanError::Limits(format!("the corner x = {x}, y = {y} of the limits: {e}"));
                geometry.check_pose(&pose).map_err(refused)?;
            }
        }
        let start = limits.start.unwrap_or(model.start.pose);
        inside(&limits.pose, &start).map_err(|message| {
            PlanError::Limits(format!(
                "the model's start pose: {message}; where the machine begins elsewhere write `start = [x, y, phi]`"
            ))
        })?;
        let own = FASTEST / Sizes::of(&model.parameters).swing;
        let fastest = limits.fastest.unwrap_or(own.min(0.1 / limits.interval)).max(1.0 / limits.duration);
        let statics = Statics::new(model, geometry);
        let family = Self { limits: limits.clone(), start, fastest, statics };
        let at_rest = family.tensions(&[[start, [0.0; 3], [0.0; 3]]]);
        if at_rest[0] > at_rest[1] {
            let message = format!(
                "at the start pose no tensions from {} to {} N hold the platform: `tension` is too narrow, or the start is at the \
                 edge of the workspace",
                limits.tension[0], limits.tension[1]
            );
            return Err(PlanError::Limits(message));
        }
        Ok(family)
    }

    pub(super) fn limits(&self) -> &Limits {
        &self.limits
    }

    /// The motion of these numbers.
    ///
    /// # Errors
    /// Where no pretension keeps the tensions within their limits.
    pub(super) fn motion(&self, genes: &[f64]) -> Result<Motion, PlanError> {
        let limits = &self.limits;
        let duration = limits.duration;
        let fade = duration * (FADES[0] + (FADES[1] - FADES[0]) * genes[GENES - 1]);
        let unit: Vec<Waves> = genes.chunks_exact(NUMBERS).take(COORDINATES).map(|own| self.waves(own)).collect();
        let middle_and_extent = |coordinate: usize, [low, high]: [f64; 2]| {
            let own = &genes[coordinate * NUMBERS + 2 * WAVES..];
            let middle = low + own[0] * (high - low);
            (middle, own[1] * (middle - low).min(high - middle))
        };
        let mut motion = Motion {
            start: self.start,
            duration,
            fade,
            middle: [0.0; 3],
            waves: std::array::from_fn(|coordinate| unit[coordinate].clone()),
            slower: [1.0; 3],
            pretension: 0.0,
        };
        for axis in 0..3 {
            let (middle, extent) = middle_and_extent(axis, limits.pose[axis]);
            motion.middle[axis] = middle - self.start[axis];
            motion.waves[axis] = unit[axis].clone().scaled(extent);
        }
        let times = self.times();
        let fastest = |of: &dyn Fn([f64; 3]) -> f64| times.iter().map(|t| of(motion.at(*t)[1])).fold(0.0, f64::max);
        let slower = |limit: f64, speed: f64| if speed > 0.0 { (SPEED_MARGIN * limit / speed).min(1.0) } else { 1.0 };
        let along = slower(limits.speed, fastest(&|v| v[0].hypot(v[1])));
        let turning = slower(limits.angular_speed, fastest(&|v| v[2].abs()));
        motion.slower = [along, along, turning];
        let path: Vec<[[f64; 3]; 3]> = times.iter().map(|t| motion.at(*t)).collect();
        let range = self.tensions(&path);
        if range[0] > range[1] {
            return Err(PlanError::Drive(
                "no pretension keeps the tensions of a motion within their limits".to_owned(),
            ));
        }
        let (middle, extent) = middle_and_extent(3, range);
        motion.pretension = middle;
        motion.waves[3] = unit[3].clone().scaled(extent);
        Ok(motion)
    }

    /// The waves of one coordinate, from -1 to 1. Amplitudes fall with the frequency, so that each wave can be as fast.
    fn waves(&self, own: &[f64]) -> Waves {
        let slowest = 1.0 / self.limits.duration;
        let ratio = (self.fastest / slowest).powf(1.0 / (WAVES - 1) as f64);
        let terms = std::array::from_fn(|k| {
            let frequency = ratio.powi(k as i32);
            [own[k].powi(2) / frequency, TAU * slowest * frequency, TAU * own[WAVES + k]]
        });
        let waves = Waves { terms, mean: 0.0 };
        let values = self.times().into_iter().map(|t| waves.at(t)[0]);
        let [low, high] = values.fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], v| [l.min(v), h.max(v)]);
        let half = (0.5 * (high - low)).max(f64::MIN_POSITIVE);
        // Between the points a wave may go a little higher.
        Waves { mean: 0.5 * (low + high), ..waves }.scaled(SPEED_MARGIN / half)
    }

    /// Times at which a motion is looked at.
    fn times(&self) -> Vec<f64> {
        let duration = self.limits.duration;
        let count = (POINTS * self.fastest * duration).max(FEWEST_POINTS).ceil() as usize;
        (0..=count).map(|k| duration * k as f64 / count as f64).collect()
    }

    /// Least and largest mean tension for which all tensions along a path stay within the limits, with a margin; the least is
    /// above the largest where there is none.
    fn tensions(&self, path: &[[[f64; 3]; 3]]) -> [f64; 2] {
        let [low, high] = self.limits.tension;
        let margin = TENSION_MARGIN * (high - low);
        let (low, high) = (low + margin, high - margin);
        let mut range = [low, high];
        for [pose, twist, acceleration] in path {
            let Some(line) = self.statics.line(pose, twist, acceleration) else { return [f64::INFINITY, 0.0] };
            for (offset, slope) in line.offset.iter().zip(line.slope) {
                let bounds = [low, high].map(|bound| (bound - offset) / slope);
                if slope > NO_SLOPE {
                    range = [range[0].max(bounds[0]), range[1].min(bounds[1])];
                } else if slope < -NO_SLOPE {
                    range = [range[0].max(bounds[1]), range[1].min(bounds[0])];
                } else if !(low..=high).contains(offset) {
                    return [f64::INFINITY, 0.0];
                }
            }
        }
        range
    }
}

/// Change of a tension with the mean below which there is none.
const NO_SLOPE: f64 = 1e-9;

/// What tensions a motion takes.
pub(super) struct Statics {
    geometry: Geometry,
    gravity: [f64; 2],
    mass: f64,
    inertia: f64,
    /// Mass of a metre of each cable (kg/m).
    density: Vec<f64>,
}

/// The tensions nearest to each other that make a wrench: `offset + slope · mean`.
pub(super) struct TensionLine {
    pub(super) offset: PerCable<f64>,
    pub(super) slope: PerCable<f64>,
}

impl TensionLine {
    /// The tensions of this mean.
    pub(super) fn of_mean(&self, mean: f64) -> PerCable<f64> {
        PerCable::from_fn(self.offset.len(), |i| self.offset[i] + self.slope[i] * mean)
    }
}

impl Statics {
    pub(super) fn new(model: &Model, geometry: Geometry) -> Self {
        let plant = cdpr::dynamics::PlantData::new(&model.parameters);
        Self {
            geometry,
            gravity: model.parameters.gravity,
            mass: plant.mass,
            inertia: plant.inertia,
            density: plant.cables.iter().map(|cable| cable.density).collect(),
        }
    }

    /// The tensions that accelerate platform and cables so; `None` at a singular pose.
    pub(super) fn line(&self, pose: &[f64; 3], twist: &[f64; 3], acceleration: &[f64; 3]) -> Option<TensionLine> {
        let cables = cables(&self.geometry, pose, twist);
        let mut mass = Matrix3::from_diagonal(&Vector3::new(self.mass, self.mass, self.inertia));
        for (cable, density) in cables.iter().zip(&self.density) {
            // A third of a cable swings with the platform.
            let row = Vector3::from(cable.normal_row());
            mass += density * cable.length / 3.0 * row * row.transpose();
        }
        let weight = Vector3::new(self.gravity[0], self.gravity[1], 0.0) * self.mass;
        let wrench = mass * Vector3::from(*acceleration) - weight;
        let structure = Matrix3xX::from_fn(cables.len(), |r, c| -cables[c].jacobian_row()[r]);
        let inverse = (structure.clone() * structure.transpose()).try_inverse()?;
        let least: DVector<f64> = structure.transpose() * inverse * wrench;
        let count = cables.len();
        let ones = DVector::from_element(count, 1.0);
        let product: DMatrix<f64> = structure.transpose() * inverse * &structure;
        let internal = &ones - product * &ones;
        let (mean, share) = (least.mean(), internal.mean());
        // Where the mean cannot be chosen, as with three cables, there is nothing internal.
        let slope = if share > NO_SLOPE { internal / share } else { DVector::zeros(count) };
        let offset = least - &slope * mean;
        Some(TensionLine {
            offset: PerCable::from_fn(count, |i| offset[i]),
            slope: PerCable::from_fn(count, |i| slope[i]),
        })
    }
}

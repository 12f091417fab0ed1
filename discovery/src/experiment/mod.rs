//! The next experiment: the motion, within limits, that best tells apart what recordings so far did not, or that shows
//! smaller sizes of a law.
//!
//! Two laws are told apart by the least squares that the one leaves where the other is true (T-optimality: A. C. Atkinson and
//! V. V. Fedorov, Biometrika 62 (1975), 57). Along a motion that is simulated under control the signatures of both laws pass
//! through the filter of the discovery; what of their difference no parameter of the other law makes up for is what the
//! criterion is expected to differ by. The verdict's own rules say what difference is enough.

mod apart;
mod drive;
mod limits;
mod lower;
mod motion;
mod question;
mod search;
#[cfg(test)]
mod tests;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use cdpr::per_cable::PerCable;

use crate::strategy::context::Progress;

pub use limits::Limits;

use apart::{Bench, Pair};
use lower::Lower;
use motion::{Family, Motion};
use question::Question;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The limits make no sense, or leave no motion.
    #[error("{0}")]
    Limits(String),
    /// The file is no `discovery.json`, or not that of the model.
    #[error("{0}")]
    Discovery(String),
    /// The discovery leaves nothing open.
    #[error("the verdict is `{0}`: no effect has a rival that is as good, so there is nothing to tell apart")]
    NothingOpen(String),
    /// The model cannot be driven through any motion within the limits.
    #[error("{0}")]
    Drive(String),
}

/// What an experiment is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Aim {
    /// To tell apart the explanations that were as good as each other.
    TellApart,
    /// To lower the detection limit of an effect.
    Lower {
        /// Its id.
        id: String,
        /// The cable, or each.
        cable: Option<usize>,
    },
}

/// A planned motion, and what is expected of it.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The motion, a row a sample.
    pub rows: Vec<Row>,
    /// Each two laws in question, the first of which is taken to be true.
    pub pairs: Vec<Expected>,
    /// The detection limits that were to be lowered.
    pub lowered: Vec<Lowered>,
    /// What of the limits it uses.
    pub used: Vec<Used>,
    /// Motions that were tried.
    pub tried: usize,
}

/// One sample of a plan.
#[derive(Clone, Debug)]
pub struct Row {
    /// Time (s).
    pub time: f64,
    /// Pose, twist, acceleration that are asked for (m, rad, s).
    pub motion: [[f64; 3]; 3],
    /// Winch forces by which the model with what was found follows, held until the next row (N).
    pub winch_force: PerCable<f64>,
    /// Tensions that it then has (N).
    pub tension: PerCable<f64>,
}

/// What is expected of one law against another, with the first one true.
#[derive(Clone, Debug)]
pub struct Expected {
    /// The law that is true.
    pub truth: EffectSpec,
    /// The law that is fitted in its place.
    pub rival: EffectSpec,
    /// By how much the criterion prefers the first on the recordings so far; `None` between two rivals, which were not held
    /// against each other.
    pub now: Option<f64>,
    /// By how much it is expected to on a recording of the plan.
    pub planned: f64,
    /// From which difference the verdict tells the two apart there.
    pub asked: f64,
    /// The least expected difference that is above that in 99 of 100 recordings, of the law itself as well.
    pub needed: f64,
}

impl Expected {
    /// Whether the two are told apart in 99 of 100 recordings.
    pub fn told_apart(&self) -> bool {
        self.planned >= self.needed
    }
}

/// A detection limit so far, and as expected of two recordings of the plan, one held out.
#[derive(Clone, Debug)]
pub struct Lowered {
    /// The effect.
    pub id: String,
    /// On this cable.
    pub cable: Option<usize>,
    /// The parameter that is its size; of a vector the names of its parts.
    pub parameter: String,
    /// The unit of that.
    pub unit: String,
    /// Whether the effect shows up to this size rather than from it on.
    pub at_most: bool,
    /// So far; `None` where nothing shows.
    pub now: Option<f64>,
    /// With the plan; `None` where nothing shows.
    pub planned: Option<f64>,
}

impl Lowered {
    /// Whether smaller effects show.
    pub fn better(&self) -> bool {
        match (self.now, self.planned) {
            (_, None) => false,
            (None, Some(_)) => true,
            (Some(now), Some(planned)) => (planned < now) != self.at_most && planned != now,
        }
    }
}

/// How much of a limit a plan uses.
#[derive(Clone, Debug)]
pub struct Used {
    /// The limit's key.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Least and largest value of the plan.
    pub range: [f64; 2],
    /// The limits.
    pub limit: [f64; 2],
}

/// Share of a limit's range that a plan may leave at an end where that limit binds: the margin for tensions is less.
const BINDS: f64 = 0.05;

impl Used {
    /// Whether the plan goes to the limit.
    pub fn binds(&self) -> bool {
        let ([low, high], [least, most]) = (self.range, self.limit);
        let left = BINDS * (most - least);
        // Nothing is kept from being at rest.
        high > most - left || (least != 0.0 && low < least + left)
    }
}

/// Plans the motion that serves an aim best, after `discovery` (the text of `discovery.json`, written with `model`).
///
/// # Errors
/// A file that is no discovery of this model or leaves nothing open, limits without a motion, a model that cannot be driven.
pub fn plan(
    discovery: &str,
    model: &Model,
    limits: &Limits,
    aim: &Aim,
    progress: Progress<'_>,
) -> Result<Plan, PlanError> {
    let question = Question::read(discovery, model, limits)?;
    let bench = Bench::new(&question, limits);
    let (known, lower) = match aim {
        Aim::TellApart if question.open.is_empty() => return Err(PlanError::NothingOpen(question.verdict)),
        Aim::TellApart => (Vec::new(), None),
        Aim::Lower { id, cable } => {
            let lower = Lower { bench: &bench, model, given: question.given, id, cable: *cable };
            (question.limits_of(id, *cable)?, Some(lower))
        }
    };
    let family = Family::new(model, limits)?;
    progress("trying motions", 0.0);
    let merit = |motion: &Motion, interval: f64| match &lower {
        Some(lower) => lower.merit(motion, interval),
        None => bench.pairs(motion, interval).map(|pairs| search::merit(&pairs)),
    };
    let best = search::best(&family, &merit, progress)?;
    progress("looking at the best motion in full", 0.95);
    let motion = family.motion(&best.genes)?;
    let (pairs, lowered) = match &lower {
        Some(lower) => (Vec::new(), lower.limits(&motion, limits.interval, &known).map_err(PlanError::Drive)?),
        None => (bench.pairs(&motion, limits.interval).map_err(PlanError::Drive)?, Vec::new()),
    };
    let driven = drive::drive(model, &motion, &bench.channels(), limits.interval).map_err(PlanError::Drive)?;
    bench.check_tensions(&driven).map_err(PlanError::Drive)?;
    let rows = driven.trial.time.iter().enumerate().map(|(k, time)| Row {
        time: *time,
        motion: motion.at(*time),
        winch_force: driven.trial.inputs[k].winch_force,
        tension: driven.tension[k],
    });
    let rows: Vec<Row> = rows.collect();
    let used = used(&rows, limits);
    progress("done", 1.0);
    let pairs = pairs.iter().map(|pair| expected(pair, &question)).collect();
    Ok(Plan { rows, pairs, lowered, used, tried: best.tried })
}

fn expected(pair: &Pair, question: &Question) -> Expected {
    let open = &question.open[pair.open];
    let now = match (pair.truth, pair.rival) {
        (0, rival) => Some(open.now[rival]),
        (truth, 0) => Some(-open.now[truth]),
        _ => None,
    };
    Expected {
        truth: open.laws[pair.truth].clone(),
        rival: open.laws[pair.rival].clone(),
        now,
        planned: pair.difference,
        asked: pair.asked,
        needed: pair.needed,
    }
}

fn used(rows: &[Row], limits: &Limits) -> Vec<Used> {
    let range = |of: &dyn Fn(&Row) -> Vec<f64>| {
        let values = rows.iter().flat_map(of);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(v), high.max(v)])
    };
    let mut out: Vec<Used> = [("x", "m"), ("y", "m"), ("phi", "rad")]
        .into_iter()
        .enumerate()
        .map(|(axis, (name, unit))| Used {
            name,
            unit,
            range: range(&|row| vec![row.motion[0][axis]]),
            limit: limits.pose[axis],
        })
        .collect();
    let speed = range(&|row| vec![row.motion[1][0].hypot(row.motion[1][1])]);
    let turn = range(&|row| vec![row.motion[1][2].abs()]);
    out.push(Used { name: "speed", unit: "m/s", range: speed, limit: [0.0, limits.speed] });
    out.push(Used { name: "angular_speed", unit: "rad/s", range: turn, limit: [0.0, limits.angular_speed] });
    out.push(Used { name: "tension", unit: "N", range: range(&|row| row.tension.to_vec()), limit: limits.tension });
    out
}

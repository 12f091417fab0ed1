//! What the model misses, against the variable it depends on, with the fitted law through it.
//!
//! The points are the smoothed latent disturbances of the model as given, less what the other effects found explain.
//! Effects that no force at a winch or on the platform stands for (sensors, geometry, the cables' own law) share one
//! picture: the error of the model as given against what was found to change.

use std::f64::consts::TAU;

use cdpr::effect::{EffectKind, EffectSpec, WinchContext};
use cdpr::formula::{Formula, Variable};
use cdpr::geometry::Geometry;

use super::trials::all_channels;
use crate::hypothesis::facts::{Picture, facts};
use crate::outcome::{Compared, Discovery, Found};
use crate::report::{Signature, channel_words, printed};

use super::label::{errors, heading};
use super::moment::{Moment, moments};

/// Time between points (s): nearer ones are the same estimate twice.
const INTERVAL: f64 = 0.25;
/// Points of a law.
const LAW: usize = 241;
/// A wind below this (m/s) is none that a plot would show.
const CALM: f64 = 0.02;
/// Most points of the picture that effects share.
const SHARED: usize = 1200;

type Points = Box<dyn Fn(&Moment, &Rest<'_>) -> Vec<[f64; 2]>>;

/// How one effect is drawn.
struct View {
    x: (String, &'static str),
    y: (String, &'static str),
    /// Variable and missing force at a moment; several where the effect acts on several cables or axes.
    points: Points,
    law: Box<dyn Fn(f64) -> f64>,
}

/// What stays of the missing forces when the other effects are taken away.
struct Rest<'a> {
    others: &'a [(&'a EffectSpec, EffectKind)],
}

impl Rest<'_> {
    fn pull(&self, moment: &Moment, i: usize) -> f64 {
        moment.latent.pull[i] - self.others.iter().map(|(spec, kind)| moment.pull(spec, kind, i)).sum::<f64>()
    }

    fn wrench(&self, moment: &Moment) -> [f64; 3] {
        let mut left = moment.missing_wrench();
        for (spec, kind) in self.others {
            for (sum, part) in left.iter_mut().zip(moment.wrench(spec, kind)) {
                *sum -= part;
            }
        }
        left
    }
}

/// One picture for each effect and term that has one of its own, then the one that the others share.
pub(super) fn signatures(discovery: &Discovery) -> Vec<Signature> {
    let found: Vec<&Found> = discovery.effects.iter().chain(&discovery.terms).collect();
    let kinds: Vec<Option<EffectKind>> = found.iter().map(|f| EffectKind::new(&f.effect).ok()).collect();
    let geometry = Geometry::new(&discovery.base.parameters);
    let all: Vec<Moment> = discovery.trials.iter().flat_map(|t| moments(t, &geometry, INTERVAL)).collect();
    let mut list = Vec::new();
    let mut shared = false;
    for (k, one) in found.iter().enumerate() {
        let others: Vec<(&EffectSpec, EffectKind)> = (0..found.len())
            .filter(|other| *other != k)
            .filter_map(|other| Some((&found[other].effect, kinds[other].clone()?)))
            .collect();
        match kinds[k].as_ref().and_then(|kind| view(one, kind, &all)) {
            Some(view) => list.push(drawn(one, &view, &all, &Rest { others: &others })),
            None => shared = true,
        }
    }
    if shared {
        list.extend(common(discovery));
    }
    list
}

fn drawn(found: &Found, view: &View, moments: &[Moment], rest: &Rest<'_>) -> Signature {
    let points: Vec<[f64; 2]> = moments.iter().flat_map(|m| (view.points)(m, rest)).collect();
    Signature {
        label: heading(found),
        x_name: view.x.0.clone(),
        x_unit: view.x.1.to_owned(),
        y_name: view.y.0.clone(),
        y_unit: view.y.1.to_owned(),
        law: curve(&points, &view.law),
        points,
    }
}

/// The law over the range of the points.
fn curve(points: &[[f64; 2]], law: &dyn Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let xs = points.iter().map(|p| p[0]).filter(|x| x.is_finite());
    let (low, high) = xs.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if low > high {
        return Vec::new();
    }
    (0..LAW)
        .map(|k| low + (high - low) * k as f64 / (LAW - 1) as f64)
        .map(|x| [x, law(x)])
        .filter(|p| p[1].is_finite())
        .collect()
}

/// How an effect is drawn; `None` where no force stands for it.
fn view(found: &Found, kind: &EffectKind, moments: &[Moment]) -> Option<View> {
    let spec = &found.effect;
    let values = spec.values.clone();
    let size = values.first().copied().unwrap_or_default();
    let effect = kind.clone();
    match facts(&spec.id).picture {
        Picture::WinchLoss => {
            // A loss that follows the load is drawn for the mean load.
            let force = mean(moments, spec, |m, i| m.inputs.winch_force[i]);
            let law = move |speed| effect.loss(force, &WinchContext { time: 0.0, speed });
            Some(at_winches(spec, ("reel-out speed", "m/s"), |m, i| m.winch_speed[i], law))
        }
        Picture::WinchCommand => {
            let law = move |force| effect.command(force, &[], &mut [], &WinchContext { time: 0.0, speed: 0.0 }) - force;
            Some(at_winches(spec, ("winch force", "N"), |m, i| m.inputs.winch_force[i], law))
        }
        Picture::Late => {
            Some(at_winches(spec, ("rate of winch force", "N/s"), |m, i| m.force_rate[i], move |x| -size * x))
        }
        Picture::WinchInertia => {
            Some(at_winches(spec, ("reel-out acceleration", "m/s²"), |m, i| m.winch_acceleration[i], move |x| size * x))
        }
        Picture::LinearDrag => Some(drag([0.0; 2], move |speed| size * speed)),
        Picture::QuadraticDrag => Some(drag([values[1], values[2]], move |speed| size * speed * speed)),
        Picture::RotationalDamping => Some(torque(("angular rate", "rad/s"), |m| m.twist[2], move |x| -size * x)),
        Picture::Inertia => Some(torque(("angular acceleration", "rad/s²"), |m| m.acceleration[2], move |x| -size * x)),
        Picture::Mass => Some(View {
            x: ("acceleration along x, and along y".to_owned(), "m/s²"),
            y: ("missing force along the same".to_owned(), "N"),
            points: Box::new(|m, rest| {
                let wrench = rest.wrench(m);
                (0..2).map(|k| [m.acceleration[k], wrench[k]]).collect()
            }),
            law: Box::new(move |x| -size * x),
        }),
        Picture::Wind if values[0].hypot(values[1]) > 0.0 => {
            let strength = values[0].hypot(values[1]);
            let along = [values[0] / strength, values[1] / strength];
            Some(force_along(along, "the wind", ("time", "s"), |m| m.time, move |_| strength))
        }
        Picture::Wind => Some(torque(("time", "s"), |m| m.time, move |_| values[2])),
        Picture::Gust => {
            let [amplitude, frequency, phase, direction] = values[..] else { return None };
            let period = TAU / frequency;
            let along = [direction.cos(), direction.sin()];
            let law = move |t: f64| amplitude * (frequency * t + phase).sin();
            Some(force_along(
                along,
                "the gust",
                ("time within the period", "s"),
                move |m| m.time.rem_euclid(period),
                law,
            ))
        }
        Picture::Spring => {
            let axis = usize::from(spread(moments, 1) > spread(moments, 0));
            let (name, ground) = (["x", "y"][axis], values[2 + axis]);
            Some(View {
                x: (format!("position {name}"), "m"),
                y: (format!("missing force along {name}"), "N"),
                points: Box::new(move |m, rest| vec![[m.pose[axis], rest.wrench(m)[axis]]]),
                law: Box::new(move |x| -size * (x - ground)),
            })
        }
        Picture::Term => term(spec, &errors(found), kind),
        Picture::Shared => None,
    }
}

/// The cables an effect acts on, from 0: the one that it names, or all of a robot.
fn acted_on(cable: Option<usize>, m: &Moment) -> std::ops::Range<usize> {
    cable.map_or(0..m.cables.len(), |cable| cable - 1..cable)
}

fn at_winches(
    spec: &EffectSpec,
    (name, unit): (&str, &'static str),
    variable: impl Fn(&Moment, usize) -> f64 + 'static,
    law: impl Fn(f64) -> f64 + 'static,
) -> View {
    let on = spec.cable;
    let (of, at) = match spec.cable {
        Some(cable) => (format!("\u{a0}{cable}"), format!("winch\u{a0}{cable}")),
        None => (" of each winch".to_owned(), "that winch".to_owned()),
    };
    View {
        x: (format!("{name}{of}"), unit),
        y: (format!("missing pull at {at}"), "N"),
        points: Box::new(move |m, rest| acted_on(on, m).map(|i| [variable(m, i), rest.pull(m, i)]).collect()),
        law: Box::new(law),
    }
}

fn torque(
    (name, unit): (&str, &'static str),
    variable: impl Fn(&Moment) -> f64 + 'static,
    law: impl Fn(f64) -> f64 + 'static,
) -> View {
    View {
        x: (name.to_owned(), unit),
        y: ("missing torque on the platform".to_owned(), "N m"),
        points: Box::new(move |m, rest| vec![[variable(m), rest.wrench(m)[2]]]),
        law: Box::new(law),
    }
}

fn force_along(
    along: [f64; 2],
    what: &str,
    (name, unit): (&str, &'static str),
    variable: impl Fn(&Moment) -> f64 + 'static,
    law: impl Fn(f64) -> f64 + 'static,
) -> View {
    View {
        x: (name.to_owned(), unit),
        y: (format!("missing force along {what}"), "N"),
        points: Box::new(move |m, rest| {
            let wrench = rest.wrench(m);
            vec![[variable(m), along[0] * wrench[0] + along[1] * wrench[1]]]
        }),
        law: Box::new(law),
    }
}

fn drag(wind: [f64; 2], law: impl Fn(f64) -> f64 + 'static) -> View {
    let (x, y) = if wind[0].hypot(wind[1]) > CALM {
        ("speed of the platform through the air", "missing force against the flow")
    } else {
        ("speed of the platform", "missing force against the motion")
    };
    View {
        x: (x.to_owned(), "m/s"),
        y: (y.to_owned(), "N"),
        points: Box::new(move |m, rest| {
            let v = [m.twist[0] - wind[0], m.twist[1] - wind[1]];
            let speed = v[0].hypot(v[1]);
            let wrench = rest.wrench(m);
            if speed > 0.0 { vec![[speed, -(wrench[0] * v[0] + wrench[1] * v[1]) / speed]] } else { Vec::new() }
        }),
        law: Box::new(law),
    }
}

/// A term against its variable where it has only one, else against its own value.
fn term(spec: &EffectSpec, errors: &[f64], kind: &EffectKind) -> Option<View> {
    let target = spec.target.clone()?;
    let formula = Formula::parse(spec.expression.as_deref()?).ok()?;
    let winch = target.strip_prefix("winch[").and_then(|rest| rest.strip_suffix(']')?.parse::<usize>().ok());
    let axis = match target.as_str() {
        "platform.force_x" => 0,
        "platform.force_y" => 1,
        _ => 2,
    };
    let y = match winch {
        Some(i) => (format!("missing pull at winch\u{a0}{i}"), "N"),
        None => (
            ["missing force along x", "missing force along y", "missing torque"][axis].to_owned(),
            ["N", "N", "N m"][axis],
        ),
    };
    let residual = move |m: &Moment, rest: &Rest<'_>| match winch {
        Some(i) => rest.pull(m, i - 1),
        None => rest.wrench(m)[axis],
    };
    if let [only] = formula.variables()[..] {
        let (name, unit) = named(only);
        return Some(View {
            x: (name, unit),
            y,
            points: Box::new(move |m, rest| vec![[value(m, only), residual(m, rest)]]),
            law: Box::new(move |x| formula.value(|_| x)),
        });
    }
    let kind = kind.clone();
    let unit = y.1;
    Some(View {
        x: (format!("the term, {}", printed(spec.expression.as_deref().unwrap_or_default(), errors)), unit),
        y,
        points: Box::new(move |m, rest| {
            let own = match winch {
                Some(winch) => m.in_context(|context| kind.pull(context, winch)),
                None => m.in_context(|context| kind.wrench(context))[axis],
            };
            vec![[own, residual(m, rest)]]
        }),
        law: Box::new(|x| x),
    })
}

fn value(m: &Moment, variable: Variable) -> f64 {
    match variable {
        Variable::Time => m.time,
        Variable::Pose(k) => m.pose[k],
        Variable::Twist(k) => m.twist[k],
        Variable::WinchForce(i) => m.inputs.winch_force[i],
        Variable::Disturbance(k) => m.inputs.disturbance[k],
        Variable::CableLength(i) | Variable::UnstretchedLength(i) => m.cables[i].length,
        Variable::CableSpeed(i) => m.cables[i].speed,
        Variable::UnstretchedRate(i) => m.winch_speed[i],
    }
}

/// A variable's name for people and its unit.
fn named(variable: Variable) -> (String, &'static str) {
    let unit = match variable.unit() {
        "N.m" => "N m",
        unit => unit,
    };
    (channel_words(&variable.name()), unit)
}

fn mean(moments: &[Moment], spec: &EffectSpec, value: impl Fn(&Moment, usize) -> f64) -> f64 {
    let values = moments.iter().flat_map(|m| acted_on(spec.cable, m).map(move |i| (m, i)));
    let (sum, count) = values.fold((0.0, 0), |(sum, count), (m, i)| (sum + value(m, i), count + 1));
    sum / f64::from(count.max(1))
}

/// Range of a coordinate of the platform (m).
fn spread(moments: &[Moment], axis: usize) -> f64 {
    let (low, high) =
        moments.iter().map(|m| m.pose[axis]).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    high - low
}

/// The error of the model as given against what the model with everything found predicts otherwise, in the channel that
/// gains most.
fn common(discovery: &Discovery) -> Option<Signature> {
    let noise = |c| discovery.whiteness.iter().find(|w| w.channel == c).map_or(f64::NAN, |w| w.noise);
    let gained = |c| -> f64 {
        let per_trial = |t: &Compared| -> f64 {
            let Some(j) = t.trial.channels.iter().position(|other| *other == c) else { return 0.0 };
            let gain = |k: usize| {
                let m = t.trial.measured[k][j];
                (t.before[k][j] - m).powi(2) - (t.after[k][j] - m).powi(2)
            };
            (0..t.trial.len()).map(gain).filter(|g| g.is_finite()).sum::<f64>() / noise(c).powi(2)
        };
        discovery.trials.iter().map(per_trial).sum()
    };
    let channels = all_channels(discovery);
    let best = channels.into_iter().filter(|c| gained(*c) > 0.0).max_by(|a, b| gained(*a).total_cmp(&gained(*b)))?;
    let mut points = Vec::new();
    for t in &discovery.trials {
        let Some(j) = t.trial.channels.iter().position(|c| *c == best) else { continue };
        points.extend((0..t.trial.len()).filter_map(|k| {
            let point = [t.after[k][j] - t.before[k][j], t.trial.measured[k][j] - t.before[k][j]];
            (point[0].is_finite() && point[1].is_finite()).then_some(point)
        }));
    }
    let every = points.len().div_ceil(SHARED).max(1);
    let points: Vec<[f64; 2]> = points.into_iter().step_by(every).collect();
    let name = channel_words(&best.name());
    Some(Signature {
        label: format!("all that was found, in {name}"),
        x_name: format!("change of the predicted {name} by what was found"),
        x_unit: best.unit().to_owned(),
        y_name: "measured minus model as given".to_owned(),
        y_unit: best.unit().to_owned(),
        law: curve(&points, &|x| x),
        points,
    })
}

//! What a machine may do in an experiment: `limits.toml`.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use crate::data::Channel;

use super::PlanError;

/// Limits of a planned motion. SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Box of the pose: least and largest x, y (m) and φ (rad).
    pub pose: [[f64; 2]; 3],
    /// Largest speed of the platform's reference point (m/s).
    pub speed: f64,
    /// Largest angular speed (rad/s).
    pub angular_speed: f64,
    /// Least and largest tension of each cable (N).
    pub tension: [f64; 2],
    /// Length of the recording (s).
    pub duration: f64,
    /// Sampling interval (s).
    pub interval: f64,
    /// Where the machine stands at the beginning (m, rad); that of the model's start where it is not said.
    pub start: Option<[f64; 3]>,
    /// Highest frequency of the motion and of the pretension (Hz); the robot's own where it is not said.
    pub fastest: Option<f64>,
    /// White noise of channels, by name, that replaces what the recordings had.
    pub noise: BTreeMap<String, f64>,
}

/// Fewest samples of a recording that says anything.
const FEWEST_SAMPLES: f64 = 200.0;
/// Most samples of a plan.
const MOST_SAMPLES: f64 = 1e6;

/// The keys of the file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Keys {
    x: Spanned<[f64; 2]>,
    y: Spanned<[f64; 2]>,
    phi: Spanned<[f64; 2]>,
    speed: Spanned<f64>,
    angular_speed: Spanned<f64>,
    tension: Spanned<[f64; 2]>,
    duration: Spanned<f64>,
    interval: Spanned<f64>,
    start: Option<Spanned<[f64; 3]>>,
    fastest: Option<Spanned<f64>>,
    #[serde(default)]
    noise: BTreeMap<String, Spanned<f64>>,
}

impl Limits {
    /// Reads the text of `limits.toml`.
    ///
    /// # Errors
    /// Syntax, unknown or missing keys, empty ranges: with the line, what was found and what was expected.
    pub fn from_toml(text: &str) -> Result<Self, PlanError> {
        let line = |at: usize| text.as_bytes()[..at.min(text.len())].iter().filter(|b| **b == b'\n').count() + 1;
        let keys: Keys = toml::from_str(text).map_err(|e| {
            let place = e.span().map_or(String::new(), |span| format!("line {}: ", line(span.start)));
            PlanError::Limits(format!("{place}{}", e.message()))
        })?;
        let bad = |at: usize, message: String| PlanError::Limits(format!("line {}: {message}", line(at)));
        let range = |name: &str, value: &Spanned<[f64; 2]>| {
            let [low, high] = *value.get_ref();
            if low.is_finite() && high.is_finite() && low <= high {
                return Ok([low, high]);
            }
            let message = format!("`{name}` is [{low}, {high}], expected the least and the largest value, finite");
            Err(bad(value.span().start, message))
        };
        let positive = |name: &str, value: &Spanned<f64>| {
            let number = *value.get_ref();
            if number.is_finite() && number > 0.0 {
                return Ok(number);
            }
            Err(bad(value.span().start, format!("`{name}` is {number}, expected a number above zero")))
        };
        let pose = [range("x", &keys.x)?, range("y", &keys.y)?, range("phi", &keys.phi)?];
        let tension = range("tension", &keys.tension)?;
        if tension[0] < 0.0 || tension[0] == tension[1] {
            let message = format!(
                "`tension` is [{}, {}], expected a least tension of zero or more, and a larger one: cables cannot push",
                tension[0], tension[1]
            );
            return Err(bad(keys.tension.span().start, message));
        }
        let (duration, interval) = (positive("duration", &keys.duration)?, positive("interval", &keys.interval)?);
        let samples = duration / interval;
        if !(FEWEST_SAMPLES..=MOST_SAMPLES).contains(&samples) {
            let message = format!(
                "{duration} s at an interval of {interval} s are {samples:.0} samples, expected {FEWEST_SAMPLES} to {MOST_SAMPLES}"
            );
            return Err(bad(keys.interval.span().start, message));
        }
        let fastest = keys.fastest.as_ref().map(|value| positive("fastest", value)).transpose()?;
        if let (Some(hertz), Some(key)) = (fastest, &keys.fastest)
            && !(1.0 / duration..=0.1 / interval).contains(&hertz)
        {
            let message = format!(
                "`fastest` is {hertz} Hz, expected {} to {}: one period in the recording, ten samples in a period",
                1.0 / duration,
                0.1 / interval
            );
            return Err(bad(key.span().start, message));
        }
        let start = keys.start.as_ref().map(Spanned::get_ref).copied();
        if let (Some(start), Some(key)) = (start, &keys.start) {
            inside(&pose, &start).map_err(|message| bad(key.span().start, format!("`start`: {message}")))?;
        }
        let noise = keys.noise.iter().map(|(name, value)| Ok((name.clone(), positive(name, value)?)));
        Ok(Self {
            pose,
            speed: positive("speed", &keys.speed)?,
            angular_speed: positive("angular_speed", &keys.angular_speed)?,
            tension,
            duration,
            interval,
            start,
            fastest,
            noise: noise.collect::<Result<_, PlanError>>()?,
        })
    }

    /// Noise by channel of a robot with so many cables; a name without a number stands for all cables.
    pub(super) fn noise_of(&self, channel: Channel) -> Option<f64> {
        let name = channel.name();
        let family = name.split('[').next().unwrap_or(&name);
        self.noise.get(&name).or_else(|| self.noise.get(family)).copied()
    }

    /// A name under `[noise]` that is no channel of a robot with so many cables.
    pub(super) fn unknown_noise(&self, cables: usize) -> Option<String> {
        let known: Vec<String> = Channel::all(cables).iter().map(|c| c.name()).collect();
        let family = |name: &String| name.split('[').next().unwrap_or(name).to_owned();
        let is_known = |name: &&String| known.contains(name) || known.iter().any(|k| family(k) == **name);
        self.noise.keys().find(|name| !is_known(name)).cloned()
    }
}

/// Whether a pose is within a box.
pub(super) fn inside(limits: &[[f64; 2]; 3], pose: &[f64; 3]) -> Result<(), String> {
    for ((name, [low, high]), value) in ["x", "y", "phi"].iter().zip(limits).zip(pose) {
        if !(*low..=*high).contains(value) {
            return Err(format!("{name} is {value}, outside the limits of {name}, {low} to {high}"));
        }
    }
    Ok(())
}

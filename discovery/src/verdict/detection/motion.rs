//! Whether a machine moves in its recordings.

use cdpr::effect::{DependsOn, EffectSpec};

use crate::data::{Channel, Trial};
use crate::filter::estimate::for_trial;
use crate::filter::kalman::Randomness;

/// Scatter of a channel, in multiples of its noise, up to which it shows nothing else: the noise is known to some per cent.
const NOISE: f64 = 1.2;

/// Whether any sensor of the pose or of a length shows more than its noise. Where none does, the machine is at rest, and a
/// signature of a law of motion would be made of the errors of the speed.
pub(super) fn moves(trials: &[Trial], randomness: &Randomness) -> bool {
    trials.iter().any(|trial| {
        let own = for_trial(randomness, trial);
        let shows = |j: usize| {
            let memory = own.memory.iter().filter(|m| m.channel == j).map(|m| m.deviation.powi(2));
            let noise = (own.noise[j].powi(2) + memory.sum::<f64>()).sqrt();
            scatter(trial.measured.iter().map(|row| row[j])) > NOISE * noise
        };
        (0..trial.channels.len()).filter(|j| !matches!(trial.channels[*j], Channel::Tension(_))).any(shows)
    })
}

/// Standard deviation of the numbers there are.
fn scatter(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let known = || values.clone().filter(|v| v.is_finite());
    let count = known().count().max(1) as f64;
    let mean = known().sum::<f64>() / count;
    (known().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt()
}

/// Whether an effect is nothing but a law of motion. Without gravity what depends on accelerations is; with it a mass has its
/// weight.
pub(super) fn is_of_motion(effect: &EffectSpec, gravity: bool) -> bool {
    let Ok(on) = effect.depends_on() else { return false };
    let of_motion = |on: &DependsOn| match on {
        DependsOn::Speed | DependsOn::Direction => true,
        DependsOn::Acceleration => !gravity,
        _ => false,
    };
    on.iter().any(of_motion) && on.iter().all(|on| of_motion(on) || *on == DependsOn::Tension)
}

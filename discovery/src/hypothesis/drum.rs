//! A drum off its axis: its two likenesses.
//!
//! The length differs from what is counted by the wave e (cos(s/r + ψ) - cos ψ). Lengths of a few turns, far from where nothing is
//! paid out, show its size, its mean e cos ψ and its phase s/r + ψ at their middle; with -ψ, and 1/r larger by 2ψ/s, these are
//! the same.

use std::f64::consts::TAU;

use cdpr::effect::EffectSpec;

use crate::data::{Channel, Trial};
use crate::hypothesis::extension::value_of;

pub(crate) const ID: &str = "winch_drum_eccentricity";

/// The phase (rad) and the radius (m) of the likeness of a drum in the measured lengths.
pub(crate) fn mirrored(effect: &EffectSpec, trials: &[Trial]) -> Option<[(&'static str, f64); 2]> {
    if effect.id != ID {
        return None;
    }
    let (radius, phase) = (value_of(effect, "drum_radius")?, value_of(effect, "phase")?);
    let turned = 2.0 * phase - TAU * (2.0 * phase / TAU).round();
    let number = 1.0 / radius + turned / middle(effect.cable, trials)?;
    (number > 0.0).then(|| [("drum_radius", 1.0 / number), ("phase", phase - turned)])
}

/// Mean of the lengths (m) that a winch has paid out, or all of them.
fn middle(cable: Option<usize>, trials: &[Trial]) -> Option<f64> {
    let of_winch = |channel: &Channel| match channel {
        Channel::UnstretchedLength(k) => cable.is_none_or(|cable| cable == k + 1),
        _ => false,
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for trial in trials {
        let shown: Vec<usize> = (0..trial.channels.len()).filter(|j| of_winch(&trial.channels[*j])).collect();
        for length in trial.measured.iter().flat_map(|row| shown.iter().map(|j| row[*j])).filter(|l| l.is_finite()) {
            sum += length;
            count += 1.0;
        }
    }
    (count > 0.0 && sum > 0.0).then(|| sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;

    #[test]
    fn a_drum_and_its_likeness_show_the_same_length() {
        let trials = [record(&[], 20.0, 5)];
        let drum = EffectSpec::new(ID, Some(1), &[0.01, 0.3, 0.4]).expect("an effect");
        let at =
            |name: &str, values: [(&str, f64); 2]| values.iter().find(|(known, _)| *known == name).expect("a value").1;
        let other = mirrored(&drum, &trials).expect("a likeness");
        let (radius, phase) = (at("drum_radius", other), at("phase", other));
        assert_eq!(phase, -0.4);
        assert!((radius - 0.3).abs() > 5e-5, "{radius}");
        let middle = middle(Some(1), &trials).expect("a length");
        let wave = |radius: f64, phase: f64| (middle / radius + phase).cos() - phase.cos();
        assert!((wave(0.3, 0.4) - wave(radius, phase)).abs() < 1e-9);
        let likeness = EffectSpec::new(ID, Some(1), &[0.01, radius, phase]).expect("an effect");
        let back = mirrored(&likeness, &trials).expect("a drum");
        assert!((at("drum_radius", back) - 0.3).abs() < 1e-12);
        assert!(
            mirrored(&EffectSpec::new("length_sensor_scale", Some(1), &[1e-3]).expect("an effect"), &trials).is_none()
        );
    }
}

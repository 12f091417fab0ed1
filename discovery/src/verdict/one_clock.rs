//! Winches that are late, and sensors that are: nothing tells the two apart.

use crate::data::{Channel, Trial};
use crate::filter::kalman::Randomness;
use crate::outcome::Found;

/// Where all winches may have a dead time.
const ONE_CLOCK: &str = "A dead time of all winches does what clocks of all sensors would do that are late by as much against the one of the \
                         recorded forces: no recording with these clocks tells the two apart.";

/// What is said where all winches may have a dead time, or all sensors be late.
pub(super) fn one_clock(found: &[Found], randomness: &Randomness, trials: &[Trial]) -> Option<String> {
    let either = found.iter().any(may_be_a_dead_time) || all_are_late(randomness, trials);
    either.then(|| ONE_CLOCK.to_owned())
}

/// Whether an effect is a dead time of all winches, or as well explained by one.
fn may_be_a_dead_time(found: &Found) -> bool {
    let as_good = found.alternatives.iter().filter(|other| other.indistinguishable).map(|other| &other.effect);
    let mut all = as_good.chain([&found.effect]);
    all.any(|effect| effect.id == "winch_delay" && effect.cable.is_none())
}

/// Whether all that is measured is late against the recorded forces.
fn all_are_late(randomness: &Randomness, trials: &[Trial]) -> bool {
    let all = Channel::all(trials.first().map_or(0, Trial::cables));
    let measured = |channel: &Channel| trials.iter().any(|trial| trial.channels.contains(channel));
    all.iter().zip(&randomness.late).filter(|(channel, _)| measured(channel)).all(|(_, late)| *late > 0.0)
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::outcome::Alternative;
    use crate::write::fixture::friction;

    /// Winches with a lag of 20 ms were lengths that are late by 13.5 ms, and nobody was told that the two are alike.
    #[test]
    fn what_is_late_throughout_may_be_a_dead_time() {
        let trials = [crate::data::recording::record(&[], 4.0, 7)];
        let plain = crate::data::recording::fitted(&[], &trials).randomness;
        let late = |of: &dyn Fn(usize) -> f64| {
            let late = (0..plain.late.len()).map(of).collect();
            all_are_late(&Randomness { late, ..plain.clone() }, &trials)
        };
        assert!(late(&|_| 0.0135) && late(&|at| 0.01 + 0.001 * at as f64));
        assert!(!late(&|_| 0.0) && !late(&|at| if at < 3 { 0.02 } else { 0.0 }) && !late(&|_| -0.01));
    }

    /// A lag of all winches took the place of a dead time that was as good, and nobody was told that late sensors are as good as well.
    #[test]
    fn what_may_be_a_dead_time_may_be_late_clocks() {
        let law = |id: &str, cable: Option<usize>, value: f64| EffectSpec::new(id, cable, &[value]).expect("an effect");
        let friction = friction();
        let found = |effect: EffectSpec, other: EffectSpec, as_good: bool| {
            let alternatives =
                vec![Alternative { effect: other, indistinguishable: as_good, ..friction.alternatives[0].clone() }];
            Found { effect, alternatives, ..friction.clone() }
        };
        let (lag, dead_time) = (law("winch_lag", None, 0.01), law("winch_delay", None, 0.01));
        assert!(may_be_a_dead_time(&found(dead_time.clone(), lag.clone(), false)));
        assert!(may_be_a_dead_time(&found(lag.clone(), dead_time.clone(), true)));
        assert!(!may_be_a_dead_time(&found(lag.clone(), dead_time, false)));
        assert!(!may_be_a_dead_time(&found(lag, law("winch_delay", Some(2), 0.01), true)));
    }
}

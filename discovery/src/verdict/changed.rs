//! What changed between the training data and the held-out data, where no law holds in both.

use cdpr::effect::EffectSpec;

use super::POLICY;
use crate::outcome::{HORIZON, HorizonGap};
use crate::write::{in_numbers, in_place};

/// What is said where nothing was found that explains the gap: of a `law` that explains most of what is left in the training data, while the
/// held-out data contradict it, or of a model that goes with the training data and not with the held-out ones; none where it is neither.
pub(crate) fn changed(law: Option<&EffectSpec>, horizons: &[HorizonGap]) -> Option<String> {
    if let Some(law) = law {
        return Some(format!(
            "The data that were fitted show {} ({}), and those that were held out contradict it: something changed between them.",
            in_place(law),
            in_numbers(law, &[])
        ));
    }
    let telling = || horizons.iter().filter(|gap| gap.judged && gap.horizon <= HORIZON);
    let at_noise = |gap: f64, attainable: f64| gap <= POLICY.at_noise * attainable;
    let fitted = telling().all(|gap| at_noise(gap.train.after, gap.attainable));
    let held_out = telling().all(|gap| at_noise(gap.holdout.after, gap.attainable));
    (fitted && !held_out).then(|| {
        "The model agrees with the data that were fitted, and not with those that were held out: something changed between them. To find it, \
         fit those that were held out."
            .to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::BeforeAfter;

    #[test]
    fn a_law_of_the_training_data_alone_and_a_gap_of_the_held_out_data_alone_are_changes() {
        let gap = |horizon: f64, train: f64, holdout: f64| {
            let [train, holdout] = [train, holdout].map(|after| BeforeAfter { before: after, after });
            HorizonGap { horizon, train, holdout, attainable: 1.1, scatter: 0.01, judged: true, channels: Vec::new() }
        };
        let friction = EffectSpec::new("winch_viscous_friction", Some(2), &[200.0]).expect("an effect");
        let said = changed(Some(&friction), &[gap(5.0, 40.0, 1.0)]).expect("a change");
        assert!(
            said.starts_with("The data that were fitted show viscous friction on winch 2 (coefficient 200"),
            "{said}"
        );
        let of_gaps = |train: f64, holdout: f64| {
            changed(None, &[gap(1.0, 1.0, 1.0), gap(5.0, train, holdout), gap(20.0, 9.0, 9.0)])
        };
        assert!(of_gaps(1.2, 7.0).is_some_and(|said| said.contains("not with those that were held out")));
        for (train, holdout) in [(1.2, 1.2), (7.0, 7.0), (7.0, 1.2)] {
            assert_eq!(of_gaps(train, holdout), None);
        }
        let far = HorizonGap { judged: false, ..gap(5.0, 1.0, 7.0) };
        assert_eq!(changed(None, &[far]), None);
    }
}

//! What changed from one recording to another, where no law holds in all.

use cdpr::effect::EffectSpec;

use super::POLICY;
use super::by_recording::OfRecording;
use crate::outcome::{HORIZON, HorizonGap};
use crate::report::{gap_text, join};
use crate::write::{in_numbers, in_place};

/// What is said of recordings that the model misses while it agrees with others that were fitted, each by itself; none where there are none.
pub(crate) fn unlike(recordings: &[OfRecording]) -> Option<String> {
    let noise = POLICY.least..=POLICY.at_noise;
    let agree: Vec<&OfRecording> = recordings.iter().filter(|recording| noise.contains(&recording.gap)).collect();
    let differ: Vec<&OfRecording> = recordings.iter().filter(|recording| recording.gap >= POLICY.unlike).collect();
    let trained = |recordings: &[&OfRecording]| recordings.iter().any(|recording| !recording.holdout);
    let names = |recordings: &[&OfRecording]| {
        let names: Vec<&str> = recordings.iter().map(|recording| recording.name.as_str()).collect();
        join(&names, "and")
    };
    let most = differ.iter().map(|recording| recording.gap).fold(0.0, f64::max);
    (trained(&agree) && trained(&differ)).then(|| {
        format!(
            "The model agrees with {}, each by itself, and misses {} by up to {} times the noise: something was different there. To find it, \
             search what differs by itself.",
            names(&agree),
            names(&differ),
            gap_text(most)
        )
    })
}

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
    let at_noise =
        |of: fn(&HorizonGap) -> f64| telling(horizons).all(|gap| of(gap) <= POLICY.at_noise * gap.attainable);
    (at_noise(|gap| gap.train.after) && !at_noise(|gap| gap.holdout.after)).then(|| {
        "The model agrees with the data that were fitted, and not with those that were held out: something changed between them. To find it, \
         fit those that were held out."
            .to_owned()
    })
}

/// Whether more than noise is left in any of the data over a horizon that tells of the model.
pub(crate) fn more_is_left(horizons: &[HorizonGap]) -> bool {
    telling(horizons).any(|gap| gap.train.after.max(gap.holdout.after) > POLICY.at_noise * gap.attainable)
}

fn telling(horizons: &[HorizonGap]) -> impl Iterator<Item = &HorizonGap> {
    horizons.iter().filter(|gap| gap.judged && gap.horizon <= HORIZON)
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
        // One of two that were fitted differs, or both do and what was held out does not.
        let of = |name: &str, holdout: bool, gap: f64| OfRecording { name: name.to_owned(), holdout, gap };
        let recordings =
            |gaps: [f64; 3]| [of("a.csv", false, gaps[0]), of("b.csv", false, gaps[1]), of("h.csv", true, gaps[2])];
        let said = unlike(&recordings([1.0, 25.04, 1.1])).expect("a recording that differs");
        assert!(
            said.starts_with(
                "The model agrees with a.csv and h.csv, each by itself, and misses b.csv by up to 25.0 times"
            ),
            "{said}"
        );
        for gaps in [[9.0, 25.0, 1.1], [1.0, 1.2, 7.0], [1.0, 1.0, 1.0], [1.0, 1.9, 1.0], [0.05, 25.0, 1.0]] {
            assert_eq!(unlike(&recordings(gaps)), None);
        }
    }
}

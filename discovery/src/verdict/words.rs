//! The reasons of a verdict in words.

use super::judge::Reason;
use crate::outcome::Remaining;

/// A number with three digits at most.
fn short(value: f64) -> String {
    crate::report::significant(value, 2)
}

/// A force (N) that is none: it moves no robot by what is measured.
const NO_FORCE: f64 = 1e-6;

/// What is left on held-out data, in units that a machine's owner knows.
pub(crate) fn left_over(remaining: &[Remaining]) -> String {
    let over = |left: &Remaining| {
        let parts = [(left.position, "mm"), (left.rotation, "mrad in φ"), (left.length, "mm in the lengths")];
        let misses = parts.iter().filter_map(|(value, unit)| Some(format!("{} {unit}", short(1e3 * (*value)?))));
        let mut list: Vec<String> = misses.collect();
        // Where no force at random is left, what the smoother makes of none is rounding.
        list.extend((left.force > NO_FORCE).then(|| format!("{} N", short(left.force))));
        format!("over {} s {}", left.horizon, list.join(", "))
    };
    format!("Left on held-out data are {}.", remaining.iter().map(over).collect::<Vec<_>>().join("; "))
}

/// A reason as a sentence, the effects named by these phrases.
pub(crate) fn sentence(reason: &Reason, effects: &[String]) -> String {
    let name = |at: &usize| effects.get(*at).map_or("an effect", String::as_str);
    match reason {
        Reason::SmallDisturbance { force } => format!(
            "The gap that is left is that of a disturbance of about {} N that was not recorded: a force at random leaves \
             nothing else unexplained, and it is small against the winch forces.",
            short(*force)
        ),
        Reason::RandomDisturbance { force } => format!(
            "The gap that is left is that of a force at random of about {} N that was not recorded, as of wind: with it the \
             innovations are white, and no candidate explains more of it than chance.",
            short(*force)
        ),
        Reason::BelowNoise { horizon } => format!(
            "Over {horizon} s free runs miss by less than a tenth of the noise, which is not possible: what they were expected to miss by is wrong, \
             for the model has no trajectory near the data. No verdict goes by that."
        ),
        Reason::ForceLeft { force } => format!(
            "The data need a force at random of about {} N that was not recorded, and no free run tells what that leaves.",
            short(*force)
        ),
        Reason::Unrecorded { share } => format!(
            "{} % of the variance of the winch forces acts at random and is not in the recorded forces: commands that change \
             between rows, or a force that nobody measured. Whatever a model makes of the recorded forces passes beside that.",
            short(100.0 * share)
        ),
        Reason::Unexplained { gap, horizon, beyond_chance } => {
            let chance = if *beyond_chance {
                " It is no chance: no control run explains as much as the best candidate does, but no candidate predicts \
                 the held-out data."
            } else {
                ""
            };
            format!(
                "The model does not reproduce the data ({} times what a model without fault would leave over {horizon} s), \
                 and neither the catalogue nor the dictionary of terms explains it.{chance}",
                short(*gap)
            )
        }
        Reason::MoreIsLeft { gap, horizon } => format!(
            "More is missing than was found: what is left over {horizon} s is {} times what a model without fault would leave.",
            short(*gap)
        ),
        Reason::ExplainsLittle => {
            "What was found explains less than half of the gap; something else is missing too.".to_owned()
        }
        Reason::Coloured { channels } => format!(
            "What remains is not white in {}: neither the model nor what is known of the instruments fits to the last detail.",
            channels.join(", ")
        ),
        Reason::Uncertain { effect, relative_error } if relative_error.is_finite() => format!(
            "The size of the {} is not known well enough for a name: its standard error is {} times the size, which the best of \
             all laws may reach by chance.",
            name(effect),
            short(*relative_error)
        ),
        Reason::Uncertain { effect, .. } => format!("The size of the {} cannot be told from these data.", name(effect)),
        Reason::OutOfRange { effect } => format!(
            "The {} has a shape or a size out of the range in which it is itself: it stands for something else.",
            name(effect)
        ),
        Reason::Little { effect, share } => format!(
            "The {} takes away {} % of the gap: it is not what is missing.",
            name(effect),
            short(100.0 * share.max(0.0))
        ),
        Reason::Unsteady { effect } => format!(
            "The {} has another size from one stretch of time to the next, and free runs do not show that it is all that was missing: \
             it stands for a law of another form.",
            name(effect)
        ),
        Reason::BesideStandIn { effect, stand_in } => format!(
            "The {} explains less than the {}, which stands for a law of another form: it may be part of what that law does.",
            name(effect),
            name(stand_in)
        ),
        Reason::NotHeldOut { effect } => format!(
            "The {} acts at no time that was held out: no data show it but those by which it was found. Record what happened again, or \
             hold out a recording in which it acts.",
            name(effect)
        ),
        Reason::Chance { effect, runs, of } => {
            format!("Chance explains as much as the {} in {runs} of {of} control runs.", name(effect))
        }
        Reason::EndedEarly => {
            "The search ended before all was tried, for its time was over (journal): other laws may be missing, or may \
                               explain as much as what was found. With a longer --time-limit it tries more."
                .to_owned()
        }
        Reason::Growth { horizon } if *horizon > 0.0 => format!(
            "Free runs beyond {horizon} s say nothing of the model: an error of their start grows too fast. They are not \
             judged."
        ),
        Reason::Growth { .. } => {
            "Free runs say nothing of the model: an error of their start grows too fast. The innovations are judged."
                .to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "1.2×10⁻⁹ N" was said to be left where an error of the recorded forces was found.
    #[test]
    fn no_force_is_left_where_none_acts_at_random() {
        let left =
            |force| Remaining { horizon: 5.0, position: None, rotation: None, length: Some(0.021), force, torque: 0.0 };
        assert_eq!(left_over(&[left(1.2e-9)]), "Left on held-out data are over 5 s 21 mm in the lengths.");
        assert_eq!(left_over(&[left(3.4)]), "Left on held-out data are over 5 s 21 mm in the lengths, 3.4 N.");
    }
}

//! Whether what corrections leave of lengths is what the errors of a survey leave.
//!
//! More than that is left where a sensor has another scale, where nobody measured the poses, and of another robot. Where a tenth
//! of the motion is left it is another unit or another column, and that is no calibration.

use super::problem::Problem;
use super::solve::Solution;
use crate::data::Channel;
use crate::data::clean::median;

/// Share of what a length moves of which no more may be left. It moves by some 2.3 standard deviations, so what is left is some
/// twentieth of its variance.
const MOST_LEFT: f64 = 0.1;

/// Remarks on lengths of which more is left than the corrections could make that a survey may ask for.
///
/// # Errors
/// A length of whose motion the corrections leave more than [`MOST_LEFT`].
pub(super) fn check(problem: &Problem, solution: &Solution) -> Result<Vec<String>, String> {
    let mut remarks = Vec::new();
    for misfit in &solution.misfits {
        let (Channel::CableLength(cable) | Channel::UnstretchedLength(cable)) = misfit.channel else { continue };
        let most: f64 = problem.plausible_of(cable);
        if misfit.after <= most {
            continue;
        }
        let line = Resistant::through(&problem.shown(misfit.channel));
        let asked = line.in_proportion(misfit.channel, most).unwrap_or_else(|| {
            "Is it in another unit (`scale` in the map), or the pose, are columns exchanged, was the pose computed and not measured, \
             or is it another robot?"
                .to_owned()
        });
        let seen = format!(
            "{} is {:.6} m off the model's length at the recorded pose after all corrections, expected at most {most:.6} m, which \
             corrections of a plausible size could make. {asked}",
            misfit.channel.name(),
            misfit.after
        );
        if misfit.after.is_nan() || misfit.after > most.max(MOST_LEFT * line.moves) {
            return Err(seen);
        }
        remarks.push(seen);
    }
    Ok(remarks)
}

/// What is seen of lengths that are in proportion to the model's, a sentence each.
pub(super) fn in_proportion(problem: &Problem) -> Vec<String> {
    let of = |channel: Channel| {
        let (Channel::CableLength(cable) | Channel::UnstretchedLength(cable)) = channel else { return None };
        Resistant::through(&problem.shown(channel)).in_proportion(channel, problem.plausible_of(cable))
    };
    problem.lengths().into_iter().filter_map(of).collect()
}

/// The resistant line through what a sensor showed over what the model as given has there (J. W. Tukey, Exploratory Data Analysis,
/// 1977): through the medians of the outer thirds.
struct Resistant {
    slope: f64,
    /// Robust standard deviation of what was shown from the line (m).
    left: f64,
    /// From the median of the least third of what was shown to that of the largest (m).
    moves: f64,
}

impl Resistant {
    /// Through pairs of what the model has and what was shown.
    fn through(pairs: &[(f64, f64)]) -> Self {
        let third = pairs.len().div_ceil(3);
        let mut pairs = pairs.to_vec();
        pairs.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (least, largest) = (&pairs[..third], &pairs[pairs.len() - third..]);
        let moves = median(largest.iter().map(|p| p.1).collect()) - median(least.iter().map(|p| p.1).collect());
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        let outer = [&pairs[..third], &pairs[pairs.len() - third..]];
        let [(x0, y0), (x1, y1)] =
            outer.map(|part| (median(part.iter().map(|p| p.0).collect()), median(part.iter().map(|p| p.1).collect())));
        let slope = (y1 - y0) / (x1 - x0);
        let beside: Vec<f64> = pairs.iter().map(|(has, shown)| shown - slope * has).collect();
        let offset = median(beside.clone());
        let left = super::solve::deviation(beside.into_iter().map(|v| v - offset));
        Self { slope, left, moves }
    }

    /// The scale by which a length fits as well as corrections of a plausible size, the `most` (m), could make it, if it is off by more
    /// than these.
    fn in_proportion(&self, channel: Channel, most: f64) -> Option<String> {
        let is_scale = self.left <= most && (self.slope.recip() - 1.0).abs() * self.moves > most;
        is_scale.then(|| {
            format!(
                "{} times {:.3}, shifted, fits the model as given to {:.3} m: is that its `scale` in the map, or has the drum \
                 another radius?",
                channel.name(),
                self.slope.recip(),
                self.left
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every tenth number is wrong.
    #[test]
    fn a_scale_is_told_in_spite_of_outliers() {
        let pairs: Vec<(f64, f64)> = (0..300)
            .map(|k| (1.0 + f64::from(k * 7 % 300) / 300.0, k))
            .map(|(has, k)| (has, if k % 10 == 3 { 9.0 } else { 1.07 * has - 0.2 }))
            .collect();
        let line = Resistant::through(&pairs);
        assert!((line.slope - 1.07).abs() < 0.03 && line.left < 0.01, "{} {}", line.slope, line.left);
        assert!((line.moves - 0.71).abs() < 0.1, "{}", line.moves);
    }
}

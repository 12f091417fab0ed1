//! What one device remembers, exchanged for what another does, or divided into a drift and noise that forgets sooner: what explains most
//! by itself may stand for two that belong together.

use super::sizing::{At, Kind, STEPS, Size, Sizing, WORTH, less_memories};
use crate::data::device::Device;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::model::randomness::MOST_MEMORIES;
use crate::weigh::criterion::EVIDENCE;

/// Further moves of a trajectory that has lost by the first one what its linear model promised.
const FOLLOWING: usize = 2;

impl Sizing<'_> {
    /// `fit` where what one device was found to remember is another's, with what else is to be taken up then, as far as that is more
    /// likely: what explains most by itself may be less than two that belong together. Lengths that drift stand in for a pose that does
    /// and lengths whose noise has a memory.
    pub(super) fn exchanged(&self, mut fit: Fit, mut best: At) -> Result<(Fit, At), FitError> {
        let pairs = |drift: bool| {
            let to = move |from: Device| Device::ALL.into_iter().filter(move |to| *to != from);
            Device::ALL.into_iter().flat_map(move |from| to(from).map(move |to| (from, to, drift)))
        };
        for (from, to, drift) in [true, false].into_iter().flat_map(pairs) {
            let [given, taken] =
                [from, to].map(|device| if drift { Kind::Drift(device) } else { Kind::Colour(device) });
            if !self.has_memory(&best.randomness, from, drift) || self.channels(to).is_empty() {
                continue;
            }
            let without = less_memories(&best.randomness, &self.all, from, drift);
            let mut starts = self.starts(taken, &without.clone().bounded(), STEPS.1);
            if drift && self.trials.len() > 1 {
                starts.extend(self.starts(Kind::Origin(to), &without.bounded(), STEPS.1));
            }
            let starts = starts.into_iter().map(|start| self.at(&fit, start));
            let Some(start) = starts.min_by(|a, b| a.value.total_cmp(&b.value)) else { continue };
            // What stands beside it may still bring the rest, so that its own sizes need not be the best.
            let next = self.likely_enough(&fit, &self.sizes(taken), start, best.value);
            let next = self.grown(&fit, next, given, best.value);
            let cost = self.cost_beyond(&next.randomness, &best.randomness);
            let enough = best.value - cost - EVIDENCE;
            if next.value < enough
                && let Some(followed) = self.followed(fit.clone(), next, enough)?
            {
                (fit, best) = followed;
            }
        }
        Ok((fit, best))
    }

    /// `fit` where what a device remembers is noise with memory beside a drift, as far as that is more likely: noise whose memory has
    /// grown long enough for both has no room for the drift, and is nearer to it than either of the two is by itself.
    pub(super) fn divided(&self, mut fit: Fit, mut best: At) -> Result<(Fit, At), FitError> {
        for device in Device::ALL {
            let fits = best.randomness.memory.len() + self.channels(device).len() <= MOST_MEMORIES;
            let [colour, drift] = [false, true].map(|drift| self.has_memory(&best.randomness, device, drift));
            if !colour || drift || !fits {
                continue;
            }
            let without = less_memories(&best.randomness, &self.all, device, false).bounded();
            let drifting = self.starts(Kind::Drift(device), &without, STEPS.1).into_iter();
            let both = drifting.flat_map(|drifting| self.starts(Kind::Colour(device), &drifting, STEPS.1));
            let Some(start) = both.map(|both| self.at(&fit, both)).min_by(|a, b| a.value.total_cmp(&b.value)) else {
                continue;
            };
            let mut sizes = self.sizes(Kind::Colour(device));
            sizes.push(Size::Memories { device, drift: true });
            let both = self.likely_enough(&fit, &sizes, start, best.value);
            // Another memory may be all that it takes.
            let alone = self.at(&fit, less_memories(&both.randomness, &self.all, device, true));
            let pays = alone.value - both.value > self.cost_beyond(&both.randomness, &alone.randomness);
            let next = if pays { both } else { alone };
            let enough = best.value - self.cost_beyond(&next.randomness, &best.randomness) - EVIDENCE;
            if next.value < enough
                && let Some(followed) = self.followed(fit.clone(), next, enough)?
            {
                (fit, best) = followed;
            }
        }
        Ok((fit, best))
    }

    /// `from` with what pays beside it along the same trajectory, the most first, but for one kind, as far as it may come to `enough`.
    fn grown(&self, fit: &Fit, mut from: At, but: Kind, enough: f64) -> At {
        loop {
            let is_it = |kind: &Kind| match (kind, but) {
                (Kind::Origin(device), Kind::Drift(of)) => *device == of,
                _ => *kind == but,
            };
            let kinds = self.kinds(&from.randomness).into_iter().filter(|kind| !is_it(kind));
            let starts = kinds.flat_map(|kind| {
                self.starts(kind, &from.randomness, STEPS.0).into_iter().map(move |start| (kind, start))
            });
            let scanned = starts.map(|(kind, start)| (kind, self.at(fit, start)));
            let Some((kind, start)) = scanned.min_by(|a, b| a.1.value.total_cmp(&b.1.value)) else { return from };
            if from.value - start.value < 2.0 * WORTH {
                return from;
            }
            let next = self.likely_enough(fit, &self.sizes(kind), start, enough);
            if from.value - next.value < self.cost_beyond(&next.randomness, &from.randomness) + EVIDENCE {
                return from;
            }
            from = next;
        }
    }

    /// `fit` at the sizes of `at` on the trajectory that belongs to them, which no longer bends to what the instruments did; none
    /// where it is not as likely there as asked for, or there is none: what latent forces carried, as those of a law that is missing,
    /// lets the model go where its linear one does not tell.
    ///
    /// Of drifts and origins those stand that are not the same in all recordings.
    pub(super) fn followed(&self, mut fit: Fit, at: At, enough: f64) -> Result<Option<(Fit, At)>, FitError> {
        let at = self.not_the_same_in_all(&fit, at);
        fit.randomness = at.randomness.clone();
        // One move does where the model is nearly linear.
        for moves in [1, FOLLOWING] {
            for _ in 0..moves {
                match fit.smooth(self.trials) {
                    Err(FitError::Diverged { .. } | FitError::Simulation(_)) => return Ok(None),
                    moved => moved?,
                };
            }
            let there = self.at(&fit, at.randomness.clone());
            if there.value < enough {
                return Ok(Some((fit, there)));
            }
        }
        Ok(None)
    }
}

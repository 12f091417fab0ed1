//! The best of a family of motions: many at random, then the best ones varied, with a fixed amount of work.

use rayon::prelude::*;

use crate::strategy::context::Progress;

use super::PlanError;
use super::apart::Pair;
use super::motion::{Family, GENES, Motion};

/// Samples that are looked at over all motions: about a minute on two cores for two laws.
const WORK: f64 = 1.2e6;
/// Samples of a motion in the search: longer intervals are taken where there would be more.
const MOST_SAMPLES: f64 = 6000.0;
/// Least and most motions.
const MOTIONS: (f64, f64) = (60.0, 600.0);
/// Share of the work that goes to motions at random.
const AT_RANDOM: f64 = 0.3;
/// Motions that are looked at side by side.
const AT_ONCE: usize = 6;
/// Spread of a variation at first and at last, as a share of the range of each number.
const SPREADS: [f64; 2] = [0.3, 0.03];
/// Share of the numbers that a variation changes.
const CHANGED: f64 = 0.3;
/// Seed of all that is drawn.
const SEED: u64 = 7;

/// The best motion.
pub(super) struct Best {
    pub(super) genes: Vec<f64>,
    /// Motions that were tried.
    pub(super) tried: usize,
}

/// A motion that was looked at.
struct Looked {
    genes: Vec<f64>,
    merit: f64,
}

/// What a motion is worth: each two laws count by how far apart they are, less the farther they are already. What no motion
/// tells apart counts for nothing and is in nobody's way.
pub(super) fn merit(pairs: &[Pair]) -> f64 {
    pairs.iter().map(|pair| pair.reach()).map(|reach| reach / (1.0 + reach)).sum()
}

/// Looks for the motion of most merit, by the sampling interval (s) that is taken for it.
///
/// # Errors
/// Where no motion can be driven within the limits.
pub(super) fn best(
    family: &Family,
    merit: &(dyn Fn(&Motion, f64) -> Result<f64, String> + Sync),
    progress: Progress<'_>,
) -> Result<Best, PlanError> {
    let limits = family.limits();
    let interval = limits.interval.max(limits.duration / MOST_SAMPLES);
    let most = (WORK * interval / limits.duration).clamp(MOTIONS.0, MOTIONS.1) as usize;
    let mut random = fastrand::Rng::with_seed(SEED);
    let look = |genes: Vec<f64>| {
        let motion = family.motion(&genes).map_err(|e| e.to_string())?;
        merit(&motion, interval).map(|merit| Looked { merit, genes })
    };
    let (mut tried, mut best, mut refused) = (0, None::<Looked>, String::new());
    while tried < most {
        let share = tried as f64 / most as f64;
        let round: Vec<Vec<f64>> = (0..AT_ONCE)
            .map(|_| match &best {
                Some(best) if share > AT_RANDOM => varied(&best.genes, share, &mut random),
                _ => (0..GENES).map(|_| random.f64()).collect(),
            })
            .collect();
        tried += round.len();
        for looked in round.into_par_iter().map(look).collect::<Vec<_>>() {
            match looked {
                Ok(looked) if best.as_ref().is_none_or(|best| looked.merit > best.merit) => best = Some(looked),
                Ok(_) => {}
                Err(message) => refused = message,
            }
        }
        progress("trying motions", 0.95 * tried as f64 / most as f64);
    }
    let best = best.ok_or_else(|| {
        PlanError::Drive(format!("none of {tried} motions within the limits can be driven; the last: {refused}"))
    })?;
    Ok(Best { genes: best.genes, tried })
}

/// Some of the numbers moved, by less towards the end.
fn varied(genes: &[f64], share: f64, random: &mut fastrand::Rng) -> Vec<f64> {
    let late = (share - AT_RANDOM) / (1.0 - AT_RANDOM);
    let spread = SPREADS[0] * (SPREADS[1] / SPREADS[0]).powf(late);
    let mut moved = |gene: &f64| {
        let change = spread * (2.0 * random.f64() - 1.0 + random.f64() - random.f64());
        if random.f64() < CHANGED { (gene + change).clamp(0.0, 1.0) } else { *gene }
    };
    genes.iter().map(&mut moved).collect()
}

//! Trajectories that come along as latent forces become smaller.

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::estimate::Fit;
use crate::filter::kalman::Randomness;

/// Factor by which latent forces become smaller at once: a trajectory that was settled with the larger ones comes along.
const SMALLER: f64 = 5.0;

impl Fit {
    /// Settles trajectories that are there with larger latent forces with those of `own`, by sizes between, in at most so many moves at
    /// each: with small ones nothing but the model holds a trajectory that is still far off. Returns whether they stay.
    ///
    /// # Errors
    /// When the model cannot be simulated along a trajectory.
    pub(crate) fn settle_by_steps(
        &mut self,
        trials: &[Trial],
        own: &Randomness,
        most: usize,
    ) -> Result<bool, FitError> {
        for latents in between(&self.randomness, own) {
            self.randomness = latents;
            self.settle(trials, most)?;
        }
        self.randomness = own.clone();
        self.settle(trials, most)
    }
}

/// Sizes of latent forces between those of `loose` and its own, each smaller than the one before by at most a factor, with all else as
/// `own` has it.
fn between(loose: &Randomness, own: &Randomness) -> Vec<Randomness> {
    let smallest = own.smallest_latent();
    let ratio = |from: f64, to: f64| (from / to.max(smallest)).max(1.0);
    let (force, winch) = (ratio(loose.force, own.force), ratio(loose.winch, own.winch));
    let steps = (force.max(winch).ln() / SMALLER.ln()).ceil().max(1.0);
    let before = |step: f64| {
        let share = 1.0 - step / steps;
        Randomness {
            force: own.force.max(smallest) * force.powf(share),
            winch: own.winch.max(smallest) * winch.powf(share),
            ..own.clone()
        }
    };
    (1..steps as usize).map(|step| before(step as f64)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};

    #[test]
    fn latent_forces_become_smaller_by_steps() {
        let trials = [record(&[], 5.0, 1)];
        let own = fitted(&[], &trials).randomness.without_latents();
        let loose = Randomness { force: 60.0 * own.force, winch: 2.0 * own.winch, jitter: 0.1, ..own.clone() };
        let between_them = between(&loose, &own);
        let shares: Vec<f64> = between_them.iter().map(|latents| latents.force / own.force).collect();
        let expected = [60.0_f64.powf(2.0 / 3.0), 60.0_f64.powf(1.0 / 3.0)];
        assert!(shares.iter().zip(expected).all(|(share, expected)| (share - expected).abs() < 1e-9 * expected));
        assert!(shares.len() == 2 && between_them[0].winch < 2.0 * own.winch && between_them[0].winch > own.winch);
        assert!(between_them.iter().all(|latents| latents.jitter == own.jitter));
        // Larger ones are taken at once.
        assert!(between(&own, &loose).is_empty());
    }
}

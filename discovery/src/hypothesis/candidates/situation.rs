//! What is known of the data when candidates are set up.

use crate::data::{Channel, Trial};
use crate::model::sizes::usual_force;

/// What is known of the data when candidates are set up.
#[derive(Clone, Debug)]
pub(crate) struct Situation {
    /// Longest trial (s).
    pub(crate) duration: f64,
    /// Longest sampling interval of a trial, its median (s).
    pub(crate) interval: f64,
    /// Mean size of the winch forces (N).
    pub(crate) mean_tension: f64,
    /// Winch commands sorted, by cable (N).
    pub(crate) commands: Vec<Vec<f64>>,
    /// Frequencies (rad/s) at which the latent forces have peaks.
    pub(crate) peaks: Vec<f64>,
    /// Lengths at which the latent forces repeat.
    pub(crate) waves: Vec<Wave>,
    /// Radii (m) that a drum may have by the waves in its measured length, by cable, and of all alike.
    pub(crate) drums: (Vec<Option<f64>>, Option<f64>),
    /// Whether unstretched lengths, cable lengths, tensions, poses are measured.
    pub(crate) unstretched: Vec<bool>,
    pub(crate) lengths: Vec<bool>,
    pub(crate) tensions: Vec<bool>,
    pub(crate) pose: bool,
}

impl Situation {
    pub(crate) fn of(trials: &[Trial]) -> Self {
        let cables = trials.first().map_or(0, Trial::cables);
        let mut commands = vec![Vec::new(); cables];
        for trial in trials {
            for inputs in &trial.inputs {
                for (list, force) in commands.iter_mut().zip(inputs.winch_force) {
                    list.push(force);
                }
            }
        }
        for list in &mut commands {
            list.sort_by(f64::total_cmp);
        }
        let has = |wanted: Channel| trials.iter().any(|t| t.channels.contains(&wanted));
        Self {
            duration: trials.iter().map(|t| t.time[t.len() - 1] - t.time[0]).fold(0.0, f64::max),
            interval: trials.iter().map(Trial::interval).fold(0.0, f64::max),
            mean_tension: usual_force(trials),
            commands,
            peaks: Vec::new(),
            waves: Vec::new(),
            drums: (Vec::new(), None),
            unstretched: (0..cables).map(|i| has(Channel::UnstretchedLength(i))).collect(),
            lengths: (0..cables).map(|i| has(Channel::CableLength(i))).collect(),
            tensions: (0..cables).map(|i| has(Channel::Tension(i))).collect(),
            pose: (0..3).any(|k| has(Channel::Pose(k))),
        }
    }

    /// Number of cables.
    pub(crate) fn cables(&self) -> usize {
        self.commands.len()
    }

    /// All cables together, and each by its number.
    pub(crate) fn cables_and_all(&self) -> impl Iterator<Item = Option<usize>> + use<> {
        std::iter::once(None).chain((1..=self.cables()).map(Some))
    }

    /// The winch command below which a share of the commands lies (N), of one cable or of all.
    pub(crate) fn quantile(&self, cable: Option<usize>, share: f64) -> f64 {
        let of = |list: &[f64]| list[((list.len() - 1) as f64 * share) as usize];
        match cable {
            Some(c) => of(&self.commands[c - 1]),
            None => {
                let mut all: Vec<f64> = self.commands.iter().flatten().copied().collect();
                all.sort_by(f64::total_cmp);
                of(&all)
            }
        }
    }
}

/// A length (or time) at which a latent force repeats, as the coordinate it depends on moves.
#[derive(Clone, Debug)]
pub(crate) struct Wave {
    /// The latent: axis of the platform, or 3 and the cable's index.
    pub(crate) latent: usize,
    /// Name of the coordinate in an expression.
    pub(crate) coordinate: String,
    /// Wave number (rad per unit of the coordinate).
    pub(crate) number: f64,
    /// Middle of the coordinate's range, from which the phase counts, and half of the range.
    pub(crate) middle: f64,
    pub(crate) half_range: f64,
}

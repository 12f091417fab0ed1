//! A second look at laws that a wrong trajectory hides.
//!
//! Candidates are weighed by their signatures along the trajectory that the model without them gives. Where the missing
//! law is strong and not smooth (friction that holds a winch, a force at its limit, a sagging cable) or has a motion of its
//! own (a vibrating cable), that trajectory is so wrong that the signature misleads. So where the search explains little,
//! such laws are put into the model at a typical size and refined from there, one after the other.

use cdpr::effect::EffectSpec;

use crate::candidates::Situation;
use crate::estimate::FitError;
use crate::search::{Fitted, Search, Taken};

/// Gauss-Newton rounds that every law gets before the best goes on.
const FIRST_ROUNDS: usize = 5;

/// A law: effects that belong together, with the rivals each would have.
type Law = Vec<(EffectSpec, Vec<EffectSpec>)>;

/// Laws at typical sizes, on each cable and on all. The mass of cables of `density` (kg/m), spread along them, shows in two
/// effects, across and along, of which one alone explains little.
fn laws(situation: &Situation, density: f64) -> Vec<Law> {
    let mut out: Vec<Law> = Vec::new();
    for cable in [None, Some(1), Some(2), Some(3), Some(4)] {
        let effect = |id: &str, values: &[f64]| EffectSpec::new(id, cable, values).ok();
        let friction = effect("winch_coulomb_friction", &[150.0, 0.02]);
        let other = [
            effect("winch_stribeck_friction", &[150.0, 200.0, 0.1, 10.0]),
            effect("pulley_capstan_loss", &[150.0 / situation.mean_tension, 0.02]),
        ];
        let limits = effect("winch_saturation", &[situation.quantile(cable, 0.1), situation.quantile(cable, 0.9)]);
        let sag = effect("cable_sag", &[1.5, situation.mean_tension]);
        out.extend(friction.map(|friction| vec![(friction, other.into_iter().flatten().collect())]));
        out.extend([limits, sag].into_iter().flatten().map(|law| vec![(law, Vec::new())]));
    }
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).ok();
    let across = effect("cable_transverse_mode", &[density, 0.02, 0.0]);
    let along = effect("cable_axial_mass", &[density]);
    out.extend(across.zip(along).map(|(across, along)| vec![(across, Vec::new()), (along, Vec::new())]));
    out
}

impl Search<'_> {
    /// The law that explains most from a typical start, if it leaves less than half of the gap and is better than what
    /// was `found`; in place of that.
    pub(crate) fn second_look(&mut self, base: &Fitted, found: &Fitted) -> Result<Option<Fitted>, FitError> {
        let mut best: Option<(Fitted, Law)> = None;
        let situation = Situation::of(&self.evidence.train);
        let laws = laws(&situation, base.train.model.parameters.cable_density);
        let count = laws.len() as f64;
        for (k, law) in laws.into_iter().enumerate() {
            (self.progress)("a second look at friction, limits, sag and cable mass", 0.5 + 0.2 * k as f64 / count);
            let mut model = base.train.model.clone();
            model.effects.extend(law.iter().map(|(effect, _)| effect.clone()));
            let Ok(next) = self.fit(&model, base, FIRST_ROUNDS) else { continue };
            if next.score < best.as_ref().map_or(base.score, |(b, _)| b.score) {
                best = Some((next, law));
            }
        }
        let Some((start, law)) = best else { return Ok(None) };
        let next = self.fit(&start.train.model, &start, crate::search::ROUNDS)?;
        let better = next.left() < found.left() && next.score < found.score;
        if next.left() > 0.5 * base.left() || !better || !Self::helps(base, &next) {
            return Ok(None);
        }
        let delta_bic = next.score - base.score;
        for effect in &next.train.model.effects[self.given..] {
            self.note(effect, "added", delta_bic, "refined from a typical size");
        }
        self.taken = law.into_iter().map(|(_, rivals)| Taken { rivals, delta_bic, null_test: None }).collect();
        Ok(Some(next))
    }
}

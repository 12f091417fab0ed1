//! A second look at laws that a wrong trajectory hides.
//!
//! Candidates are weighed by their signatures along the trajectory that the model without them gives. Where the missing
//! law is strong and not smooth (friction that holds a winch, a force at its limit, a sagging cable) or has a motion of its
//! own (a vibrating cable), that trajectory is so wrong that the signature misleads. So where the search explains little,
//! such laws are put into the model at a typical size and refined from there, one after the other.

use std::sync::atomic::{AtomicUsize, Ordering};

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, FitError};
use crate::hypothesis::candidates::Situation;
use crate::hypothesis::extension::is_friction;
use crate::strategy::entrance::{Answer, Source};
use crate::strategy::fitted::{Fitted, Trained};
use crate::strategy::search::{EVIDENCE, FAR_OFF, ROUNDS, Search};
use crate::weigh::refine::refine;

/// Laws that go on to the whole.
const FINALISTS: usize = 3;
/// Gauss-Newton rounds on the beginnings, and on the whole.
const FIRST_ROUNDS: usize = 6;
const LAST_ROUNDS: usize = 5;

/// Friction at the start, as a share of the mean tension.
const FRICTION: f64 = 0.0075;

/// A law: effects that belong together, with the rivals each would have.
type Law = Vec<(EffectSpec, Vec<EffectSpec>)>;

/// Laws at typical sizes, on each cable and on all. The mass of cables of `density` (kg/m), spread along them, shows in two
/// effects, across and along, of which one alone explains little.
fn laws(situation: &Situation, density: f64) -> Vec<Law> {
    let mut out: Vec<Law> = Vec::new();
    let force = FRICTION * situation.mean_tension;
    for cable in situation.cables_and_all() {
        let effect = |id: &str, values: &[f64]| EffectSpec::new(id, cable, values).ok();
        let friction = effect("winch_coulomb_friction", &[force, 0.02]);
        let other = [
            effect("winch_stribeck_friction", &[force, 1.3 * force, 0.1, 0.07 * force]),
            effect("pulley_capstan_loss", &[FRICTION, 0.02]),
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
        let situation = Situation::of(&self.evidence.train);
        let mut tried: Vec<Try> = laws(&situation, base.train.model.parameters.cable_density)
            .into_iter()
            .map(|law| {
                let mut model = base.train.model.clone();
                model.effects.extend(law.iter().map(|(effect, _)| effect.clone()));
                Try { model, law, reached: None }
            })
            .collect();
        // All laws on the beginnings of the trials, the best of them on the whole; anew, for what is best for a beginning may
        // be a dead end.
        let trials = &self.evidence.train;
        let begun = self.begun(&base.train)?;
        self.refine_all(&mut tried, &self.beginnings, &begun, FIRST_ROUNDS, 0.5);
        let nothing = self.score(&begun, &self.beginnings);
        tried.retain(|law| law.score() < nothing - EVIDENCE);
        let clear = tried.get(1).is_none_or(|second| tried[0].score() < second.score() - FAR_OFF);
        tried.truncate(if clear { 1 } else { FINALISTS });
        if clear {
            tried.iter_mut().for_each(|law| self.in_form(law));
        }
        self.refine_all(&mut tried, trials, &base.train, LAST_ROUNDS, 0.6);
        let Some(best) = tried.into_iter().next() else { return Ok(None) };
        let Some((fit, _)) = best.reached else { return Ok(None) };
        let mut start = base.clone();
        start.train = fit;
        let next = self.fit(&start.train.model.clone(), &start, ROUNDS);
        let Some(next) = self.journal.tried(&best.law[0].0, "from a typical size", next) else { return Ok(None) };
        let better = next.left() < found.left() && next.score < found.score;
        if next.left() > 0.5 * base.left() || !better || !Self::helps(base, &next) {
            return Ok(None);
        }
        let rivals = best.law.into_iter().map(|(_, rivals)| rivals).collect();
        let before = std::mem::take(&mut self.taken);
        if self.enter(base, &next, rivals, Source::Catalogue, "refined from a typical size")? == Answer::Enters {
            return Ok(Some(next));
        }
        self.taken = before;
        Ok(None)
    }

    /// A law of friction in the form that the beginnings of the trials ask for.
    fn in_form(&self, law: &mut Try) {
        let Try { law: effects, reached: Some((fit, score)), .. } = law else { return };
        let [(plain, rivals)] = &mut effects[..] else { return };
        if !is_friction(plain) {
            return;
        }
        let begun = Trained { fit: fit.clone(), estimate: None, score: *score };
        let shaped = self.shaped(begun, self.given);
        let formed = self.formed(&shaped, &[self.given]);
        let Some(formed) = self.journal.tried(plain, "in another form", formed) else { return };
        law.model = formed.fit.model.clone();
        let effect = formed.fit.model.effects[self.given].clone();
        if effect.id != plain.id {
            rivals.retain(|rival| rival.id != effect.id);
            rivals.push(plain.clone());
        }
        *plain = effect;
    }

    /// Refines all laws on `trials`, from a fit of the model without them, and puts the best first. Progress goes from
    /// `begun` on by a tenth.
    fn refine_all(&self, tried: &mut [Try], trials: &[Trial], base: &Fit, rounds: usize, begun: f64) {
        let (done, count) = (AtomicUsize::new(0), tried.len() as f64);
        let refined = |model: &Model| {
            let mut fit = self.started(model, base, trials)?;
            refine(&mut fit, trials, &self.evidence.noise, self.free_from, rounds, None)?;
            let score = self.score(&fit, trials);
            Ok::<_, FitError>((fit, score))
        };
        let one = |law: &mut Try| {
            law.reached = self.journal.tried(&law.law[0].0, "from a typical size", refined(&law.model));
            let share = done.fetch_add(1, Ordering::Relaxed) as f64 / count;
            (self.progress)("a second look at friction, limits, sag and cable mass", begun + 0.1 * share);
        };
        self.journal.side_by_side(|| tried.par_iter_mut().for_each(one));
        tried.sort_by(|a, b| a.score().total_cmp(&b.score()));
    }
}

/// A law under trial.
struct Try {
    model: Model,
    law: Law,
    /// The fit so far, with its score; none of a law that cannot be simulated.
    reached: Option<(Fit, f64)>,
}

impl Try {
    fn score(&self) -> f64 {
        self.reached.as_ref().map_or(f64::INFINITY, |r| r.1)
    }
}

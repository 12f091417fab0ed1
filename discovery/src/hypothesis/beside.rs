//! Parameters of what was found, free beside every candidate.
//!
//! What stands was fitted without the candidate, and has taken up what it could of it. So what a candidate explains is told only
//! with the parameters of what stands moving along (the efficient score of a test with nuisance parameters: D. R. Cox, D. V.
//! Hinkley, Theoretical Statistics, 1974, chapter 9): where it is much like one of them, by itself it seems to explain as much
//! less as they are alike.

use std::ops::Range;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;

use crate::hypothesis::candidates::{Known, Library};
use crate::hypothesis::parameter::{free_parameters, parameter_step};

/// Sets the parameters of a model's effects of these numbers beside the candidates of a library. Of none is anything
/// known beforehand; numbers in a text do not move.
pub(crate) fn set_found_beside(library: &mut Library, model: &Model, effects: Range<usize>) {
    for free in free_parameters(model, effects.start).into_iter().filter(|free| free.effect < effects.end) {
        let effect = &model.effects[free.effect];
        let step = parameter_step(model, free);
        let possible = |step: &f64| {
            let moved = with_variation(model, &moved_in(effect, free.parameter, *step));
            moved.effects[free.effect].check().is_ok()
        };
        // Where neither way is one it stays as it is.
        if let Some(step) = [step, -step].into_iter().find(possible) {
            library.set_beside(moved_in(effect, free.parameter, step), Known { mean: 0.0, precision: 0.0 });
        }
    }
}

/// The variation that moves one parameter of an effect.
pub(super) fn moved_in(effect: &EffectSpec, parameter: usize, by: f64) -> EffectSpec {
    let mut variation = effect.clone();
    variation.values.fill(0.0);
    variation.values[parameter] = by;
    variation
}

/// `model` with `variation` in it: where that effect is there, it is moved, else it comes beside the others.
pub(crate) fn with_variation(model: &Model, variation: &EffectSpec) -> Model {
    let mut model = model.clone();
    let same = |e: &&mut EffectSpec| {
        e.expression.is_none()
            && (&e.id, e.cable, &e.channel, e.from, e.until)
                == (&variation.id, variation.cable, &variation.channel, variation.from, variation.until)
    };
    match model.effects.iter_mut().find(same) {
        Some(there) => there.values.iter_mut().zip(&variation.values).for_each(|(value, by)| *value += by),
        None => model.effects.push(variation.clone()),
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::hypothesis::candidates::{Situation, catalogue};
    use crate::weigh::criterion::Penalty;
    use crate::weigh::refine::refine;
    use crate::weigh::regression::{baseline, rank};
    use crate::weigh::signatures::{Signatures, levels};

    fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
        EffectSpec::new(id, cable, values).expect("an effect")
    }

    #[test]
    fn an_effect_that_is_there_moves_and_another_comes_beside() {
        let mut model = Model::default();
        model.effects.push(effect("anchor_offset", Some(2), &[0.01, 0.0]));
        model.effects.push(EffectSpec::expression("platform.force_y", "40*x").expect("a term"));
        let moved = with_variation(&model, &effect("anchor_offset", Some(2), &[0.0, 0.02]));
        assert_eq!(moved.effects[0], effect("anchor_offset", Some(2), &[0.01, 0.02]));
        let others = [effect("anchor_offset", Some(1), &[0.0, 0.02]), effect("winch_force_bias", Some(2), &[1.0])];
        let later = EffectSpec { from: Some(3.0), ..effect("anchor_offset", Some(2), &[0.0, 0.02]) };
        let term = EffectSpec::expression("platform.force_y", "30*x").expect("a term");
        for other in others.into_iter().chain([later, term]) {
            assert_eq!(with_variation(&model, &other).effects.len(), 3, "{other:?}");
        }
    }

    /// Drag had taken up most of viscous friction of the winches, which by itself seemed to explain a part then of what it does.
    #[test]
    fn what_another_effect_took_up_shows_with_that_one_moving_along() {
        let (drag, friction) = ("platform_linear_drag", "winch_viscous_friction");
        let hidden = [effect(drag, None, &[60.0]), effect(friction, None, &[150.0])];
        let trials = [record(&hidden, 40.0, 66), record(&hidden, 40.0, 67)];
        let fitted_with = |effects: &[EffectSpec]| {
            let mut fit = fitted(effects, &trials);
            refine(&mut fit, &trials, 0, 6, None).expect("a refinement");
            fit.randomness = fit.randomness.without_latents();
            refine(&mut fit, &trials, 0, 6, None).expect("a refinement");
            fit
        };
        let (fit, both) = (fitted_with(&[effect(drag, None, &[50.0])]), fitted_with(&hidden));
        let explains = |first: usize| {
            let mut library = catalogue(&fit.model, &Situation::of(&trials));
            set_found_beside(&mut library, &fit.model, first..fit.model.effects.len());
            let signatures = Signatures::new(library);
            let levels = levels(&fit, &trials, &signatures, std::slice::from_ref(&fit.randomness));
            let library = &signatures.library;
            let ranked = rank(library, &levels, Penalty::NONE);
            let of_friction = |at: usize| (library.candidates[at].id, library.candidates[at].cable) == (friction, None);
            let scored = ranked.iter().find(|scored| of_friction(scored.candidate)).expect("a candidate");
            baseline(&levels) - scored.score
        };
        let in_full = [&fit, &both].map(|fit| fit.minus_two_log_likelihood(&trials, &fit.randomness));
        let [by_itself, with_drag] = [1, 0].map(explains);
        let in_full = in_full[0] - in_full[1];
        // Along the trajectory without it, to first order.
        let said = format!("{by_itself} {with_drag} {in_full}");
        assert!(by_itself < 0.4 * in_full && (0.5..1.1).contains(&(with_drag / in_full)), "{said}");
    }
}

//! Sizes of the effects' own states.

use cdpr::effect::{EffectKind, Stage};
use cdpr::plant::EffectStates;

use crate::hypothesis::facts::facts;
use crate::model::examined::Examined;

/// Size of an effect state: forces count in kN, strains in thousandths, bows of cables and their velocities in m and m/s,
/// deflections by what friction holds.
pub(crate) fn effect_state_scale(model: &Examined, cable: usize, at: usize) -> f64 {
    let place = at - model.plant.effect_states(cable).start;
    let holds = |s: &&EffectStates| s.cable == cable && (s.first..s.first + s.count).contains(&place);
    let Some(states) = model.plant.states_of_effects().iter().find(holds) else { return 1.0 };
    let spec = &model.plant.effects()[states.effect];
    if let Stage::Command(_) = states.stage {
        return 1e3;
    }
    let of_law = || EffectKind::new(spec).map_or(1.0, |kind| kind.loss_state_size());
    facts(&spec.id).state_size.unwrap_or_else(of_law)
}

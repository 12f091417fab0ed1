//! The catalogue as candidates for regression: one or more signatures each, and how amplitudes become parameters.

mod cables;
mod dictionary;
mod library;
mod platform;
mod sensors;
mod situation;
mod winches;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use cdpr::parameters::CableModel;

use crate::hypothesis::elasticity::is_elasticity;
use crate::model::sizes::Sizes;

pub(crate) use dictionary::dictionary;
pub(crate) use library::{Candidate, Combination, Known, Library};
pub(crate) use situation::{Situation, Wave};

use cables::cables;
use platform::platform;
use sensors::sensors;
use winches::winches;

/// The catalogue, set up for this model and data.
pub(crate) fn catalogue(model: &Model, situation: &Situation) -> Library {
    let sizes = &Sizes::of(&model.parameters);
    let mut lib = Library { sizes: Some(*sizes), ..Library::new(situation.cables()) };
    let elastic = model.parameters.cable_model != CableModel::Rigid || model.effects.iter().any(is_elasticity);
    if elastic {
        cables(&mut lib, situation, sizes, model.parameters.cable_density);
    }
    winches(&mut lib, situation, sizes);
    platform(&mut lib, situation, sizes);
    sensors(&mut lib, situation, sizes);
    // An effect that the model already has on that cable is refined, not found again.
    lib.candidates.retain(|c| !model.effects.iter().any(|effect| is_there(effect, c.id, c.cable)));
    lib.in_use()
}

/// Whether an effect is the law `id` on that cable, or one of them is on all.
pub(crate) fn is_there(effect: &EffectSpec, id: &str, cable: Option<usize>) -> bool {
    effect.id == id && (effect.cable.is_none() || cable.is_none() || effect.cable == cable)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;
    use crate::data::{Channel, Trial};

    #[test]
    fn the_tension_sensor_of_a_cable_is_a_candidate_where_it_is_recorded() {
        let mut trial = record(&[], 5.0, 1);
        let sensors = |trial: &Trial| -> Vec<Option<usize>> {
            let library = catalogue(&Model::default(), &Situation::of(std::slice::from_ref(trial)));
            library.candidates.iter().filter(|c| c.id == "tension_sensor_bias").map(|c| c.cable).collect()
        };
        trial.channels.retain(|c| !matches!(c, Channel::Tension(_)));
        assert_eq!(sensors(&trial), []);
        trial.channels.push(Channel::Tension(2));
        assert_eq!(sensors(&trial), [Some(3), None]);
    }

    #[test]
    fn what_stands_already_is_not_varied_again() {
        let situation = Situation::of(&[record(&[], 5.0, 1)]);
        let whole = catalogue(&Model::default(), &situation);
        let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).unwrap();
        let less = catalogue(&Model { effects: vec![gain], ..Model::default() }, &situation);
        // On its cable and on all.
        assert_eq!(whole.candidates.len() - less.candidates.len(), 2);
        assert_eq!(whole.columns.len() - less.columns.len(), 2);
        assert_eq!(whole.variations.len() - less.variations.len(), 1);
        assert!(!less.variations.iter().any(|varied| varied.id == "winch_force_gain" && varied.cable == Some(2)));
        let drag = |library: &Library| {
            let candidate = library.candidates.iter().find(|c| c.id == "platform_linear_drag").unwrap();
            let (at, _) = library.columns[candidate.columns[0]][0];
            library.variations[at].id.clone()
        };
        assert_eq!(drag(&less), drag(&whole));
    }

    #[test]
    fn a_cable_without_mass_has_no_transverse_mode_and_no_panic() {
        let mut model = Model::default();
        let situation = Situation::of(&[record(&[], 5.0, 1)]);
        let count = |model: &Model| {
            let library = catalogue(model, &situation);
            library.candidates.iter().filter(|c| c.id == "cable_transverse_mode").count()
        };
        assert_eq!(count(&model), 5);
        model.parameters.cable_density = 0.0;
        assert_eq!(count(&model), 0);
    }
}

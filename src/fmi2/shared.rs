//! What all instances of one model share: the model as it was read, its plant, the table of variables.

use std::sync::{Arc, Mutex, PoisonError, Weak};

use fmi2_export::ModelError;
use fmi2_export::description::ModelDescription;

use super::now;
use super::role::Role;
use super::table::Table;
use crate::kinematics;
use crate::model_file::Model;
use crate::parameters::Initialization;
use crate::plant::{Plant, PlantError};
use crate::simulation::Start;

/// A model, read, checked and built once.
pub(super) struct Shared {
    /// The model, its start values those of the table.
    pub(super) model: Model,
    pub(super) plant: Arc<Plant>,
    pub(super) description: Arc<ModelDescription>,
    /// What each variable stands for.
    pub(super) roles: Vec<Role>,
    /// Where its value is among those that are made together, see [`now::place`].
    pub(super) places: Vec<usize>,
    /// The text of the model file that it was read from, if it was.
    text: Option<String>,
}

/// Those that instances have now, as far as they were read from a model file or are the default model.
static LIVE: Mutex<Vec<Weak<Shared>>> = Mutex::new(Vec::new());

impl Shared {
    /// The model in `text`, the default model without one: the one that other instances have, where there is such.
    ///
    /// # Errors
    /// As [`Model::from_toml`] and [`Shared::new`].
    pub(super) fn of(text: Option<String>) -> Result<Arc<Self>, ModelError> {
        // Held while the model is built, so that instances made at the same time share it, too.
        let mut live = LIVE.lock().unwrap_or_else(PoisonError::into_inner);
        live.retain(|shared| shared.strong_count() > 0);
        if let Some(shared) = live.iter().filter_map(Weak::upgrade).find(|shared| shared.text == text) {
            return Ok(shared);
        }
        let failed = |error: &dyn std::fmt::Display| ModelError::new(error.to_string());
        let (model, plant) = match &text {
            Some(text) => Model::from_toml_with_plant(text).map_err(|e| failed(&e))?,
            None => {
                let model = Model::default();
                let plant = model.build().map_err(|e| failed(&e))?;
                (model, plant)
            }
        };
        let shared = Arc::new(Self { text, ..Self::new(model, plant)? });
        live.push(Arc::downgrade(&shared));
        Ok(shared)
    }

    /// That of `model`, whose plant is `plant`.
    ///
    /// # Errors
    /// A start value is out of its bounds.
    pub(super) fn new(mut model: Model, plant: Arc<Plant>) -> Result<Self, ModelError> {
        if model.start.initialization != Initialization::FromStates {
            // Lengths in the table are then guesses: under the winch forces or, where these are beyond the cable's
            // law, without them. To a micrometre, so that machines agree on the digits.
            let start = Start { initialization: Initialization::FromWinchForces, ..model.start };
            let (lengths, rates) = match (Model { start, ..model.clone() }).simulation_of(Arc::clone(&plant)) {
                Ok(trial) => {
                    let outputs = trial.outputs();
                    (outputs.unstretched_length, outputs.unstretched_length_rate)
                }
                Err(_) => {
                    let cables = kinematics::cables(plant.geometry(), &start.pose, &start.twist);
                    (cables.map(|cable| cable.length), cables.map(|cable| cable.speed))
                }
            };
            let rounded = |value: f64| (value * 1e6).round() / 1e6;
            model.start.unstretched_length = lengths.map(rounded);
            model.start.unstretched_length_rate = rates.map(rounded);
        }
        let Table { description, roles } = Table::new(&model, &plant)?;
        let places = roles.iter().map(|role| now::place(*role, plant.cables())).collect();
        Ok(Self { model, plant, description: Arc::new(description), roles, places, text: None })
    }

    /// The plant of `model`: this one where a host set no parameter of it otherwise.
    ///
    /// # Errors
    /// As [`Plant::new`].
    pub(super) fn plant_of(&self, model: &Model) -> Result<Arc<Plant>, PlantError> {
        if model.parameters == self.model.parameters && model.effects == self.model.effects {
            return Ok(Arc::clone(&self.plant));
        }
        model.plant()
    }
}

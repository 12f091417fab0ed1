//! The linear model `ẋ = A x + B u`, `y = C x + D u` about any state.

use nalgebra::DMatrix;

use crate::dynamics::Inputs;
use crate::plant::Plant;
use crate::signal::{Signal, input_names, output_names, output_values};
use crate::simulation::{Direction, Simulation};

/// A plant linearised about an instant, exact by dual numbers, with each cable slack or taut as it is.
///
/// States are the plant's own, laid out as in [`Plant::rates`]; inputs are the winch forces as commanded and the
/// disturbances; outputs are what the sensors show, without `slack`. What a dead time holds back does not depend on state
/// and input. It is the matrix of the directional derivatives that the FMU gives, state by state and input by input.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearModel {
    /// Time (s).
    pub time: f64,
    /// Names of the states.
    pub state_names: Vec<String>,
    /// Names of the inputs.
    pub input_names: Vec<String>,
    /// Names of the outputs.
    pub output_names: Vec<String>,
    /// States there.
    pub state: Vec<f64>,
    /// Rates of the states there: zero at rest.
    pub rate: Vec<f64>,
    /// Inputs there.
    pub input: Vec<f64>,
    /// Outputs there.
    pub output: Vec<f64>,
    /// `∂ẋ/∂x`.
    pub a: DMatrix<f64>,
    /// `∂ẋ/∂u`.
    pub b: DMatrix<f64>,
    /// `∂y/∂x`.
    pub c: DMatrix<f64>,
    /// `∂y/∂u`.
    pub d: DMatrix<f64>,
}

/// Names of a plant's states, those of the FMU.
pub(crate) fn state_names(plant: &Plant) -> Vec<String> {
    let mut names = vec![String::new(); plant.dimension()];
    for k in 0..3 {
        names[k] = Signal::Pose(k).name();
        names[3 + k] = Signal::Twist(k).name();
    }
    for i in 0..plant.cables() {
        if let Some(at) = plant.unstretched_index(i) {
            names[at] = Signal::UnstretchedLength(i).name();
        }
        if let Some(at) = plant.rate_index(i) {
            names[at] = Signal::UnstretchedRate(i).name();
        }
    }
    for place in plant.states_of_effects() {
        let id = &plant.effects()[place.effect].id;
        for k in 0..place.count {
            let at = plant.effect_states(place.cable).start + place.first + k;
            names[at] = match place.count {
                1 => format!("effect.{id}[{}].state", place.cable + 1),
                _ => format!("effect.{id}[{}].state[{}]", place.cable + 1, k + 1),
            };
        }
    }
    names
}

impl LinearModel {
    /// Linearises a simulation where it stands: (29) or (41) about its state.
    pub fn of(simulation: &Simulation) -> Self {
        let plant = simulation.plant();
        let n = plant.dimension();
        let still = vec![0.0; n];
        let cables = plant.cables();
        let inputs = cables + 3;
        let outputs = output_names(cables);
        let mut model = Self {
            time: simulation.time(),
            state_names: state_names(plant),
            input_names: input_names(cables, plant.parameters().winch.command),
            a: DMatrix::zeros(n, n),
            b: DMatrix::zeros(n, inputs),
            c: DMatrix::zeros(outputs.len(), n),
            d: DMatrix::zeros(outputs.len(), inputs),
            output_names: outputs,
            state: simulation.states().to_vec(),
            rate: simulation.rates(),
            input: [&simulation.inputs().winch_force[..], &simulation.inputs().disturbance[..]].concat(),
            output: output_values(&simulation.outputs()),
        };
        for column in 0..n {
            let mut states = still.clone();
            states[column] = 1.0;
            let direction = Direction { time: 0.0, states: &states, inputs: Inputs::none(cables) };
            let tangent = simulation.tangent(&direction);
            for (row, rate) in tangent.rates.iter().enumerate() {
                model.a[(row, column)] = rate.eps;
            }
            for (row, output) in output_values(&tangent.outputs(plant)).iter().enumerate() {
                model.c[(row, column)] = output.eps;
            }
        }
        for column in 0..inputs {
            let mut inputs = Inputs::none(cables);
            if column < cables {
                inputs.winch_force[column] = 1.0;
            } else {
                inputs.disturbance[column - cables] = 1.0;
            }
            let tangent = simulation.tangent(&Direction { time: 0.0, states: &still, inputs });
            for (row, rate) in tangent.rates.iter().enumerate() {
                model.b[(row, column)] = rate.eps;
            }
            for (row, output) in output_values(&tangent.outputs(plant)).iter().enumerate() {
                model.d[(row, column)] = output.eps;
            }
        }
        model
    }
}

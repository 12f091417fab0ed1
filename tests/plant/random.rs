//! Plants and states by chance, the same in every run.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::kinematics;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;

pub(crate) const MODELS: [CableModel; 3] = [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass];
pub(crate) const INERTIAS: [CableInertia; 3] = [CableInertia::Paper, CableInertia::Reeled, CableInertia::None];

/// SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number from `low` to `high`.
    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Numbers from `-size` to `size`.
    pub(crate) fn around<const N: usize>(&mut self, size: f64) -> [f64; N] {
        std::array::from_fn(|_| self.within(-size, size))
    }
}

/// A plant of the default robot.
pub(crate) fn plant(model: CableModel, inertia: CableInertia, effects: &[EffectSpec]) -> Arc<Plant> {
    let parameters = Parameters { cable_model: model, cable_inertia: inertia, ..Parameters::default() };
    Arc::new(Plant::new(parameters, effects.to_vec()).unwrap())
}

/// A moving state with tensions of some kN in elastic cables, and inputs to it.
pub(crate) fn state(random: &mut Random, plant: &Plant) -> (Vec<f64>, Inputs) {
    let mut y = vec![0.0; plant.dimension()];
    let position: [f64; 2] = random.around(200.0);
    y[..2].copy_from_slice(&position);
    y[2] = random.within(-0.5, 0.5);
    let velocity: [f64; 2] = random.around(5.0);
    y[3..5].copy_from_slice(&velocity);
    y[5] = random.within(-0.2, 0.2);
    let cables = kinematics::cables(plant.geometry(), &[y[0], y[1], y[2]], &[y[3], y[4], y[5]]);
    for i in 0..plant.cables() {
        let strain = random.within(3e-4, 2e-3);
        if let Some(at) = plant.unstretched_index(i) {
            y[at] = cables[i].length / (1.0 + strain);
        }
        if let Some(at) = plant.rate_index(i) {
            y[at] = cables[i].speed + random.within(-0.1, 0.1);
        }
        for at in plant.effect_states(i) {
            y[at] = random.within(0.0, 2e-4);
        }
    }
    let inputs = Inputs {
        winch_force: PerCable::from_fn(plant.cables(), |_| random.within(2e3, 4e4)),
        disturbance: [random.within(-500.0, 500.0), random.within(-500.0, 500.0), random.within(-5e3, 5e3)],
    };
    (y, inputs)
}

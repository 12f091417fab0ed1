//! Lord Rayleigh, The Theory of Sound (1877), chapter VI: a particle of mass `M` on stretched strings vibrates across them
//! with `ω² = Σ T / (L M_e)`, a string's own mass adding a third of itself at its end.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::Simulation;
use cdpr::statics::{LinearModel, force_controlled_modes};

/// All cables in one line: two to the left, two to the right, attached near the middle of the platform.
#[test]
fn a_mass_on_stretched_strings() {
    let pi = std::f64::consts::PI;
    for (density, tension) in [(0.0, 1000.0), (0.215, 1000.0), (0.215, 30e3)] {
        let parameters = Parameters {
            cable_model: CableModel::Rigid,
            anchor_angle: [pi, pi, 0.0, 0.0].into(),
            attachment_angle: [pi, pi, 0.0, 0.0].into(),
            cable_density: density,
            ..Parameters::default()
        };
        let length = parameters.anchor_radius - parameters.attachment_radius;
        let effective = parameters.platform_mass + 4.0 * density * length / 3.0;
        let expected = (4.0 * tension / (length * effective)).sqrt();
        let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
        let inputs = Inputs { winch_force: [tension; 4].into(), disturbance: [0.0; 3] };
        let y = vec![0.0; plant.dimension()];
        let simulation = Simulation::from_states(plant.clone(), 0.0, y, inputs, 1e-10);
        let modes = force_controlled_modes(&plant, &LinearModel::of(&simulation)).unwrap();
        let across = modes.iter().find(|m| m.oscillates() && m.shape[1].norm() > 0.9).unwrap();
        let found = across.natural_frequency();
        assert!((found - expected).abs() < 1e-9 * expected, "ρ {density}, T {tension}: {found} against {expected}");
    }
}

//! H. J. Ernst, Der E-Modul von Seilen unter Berücksichtigung des Durchhanges, Der Bauingenieur 40 (1965): a sagging cable
//! is as stiff as a straight one of the modulus `E / (1 + (w L)² E A / (12 T³))`.

use cdpr::effect::EffectSpec;
use cdpr::kinematics;
use cdpr::parameters::Parameters;
use cdpr::plant::Plant;
use cdpr::statics::{elastic_stiffness, stiffness};

#[test]
fn a_sagging_cable_has_the_equivalent_modulus() {
    let weight = 2.11;
    for tension in [5e3_f64, 10e3, 20e3] {
        let sag = EffectSpec::new("cable_sag", None, &[weight, 20e3]).unwrap();
        let plant = Plant::new(Parameters::default(), vec![sag]).unwrap();
        let ea = plant.parameters().axial_stiffness();
        let length = kinematics::cable_lengths(plant.geometry(), &[0.0; 3])[0];
        let equivalent = ea / (1.0 + (weight * length).powi(2) * ea / (12.0 * tension.powi(3)));
        let expected = elastic_stiffness(plant.geometry(), &[0.0; 3], &[equivalent / length; 4].into());
        let found = stiffness(&plant, 0.0, &[0.0; 3], &[tension; 4].into()).unwrap().elastic;
        for k in 0..3 {
            // Ernst's formula is of first order in strain and holds for the chord's own length.
            let (a, b) = (found[(k, k)], expected[(k, k)]);
            assert!((a - b).abs() < 0.02 * b, "T = {tension} N, axis {k}: {a} against {b}");
        }
    }
}

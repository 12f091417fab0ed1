//! The robot is symmetric; so must its motion be.

use cdpr::dynamics::Inputs;

use crate::random::{INERTIAS, MODELS, Random, plant, state};

/// A symmetry of the robot: signs of `x, y, φ` and where each cable goes.
struct Symmetry {
    name: &'static str,
    signs: [f64; 3],
    /// Cable `i` becomes cable `image[i]`.
    image: [usize; 4],
}

// Anchors 1 to 4 stand lower left, lower right, upper right, upper left.
const SYMMETRIES: [Symmetry; 3] = [
    Symmetry { name: "mirror left and right", signs: [-1.0, 1.0, -1.0], image: [1, 0, 3, 2] },
    Symmetry { name: "mirror up and down", signs: [1.0, -1.0, -1.0], image: [3, 2, 1, 0] },
    Symmetry { name: "half turn", signs: [-1.0, -1.0, 1.0], image: [2, 3, 0, 1] },
];

#[test]
fn images_of_a_state_have_the_image_of_its_rates() {
    let mut random = Random(21);
    for symmetry in SYMMETRIES {
        for model in MODELS {
            for inertia in INERTIAS {
                let plant = plant(model, inertia, &[]);
                for _ in 0..20 {
                    let (y, u) = state(&mut random, &plant);
                    let image = |values: &[f64]| {
                        let mut out = vec![0.0; values.len()];
                        for k in 0..6 {
                            out[k] = symmetry.signs[k % 3] * values[k];
                        }
                        for i in 0..4 {
                            let to = symmetry.image[i];
                            for at in [plant.unstretched_index(i), plant.rate_index(i)].into_iter().flatten() {
                                let first = |i| plant.unstretched_index(i).unwrap();
                                out[first(to) + (at - first(i))] = values[at];
                            }
                        }
                        out
                    };
                    let mut mirrored = Inputs::none(4);
                    for i in 0..4 {
                        mirrored.winch_force[symmetry.image[i]] = u.winch_force[i];
                    }
                    for k in 0..3 {
                        mirrored.disturbance[k] = symmetry.signs[k] * u.disturbance[k];
                    }
                    let (mut rates, mut image_rates) = (vec![0.0; y.len()], vec![0.0; y.len()]);
                    plant.rates(0.0, &y, &u, &[false; 4].into(), &mut rates);
                    plant.rates(0.0, &image(&y), &mirrored, &[false; 4].into(), &mut image_rates);
                    for (a, b) in image(&rates).iter().zip(&image_rates) {
                        // Anchors at cos and sin of odd multiples of 45° are symmetric to rounding only.
                        assert!((a - b).abs() < 2e-9 * (1.0 + a.abs()), "{}, {model:?}: {a} {b}", symmetry.name);
                    }
                }
            }
        }
    }
}

//! Robots with other numbers of cables than four, by coordinates, in gravity.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::geometry::Geometry;
use cdpr::model_file::Model;
use cdpr::parameters::{CableDamper, CableInertia, CableModel, CableParameters, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start, wrench_at_rest};
use cdpr::statics::locked_model;
use num_dual::Dual64;

use crate::random::{INERTIAS, MODELS, Random, state};

/// A robot by chance, no cable through its platform in the middle: anchors around, attachments crossed or not, cables of their
/// own, gravity, a centre of mass that is off.
fn robot(random: &mut Random, cables: usize, cable_model: CableModel, cable_inertia: CableInertia) -> Parameters {
    loop {
        let found = any_robot(random, cables, cable_model, cable_inertia);
        if cables == 2 || Geometry::new(&found).check_pose(&[0.0; 3]).is_ok() {
            return found;
        }
    }
}

fn any_robot(random: &mut Random, cables: usize, cable_model: CableModel, cable_inertia: CableInertia) -> Parameters {
    let cable = (0..cables).map(|i| {
        let angle = std::f64::consts::TAU * (i as f64 + random.within(0.2, 0.8)) / cables as f64;
        let on_body = angle + random.within(-1.2, 1.2);
        let (far, near) = (random.within(600.0, 900.0), random.within(5.0, 12.0));
        CableParameters {
            youngs_modulus: (i % 2 == 0).then(|| random.within(2e10, 6e10)),
            area: (i % 3 == 0).then(|| random.within(3e-4, 5e-4)),
            density: (i % 3 == 1).then(|| random.within(0.1, 0.4)),
            damping: (i % 2 == 1).then(|| random.within(1e4, 4e4)),
            ..CableParameters::between(
                [far * angle.cos(), far * angle.sin()],
                [near * on_body.cos(), near * on_body.sin()],
            )
        }
    });
    Parameters {
        cable: cable.collect(),
        cable_model,
        cable_inertia,
        cable_damper: if cables.is_multiple_of(2) { CableDamper::StrainRate } else { CableDamper::LengthRate },
        gravity: [random.within(-1.0, 1.0), -9.81],
        centre_of_mass: random.around(0.5),
        ..Parameters::default()
    }
}

/// The residual by its own derivation, and the power by dual numbers, at states by chance.
#[test]
fn equations_and_energy_hold_for_any_number_of_cables() {
    let mut random = Random(81);
    for cables in [2, 3, 4, 5, 6, 8, 9, 12] {
        for model in MODELS {
            for inertia in INERTIAS {
                let plant = Plant::new(robot(&mut random, cables, model, inertia), Vec::new()).unwrap();
                assert_eq!(plant.cables(), cables);
                for _ in 0..10 {
                    let (y, u) = state(&mut random, &plant);
                    let slack = PerCable::from_fn(cables, |_| random.within(0.0, 1.0) < 0.3);
                    let mut rates = vec![0.0; y.len()];
                    plant.rates(0.0, &y, &u, &slack, &mut rates);
                    let mut residual = vec![f64::NAN; y.len()];
                    plant.residual(0.0, &y, &rates, &u, &slack, &mut residual);
                    let forces: f64 = u.winch_force.iter().map(|f| f.abs()).sum::<f64>() + 2.5e4;
                    for (row, left) in residual.iter().enumerate() {
                        let size = if row == 5 { 20.0 * forces } else { forces };
                        assert!(left.abs() < 1e-12 * size, "{cables} {model:?} {inertia:?} row {row}: {left:e}");
                    }
                    if inertia == CableInertia::None || model != CableModel::LumpedMass && slack.contains(&true) {
                        continue;
                    }
                    let moving: Vec<Dual64> = y.iter().zip(&rates).map(|(y, r)| Dual64::new(*y, *r)).collect();
                    let rate = plant.energy(&moving, &slack).total().eps;
                    let power = plant.power(0.0, &y, &u, &plant.evaluate(0.0, &y, &u, &slack));
                    let size =
                        [power.winches, power.damping, power.reeling].iter().fold(1.0_f64, |m, p| m.max(p.abs()));
                    let total = power.total();
                    assert!((rate - total).abs() < 1e-9 * size, "{cables} {model:?} {inertia:?}: {rate} {total}");
                }
            }
        }
    }
}

/// Two cables side by side, each of half the stiffness, mass and damping, under half the force, are one.
#[test]
fn eight_cables_in_four_pairs_move_as_four() {
    let four = Parameters { gravity: [0.0, -0.5], ..Parameters::default() };
    let pair = |cable: CableParameters, aside: f64| CableParameters {
        anchor: [cable.anchor[0] + aside, cable.anchor[1]],
        area: Some(0.5 * four.cable_area),
        density: Some(0.5 * four.cable_density),
        damping: Some(0.5 * four.cable_damping),
        ..cable
    };
    let cable = four.on_circles().into_iter().flat_map(|c| [pair(c, 0.0), pair(c, 1e-9)]).collect();
    let eight = Parameters { cable, ..four.clone() };
    let run = |parameters: Parameters, share: f64| {
        let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
        let winch_force =
            PerCable::from_fn(plant.cables(), |i| share * [21e3, 19e3, 22e3, 20e3][i * 4 / plant.cables()]);
        let inputs = Inputs { winch_force, disturbance: [100.0, -50.0, 300.0] };
        let start = Start { pose: [5.0, -3.0, 0.05], inputs, ..Start::pulling(plant.cables()) };
        let mut simulation = Simulation::new(plant, &start, 1e-10).unwrap();
        simulation.advance(5.0).unwrap();
        let outputs = simulation.outputs();
        (outputs.pose, outputs.tension)
    };
    let ((a, four_tension), (b, eight_tension)) = (run(four.clone(), 1.0), run(eight, 0.5));
    for k in 0..3 {
        assert!((a[k] - b[k]).abs() < 1e-7, "{a:?} {b:?}");
    }
    for i in 0..4 {
        let both = eight_tension[2 * i] + eight_tension[2 * i + 1];
        assert!((both - four_tension[i]).abs() < 1e-3, "{four_tension:?} {eight_tension:?}");
    }
}

/// The order in which cables are counted is not physics.
#[test]
fn cables_in_another_order_move_the_platform_alike() {
    let mut random = Random(82);
    for cables in [3, 6, 8] {
        let parameters = robot(&mut random, cables, CableModel::LumpedMass, CableInertia::Paper);
        let turned = Parameters { cable: parameters.cable.iter().rev().copied().collect(), ..parameters.clone() };
        let run = |parameters: Parameters, reverse: bool| {
            let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
            let force = |i: usize| 2e4 + 1e3 * (if reverse { cables - 1 - i } else { i }) as f64;
            let inputs = Inputs { winch_force: PerCable::from_fn(cables, force), disturbance: [0.0; 3] };
            let mut simulation = Simulation::new(plant, &Start { inputs, ..Start::pulling(cables) }, 1e-10).unwrap();
            simulation.advance(2.0).unwrap();
            simulation.outputs().pose
        };
        let (a, b) = (run(parameters, false), run(turned, true));
        assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-8), "{cables}: {a:?} {b:?}");
    }
}

/// A load on two parallel cables of length L swings at √(g/L) (Huygens), and each carries half the weight.
#[test]
fn a_load_on_two_cables_is_a_pendulum() {
    let (length, mass) = (40.0, 2500.0);
    let cable = [-3.0, 3.0].map(|x| CableParameters::between([x, length], [x, 0.0]));
    let parameters = Parameters {
        cable: cable.to_vec(),
        cable_inertia: CableInertia::None,
        gravity: [0.0, -9.81],
        platform_mass: mass,
        ..Parameters::default()
    };
    let plant = Plant::new(parameters, Vec::new()).unwrap();
    let half = 0.5 * mass * 9.81;
    let left = wrench_at_rest(&plant, 0.0, [0.0; 3], &Inputs::pulling(2, half));
    assert!(left.iter().all(|w| w.abs() < 1e-9), "{left:?}");
    let modes = locked_model(&plant, 0.0, &[0.0; 3], &[half; 2].into()).unwrap().modes().unwrap();
    let slowest = modes[0].natural_frequency();
    assert!((slowest / (9.81_f64 / length).sqrt() - 1.0).abs() < 1e-6, "{slowest} rad/s");
    // It hangs below its anchors, where nothing without weight could stay.
    let mut hanging =
        Simulation::new(Arc::new(plant), &Start { inputs: Inputs::pulling(2, half), ..Start::pulling(2) }, 1e-8)
            .unwrap();
    hanging.advance(1.0).unwrap();
    assert!(hanging.outputs().pose.iter().all(|p| p.abs() < 1e-6), "{:?}", hanging.outputs().pose);
    let weightless = Parameters { gravity: [0.0; 2], cable: cable.to_vec(), ..Parameters::default() };
    assert!(Geometry::new(&weightless).check_pose(&[0.0; 3]).is_err());
}

#[test]
fn a_model_of_six_cables_reads_back_and_runs() {
    let text = "gravity = [0.0, -9.81]\nplatform_mass = 20.0\nplatform_inertia = 0.8\ncable_density = 0.01\n\
                youngs_modulus = 1e11\ncable_area = 1e-5\ncable_damping = 500.0\n[start]\ny = 0.1\n\
                winch_force = [150.0, 150.0, 20.0, 20.0, 150.0, 150.0]\n"
        .to_owned();
    let ends = [
        ([-2.0, 1.5], [-0.1, 0.1]),
        ([2.0, 1.5], [0.1, 0.1]),
        ([2.0, -1.5], [0.1, -0.1]),
        ([-2.0, -1.5], [-0.1, -0.1]),
        ([-2.0, 1.4], [-0.1, -0.1]),
        ([2.0, 1.4], [0.1, -0.1]),
    ];
    let cables: String = ends.iter().map(|(a, b)| format!("[[cable]]\nanchor = {a:?}\nattachment = {b:?}\n")).collect();
    let model = Model::from_toml(&(text + &cables)).unwrap();
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
    let mut simulation = model.simulation().unwrap();
    simulation.advance(0.5).unwrap();
    let mut saved = Vec::new();
    simulation.save(&mut saved);
    let mut again = model.simulation().unwrap();
    again.restore(&saved).unwrap();
    simulation.advance(0.5).unwrap();
    again.advance(0.5).unwrap();
    assert_eq!(simulation.states(), again.states());
    assert!(simulation.outputs().tension.iter().all(|t| *t >= 0.0));
}

#[test]
fn what_no_robot_can_have_is_told() {
    let cable = |extra: &str| format!("[[cable]]\nanchor = [0.0, 1.0]\nattachment = [0.0, 0.0]\n{extra}");
    for (text, part) in [
        (cable(""), "1 cable, expected 2 to 12"),
        (cable("") + &cable(""), "two cables in one place are one"),
        ("anchor_radius = 5.0\n".to_owned() + &cable(""), "expected one of the two"),
        (cable("colour = 3"), "unknown field `colour`"),
        (cable("density = -1.0\n") + &cable(""), "`cable[1].density` is -1"),
        ("anchor_angle = [0.0, 1.0, 2.0]\nattachment_angle = [0.0, 1.0]".to_owned(), "expected 2, as many as"),
        ("[[effect]]\nid = \"winch_force_bias\"\ncable = 5\nbias = 1.0".to_owned(), "the robot has 4 cables"),
        (
            "[[effect]]\nid = \"expression\"\ntarget = \"winch[1]\"\nexpression = \"cable_speed[6]\"".to_owned(),
            "names cable 6, but the robot has 4",
        ),
    ] {
        let error = Model::from_toml(&text).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

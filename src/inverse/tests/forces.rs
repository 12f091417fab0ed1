//! Limits of the winch forces beside the bounds of the tensions.

use super::*;

const TIMES: [f64; 5] = [0.3, 7.7, 20.0, 31.4, 55.0];

/// By how much the winch forces are beyond `limits` at worst (N), and how often a force is at the lower one.
fn beyond(plant: &Arc<Plant>, objective: Objective, asked: [f64; 2], limits: [f64; 2]) -> (f64, usize) {
    let (trajectory, redundancy) = (sines(), distribution(objective));
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
    let problem = problem.within_forces(asked[0], asked[1]).unwrap();
    let (mut worst, mut at_limit) = (f64::NEG_INFINITY, 0);
    for time in TIMES {
        let instant = problem.at(time, &problem.start(time).unwrap()).unwrap();
        for force in instant.winch_force {
            worst = worst.max(limits[0] - force).max(force - limits[1]);
            at_limit += usize::from((force - limits[0]).abs() < 1e-3 * limits[0]);
        }
    }
    (worst, at_limit)
}

const NONE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

/// Where the tension decides the force at once, forces at a limit are there exactly, whatever lies between winch and cable.
#[test]
fn forces_end_at_their_limits_where_cables_are_rigid_or_without_mass_at_the_winch() {
    let effects = vec![
        effect("winch_coulomb_friction", Some(3), &[250.0, 0.05]),
        effect("winch_force_gain", Some(4), &[-0.03]),
        effect("winch_force_bias", None, &[40.0]),
        effect("winch_drum_inertia", Some(2), &[50.0]),
        EffectSpec::expression("winch[1]", "20*sin(x)").unwrap(),
    ];
    let limits = [8e3, 30e3];
    for effects in [Vec::new(), effects] {
        let plant = plant(CableModel::Rigid, CableInertia::Paper, effects);
        let (without, _) = beyond(&plant, Objective::MinimumNorm, NONE, limits);
        assert!(without > 1e3, "the limits do nothing: {without} N");
        let (within, at_limit) = beyond(&plant, Objective::MinimumNorm, limits, limits);
        assert!(within < 1e-6, "{within} N beyond");
        assert!(at_limit >= TIMES.len(), "{at_limit} forces at the limit");
    }
}

#[test]
fn forces_of_more_cables_end_at_their_limits() {
    let cable = (0..6).map(|i| {
        let angle = std::f64::consts::TAU * (f64::from(i) + 0.4) / 6.0;
        let on_body = angle + if i % 2 == 0 { 0.7 } else { -0.7 };
        CableParameters::between(
            [900.0 * angle.cos(), 900.0 * angle.sin()],
            [10.0 * on_body.cos(), 10.0 * on_body.sin()],
        )
    });
    let parameters =
        Parameters { cable: cable.collect(), cable_model: CableModel::MasslessSpring, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
    let limits = [8e3, 30e3];
    let (within, at_limit) = beyond(&plant, Objective::MinimumNorm, limits, limits);
    assert!(within < 1e-6 && at_limit >= TIMES.len(), "{within} N beyond, {at_limit} at the limit");
}

/// In elastic cables what a tension's own change takes comes on top; with kinks rounded it is little.
#[test]
fn forces_of_elastic_cables_keep_their_limits_but_for_what_the_change_of_tension_takes() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, Vec::new());
    let limits = [8e3, 30e3];
    for objective in [Objective::SmoothNorm(500.0), Objective::AnalyticCentre, Objective::MidTension] {
        let (within, _) = beyond(&plant, objective, limits, limits);
        assert!(within < 10.0, "{objective:?}: {within} N beyond");
    }
}

/// The gust changes the tensions by itself, so fast that the cables' ends take a part of the force.
#[test]
fn room_is_left_for_what_the_change_of_tension_takes() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, Vec::new());
    let (trajectory, redundancy) =
        (Sines { gust: [2000.0, 1500.0, 9000.0], ..sines() }, distribution(Objective::SmoothNorm(300.0)));
    let times: Vec<f64> = (0..=200).map(|k| 0.1 * f64::from(k)).collect();
    let least = |problem: &InverseDynamics| {
        let run = problem.run(&times, 1e-8).unwrap();
        run.iter().flat_map(|instant| instant.winch_force).fold(f64::INFINITY, f64::min)
    };
    let problem = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap().within_forces(8e3, 40e3).unwrap();
    let without = least(&problem);
    let with = least(&problem.with_room(&times, 1e-8).unwrap());
    assert!(without < 7e3 && with >= 8e3, "{without} {with}");
}

#[test]
fn tension_rates_are_those_of_the_tensions_with_forces_at_their_limits() {
    let plant = plant(CableModel::Rigid, CableInertia::Paper, Vec::new());
    let (trajectory, redundancy) = (sines(), distribution(Objective::SmoothNorm(300.0)));
    let problem = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap().within_forces(8e3, 30e3).unwrap();
    let (t, h) = (12.3, 1e-4);
    let rate = problem.at(t, &[]).unwrap().tension_rate;
    let (ahead, behind) = (problem.at(t + h, &[]).unwrap().tension, problem.at(t - h, &[]).unwrap().tension);
    for i in 0..4 {
        let difference = (ahead[i] - behind[i]) / (2.0 * h);
        assert!((difference - rate[i]).abs() < 1e-4 * (1.0 + rate[i].abs()), "{difference} {rate:?}");
    }
}

#[test]
fn limits_that_cannot_be_kept_are_told_with_time_and_cable() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, Vec::new());
    let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
    let error = |least: f64, most: f64| {
        let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
        problem.within_forces(least, most).unwrap().start(3.0).unwrap_err()
    };
    let InverseError::NoTension { time, cable, most, .. } = error(0.0, 1e3) else { panic!() };
    assert!(time == 3.0 && cable == 1 && most < 5e3, "{most}");
    let narrowed = error(20e3, 20.1e3);
    assert!(matches!(&narrowed, InverseError::Narrowed { time: 3.0, cables, .. } if cables == &[1, 2, 3, 4]));
    assert!(narrowed.to_string().contains("cables 1, 2, 3, 4"), "{narrowed}");
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
    assert!(problem.within_forces(5.0, 5.0).is_err());
}

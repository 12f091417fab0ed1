//! Effects that begin or end while the plant moves.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::{CATALOGUE, EffectSpec, Scope};
use cdpr::integrator::Solver;
use cdpr::model_file::Model;
use cdpr::parameters::{CableInertia, CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::catalogue::values;
use crate::random::{MODELS, Random, plant};

fn effect(id: &str, cable: Option<usize>, values: &[f64], from: Option<f64>, until: Option<f64>) -> EffectSpec {
    EffectSpec::new(id, cable, values).unwrap().during(from, until).unwrap()
}

fn start() -> Start {
    let inputs = Inputs { winch_force: [1.5e4; 4].into(), disturbance: [100.0, 50.0, -300.0] };
    Start { pose: [3.0, -2.0, 0.1], twist: [0.4, 0.7, -0.05], inputs, ..Start::default() }
}

fn simulation(plant: &Arc<Plant>) -> Simulation {
    Simulation::new(plant.clone(), &start(), 1e-10).unwrap()
}

const SOLVERS: [Solver; 3] = [Solver::Radau, Solver::DormandPrince, Solver::Auto];

/// Runs to `end` (s) in steps (s) that need not hit it.
fn run(simulation: &mut Simulation, end: f64, step: f64) {
    while simulation.time() < end {
        simulation.advance(step.min(end - simulation.time())).unwrap();
    }
}

/// States that belong to no effect.
fn own(plant: &Plant, y: &[f64]) -> Vec<f64> {
    let effects = |k: &usize| (0..plant.cables()).any(|i| plant.effect_states(i).contains(k));
    (0..y.len()).filter(|k| !effects(k)).map(|k| y[k]).collect()
}

fn assert_close(a: &[f64], b: &[f64], tolerance: f64, what: &str) {
    for (k, (a, b)) in a.iter().zip(b).enumerate() {
        assert!((a - b).abs() < tolerance * (1.0 + a.abs()), "{what}, state {k}: {a} {b}");
    }
}

/// A free platform of 2500 kg in a wind of 500 N from 1.03 s until 2.21 s, at steps that end elsewhere.
#[test]
fn a_wind_that_blows_for_a_while_gives_its_impulse() {
    let parameters = Parameters { cable_inertia: CableInertia::None, ..Parameters::default() };
    let drums = EffectSpec::new("winch_drum_inertia", None, &[50.0]).unwrap();
    let wind = effect("steady_wind", None, &[500.0, 0.0, 0.0], Some(1.03), Some(2.21));
    let plant = Arc::new(Plant::new(parameters, vec![drums, wind]).unwrap());
    for (step, solver) in [0.1, 0.7, 5.0].into_iter().flat_map(|step| SOLVERS.map(|solver| (step, solver))) {
        let still = Start { inputs: Inputs::none(4), ..Start::default() };
        let mut simulation = Simulation::new(plant.clone(), &still, 1e-11).unwrap().with_solver(solver);
        let mut y = simulation.states().to_vec();
        (0..4).for_each(|i| y[plant.unstretched_index(i).unwrap()] += 100.0);
        simulation.set_states(&y);
        run(&mut simulation, 3.0, step);
        let (a, blown): (f64, f64) = (500.0 / 2500.0, 2.21 - 1.03);
        let path = a * blown * (0.5 * blown + 3.0 - 2.21);
        let y = simulation.states();
        assert!((y[3] - a * blown).abs() < 1e-13, "{solver:?}, {step}: {}", y[3]);
        assert!((y[0] - path).abs() < 1e-12, "{solver:?}, {step}: {} {path}", y[0]);
    }
}

/// The plant before and the plant after, one after the other, for each kind of effect that keeps no state.
#[test]
fn a_plant_whose_effects_begin_is_one_plant_after_another() {
    let kinds = [
        ("winch_coulomb_friction", Some(3), vec![250.0, 0.02]),
        ("cable_stiffness", Some(2), vec![-0.2]),
        ("anchor_offset", Some(1), vec![0.3, -0.2]),
        ("platform_mass", None, vec![300.0]),
        ("winch_force_gain", None, vec![-0.04]),
        ("cable_drag", None, vec![0.02]),
    ];
    for model in MODELS {
        for (id, cable, values) in &kinds {
            let always = EffectSpec::new(id, *cable, values).unwrap();
            let with = plant(model, CableInertia::Paper, std::slice::from_ref(&always));
            let without = plant(model, CableInertia::Paper, &[]);
            let switched = plant(model, CableInertia::Paper, &[always.during(Some(0.437), Some(0.911)).unwrap()]);
            let mut whole = simulation(&switched);
            run(&mut whole, 1.3, 0.1);
            let mut y = simulation(&without).states().to_vec();
            let mut time = 0.0;
            for (plant, end) in [(&without, 0.437), (&with, 0.911), (&without, 1.3)] {
                let mut part = Simulation::from_states(plant.clone(), time, y, start().inputs, 1e-10);
                run(&mut part, end, 0.1);
                (time, y) = (end, part.states().to_vec());
            }
            assert_close(whole.states(), &y, 1e-8, &format!("{model:?} {id}"));
        }
    }
}

/// Whatever the effect: one that begins after the end is not there, one that began before the start always was.
#[test]
fn an_effect_is_there_from_its_beginning_to_its_end() {
    let mut random = Random(17);
    for info in CATALOGUE.iter().filter(|info| info.id != "expression") {
        let values = values(&mut random, info.id);
        let cable = (info.scope == Scope::EachCable).then_some(2);
        let always = EffectSpec::new(info.id, cable, &values).unwrap();
        if let Some(reason) = info.nature().always {
            let error = always.during(Some(1.0), None).unwrap_err().to_string();
            assert!(error.contains("takes no `from`") && error.contains(reason), "{error}");
            continue;
        }
        let at_end = |effects: &[EffectSpec]| {
            let plant = plant(CableModel::LumpedMass, CableInertia::Paper, effects);
            let mut simulation = simulation(&plant);
            run(&mut simulation, 0.2, 0.05);
            (own(&plant, simulation.states()), simulation.outputs())
        };
        let during = |from, until| at_end(&[always.clone().during(from, until).unwrap()]);
        let (without, with) = (at_end(&[]), at_end(std::slice::from_ref(&always)));
        for (times, same) in [
            ((Some(9.0), None), &without),
            ((None, Some(-1.0)), &without),
            ((Some(-1.0), None), &with),
            ((None, Some(9.0)), &with),
            ((Some(0.0), Some(9.0)), &with),
        ] {
            let (states, outputs) = during(times.0, times.1);
            assert_close(&states, &same.0, 1e-9, &format!("{} {times:?}", info.id));
            assert_close(&outputs.unstretched_length, &same.1.unstretched_length, 1e-9, info.id);
            assert_close(&outputs.pose, &same.1.pose, 1e-9, info.id);
        }
        // At its beginning it is there, at its end no longer.
        let spec = always.during(Some(1.0), Some(2.0)).unwrap();
        assert_eq!([0.999, 1.0, 1.999, 2.0].map(|time| spec.in_force(time)), [false, true, true, false]);
    }
}

/// A lag that begins holds the force of that moment, and follows the next jump as a lag does.
#[test]
fn a_lag_begins_without_a_jump() {
    let specs = [effect("winch_lag", Some(2), &[0.3], Some(0.5), None)];
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &specs);
    let mut simulation = simulation(&plant);
    let push = |simulation: &mut Simulation, force: f64| {
        simulation.set_inputs(Inputs { winch_force: [force; 4].into(), disturbance: [0.0; 3] });
    };
    push(&mut simulation, 1.6e4);
    run(&mut simulation, 0.4, 0.1);
    assert_eq!(simulation.evaluate().pull[1], 1.6e4);
    push(&mut simulation, 1.7e4);
    run(&mut simulation, 0.6, 0.1);
    assert!((simulation.evaluate().pull[1] - 1.7e4).abs() < 1e-6);
    push(&mut simulation, 1.8e4);
    run(&mut simulation, 0.8, 0.1);
    let expected = 1.8e4 - 1e3 * (-0.2_f64 / 0.3).exp();
    assert!((simulation.evaluate().pull[1] - expected).abs() < 1e-4, "{}", simulation.evaluate().pull[1]);
}

/// Creep and presliding that begin have no deformation yet, so that no tension jumps.
#[test]
fn what_deforms_begins_without_deformation() {
    let specs = [
        effect("cable_creep", None, &[4e7, 0.5], Some(0.5), None),
        effect("winch_coulomb_friction", None, &[200.0, 0.01, 0.0, 0.0, 1e5], Some(0.5), None),
    ];
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &specs);
    let mut simulation = simulation(&plant);
    run(&mut simulation, 0.499999, 0.1);
    let before = simulation.evaluate().tension;
    let states = |s: &Simulation| (0..4).flat_map(|i| s.states()[plant.effect_states(i)].to_vec()).collect::<Vec<_>>();
    assert_eq!(states(&simulation), [0.0; 8]);
    run(&mut simulation, 0.500001, 0.1);
    for (before, after) in before.iter().zip(simulation.evaluate().tension) {
        assert!((before - after).abs() < 0.05, "{before} {after}");
    }
    run(&mut simulation, 1.5, 0.1);
    assert!(states(&simulation).iter().all(|state| *state != 0.0), "{:?}", states(&simulation));
}

#[test]
fn a_sensor_turns_wrong_at_its_time() {
    let specs = [effect("length_sensor_bias", Some(1), &[0.3], Some(0.5), None)];
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &specs);
    let mut simulation = simulation(&plant);
    let error = |s: &Simulation| s.outputs().unstretched_length[0] - s.states()[plant.unstretched_index(0).unwrap()];
    run(&mut simulation, 0.4, 0.1);
    assert_eq!(error(&simulation), 0.0);
    run(&mut simulation, 0.6, 0.1);
    assert!((error(&simulation) - 0.3).abs() < 1e-12);
}

/// A state saved on either side of a switch goes on bit for bit.
#[test]
fn a_saved_state_goes_on_across_a_switch() {
    let specs = [
        effect("winch_stribeck_friction", None, &[150.0, 200.0, 0.3, 20.0], Some(0.25), Some(0.55)),
        effect("winch_lag", Some(1), &[0.1], Some(0.4), None),
    ];
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, &specs);
    for stop in [0.2, 0.25, 0.3, 0.55, 0.6] {
        let mut simulation = simulation(&plant);
        run(&mut simulation, stop, 0.05);
        let mut bytes = Vec::new();
        simulation.save(&mut bytes);
        let mut fresh = Simulation::new(plant.clone(), &Start::default(), 1e-10).unwrap();
        run(&mut fresh, 0.7, 0.1);
        fresh.restore(&bytes).unwrap();
        run(&mut simulation, 0.8, 0.05);
        run(&mut fresh, 0.8, 0.05);
        assert_eq!(simulation.states(), fresh.states(), "{stop}");
    }
}

/// Friction that is one from 0.3 s and another from 0.7 s on, and plants one after another.
#[test]
fn an_effect_given_again_at_a_later_time_changes_its_size_there() {
    let friction = |force: f64, from: Option<f64>, until: Option<f64>| {
        effect("winch_coulomb_friction", Some(2), &[force, 0.02], from, until)
    };
    let mass = |kg: f64, from: Option<f64>, until: Option<f64>| effect("platform_mass", None, &[kg], from, until);
    // Together the last two would leave nothing of the 2500 kg.
    let specs = [
        friction(250.0, Some(0.3), Some(0.7)),
        friction(400.0, Some(0.7), None),
        mass(-1500.0, None, Some(0.5)),
        mass(-1200.0, Some(0.5), None),
    ];
    for model in MODELS {
        let whole = plant(model, CableInertia::Paper, &specs);
        let mut run_of_all = simulation(&whole);
        run(&mut run_of_all, 1.0, 0.15);
        let mut time = 0.0;
        let mut y: Option<Vec<f64>> = None;
        for (force, kg, end) in
            [(0.0, -1500.0, 0.3), (250.0, -1500.0, 0.5), (250.0, -1200.0, 0.7), (400.0, -1200.0, 1.0)]
        {
            let mut there = vec![mass(kg, None, None)];
            if force > 0.0 {
                there.push(friction(force, None, None));
            }
            let part = plant(model, CableInertia::Paper, &there);
            let states = y.take().unwrap_or_else(|| simulation(&part).states().to_vec());
            let mut part = Simulation::from_states(part, time, states, start().inputs, 1e-10);
            run(&mut part, end, 0.15);
            (time, y) = (end, Some(part.states().to_vec()));
        }
        assert_close(run_of_all.states(), &y.unwrap(), 1e-8, &format!("{model:?}"));
    }
}

#[test]
fn an_effect_given_twice_at_one_time_is_refused_with_the_time() {
    let bias =
        |cable: &str, times: &str| format!("[[effect]]\nid = \"winch_force_bias\"\nbias = 3.0\n{cable}{times}\n");
    let read = |a: &str, b: &str| Model::from_toml(&(bias("cable = 2\n", a) + &bias("cable = 2\n", b)));
    for (a, b, during) in [
        ("", "", "all the time"),
        ("", "from = 3.0", "from 3 s on"),
        ("until = 5.0", "until = 4.0", "until 4 s"),
        ("from = 1.0\nuntil = 5.0", "from = 4.0\nuntil = 9.0", "from 4 s until 5 s"),
    ] {
        let error = read(a, b).unwrap_err().to_string();
        for part in ["winch_force_bias", "cable 2", during, "`from` and `until` that do not overlap"] {
            assert!(error.contains(part), "{error}");
        }
    }
    assert!(read("until = 5.0", "from = 5.0").is_ok(), "one ends as the other begins");
    let everywhere = bias("", "until = 5.0") + &bias("cable = 1\n", "from = 4.5");
    let error = Model::from_toml(&everywhere).unwrap_err().to_string();
    assert!(error.contains("from 4.5 s until 5 s"), "{error}");
}

#[test]
fn times_that_make_no_sense_are_refused() {
    let wrong = |keys: &str| {
        let text = format!("[[effect]]\nid = \"winch_viscous_friction\"\ncoefficient = 3.0\n{keys}\n");
        Model::from_toml(&text).unwrap_err().to_string()
    };
    assert!(wrong("from = 3.0\nuntil = 3.0").contains("expected after `from` (3 s)"));
    assert!(wrong("from = \"soon\"").contains("expected a time in s"));
    assert!(wrong("until = nan").contains("expected a time in s"));
    assert!(wrong("form = 3.0").contains("`from`, `until`"));
    let text = "[[effect]]\nid = \"winch_delay\"\ndelay = 0.1\nfrom = 2.0\n";
    assert!(Model::from_toml(text).unwrap_err().to_string().contains("of all its past"));
    // A drum on a cable without mass makes a state.
    let parameters = Parameters { cable_inertia: CableInertia::None, ..Parameters::default() };
    let drum = effect("winch_drum_inertia", None, &[50.0], Some(1.0), None);
    assert!(Plant::new(parameters, vec![drum]).unwrap_err().to_string().contains("other states"));
    let model = Model::from_toml("[[effect]]\nid = \"platform_mass\"\nmass = 3\nfrom = 2\nuntil = 4.5\n").unwrap();
    assert_eq!((model.effects[0].from, model.effects[0].until), (Some(2.0), Some(4.5)));
    assert_eq!(Model::from_toml(&model.to_toml()).unwrap(), model);
}

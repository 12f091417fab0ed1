//! The controller and the plant together, sampled, on the elastic robot.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::model_file::Model as Robot;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::per_cable::PerCable;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};
use fmi2_export::{Experiment, Model, Value};
use winch_controller::WinchController;

/// The controller, by the names of its variables.
struct Controller(WinchController);

impl Controller {
    fn new(settings: &[(&str, f64)]) -> Self {
        let mut this = Self(WinchController::instantiate(None).unwrap());
        for (name, value) in settings {
            this.set(name, *value);
        }
        this
    }

    /// For the robot of this `model.toml`, which `name` tells apart from those of other tests.
    fn of(name: &str, model: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("model.toml"), model).unwrap();
        Self(WinchController::instantiate(Some(&folder)).unwrap())
    }

    fn set(&mut self, name: &str, value: f64) {
        let index = self.0.description().find(name).unwrap_or_else(|| panic!("no variable `{name}`"));
        self.0.set(index, Value::Real(value)).unwrap();
    }

    fn get(&mut self, name: &str) -> f64 {
        let index = self.0.description().find(name).unwrap_or_else(|| panic!("no variable `{name}`"));
        match self.0.get(index).unwrap() {
            Value::Real(value) => value,
            other => panic!("{other:?}"),
        }
    }

    fn measure(&mut self, y: &[f64]) {
        for (name, value) in ["x", "y", "phi", "vx", "vy", "omega"].into_iter().zip(y) {
            self.set(name, *value);
        }
    }

    fn forces(&mut self, cables: usize) -> PerCable<f64> {
        PerCable::from_fn(cables, |i| self.get(&format!("winch_force[{}]", i + 1)))
    }
}

/// Cables of the default robot.
const CABLES: usize = 4;

/// What a run showed.
#[derive(Debug)]
struct Run {
    /// Largest distance from the reference after the settling time (m).
    position: f64,
    /// Largest angle from the reference after the settling time (rad).
    angle: f64,
    /// Smallest and largest tension of all time (N).
    tension: [f64; 2],
    /// Largest swing of a winch mass at the end, |l̇ - L̇| (m/s).
    swing: f64,
}

/// Both sides exchange values every `step` and hold them, the controller seeing the values before the step.
fn run(model: CableModel, pose: [f64; 3], settings: &[(&str, f64)], step: f64, stop: f64, settling: f64) -> Run {
    let mut controller = Controller::new(settings);
    controller.measure(&[pose[0], pose[1], pose[2], 0.0, 0.0, 0.0]);
    controller.0.initialise(Experiment { start_time: 0.0, stop_time: None, tolerance: None }).unwrap();
    let plant = Plant::new(Parameters { cable_model: model, ..Parameters::default() }, vec![]).unwrap();
    let inputs = Inputs { winch_force: controller.forces(CABLES), ..Inputs::none(CABLES) };
    let start = Start { pose, inputs, ..Start::default() };
    let mut plant = Simulation::new(Arc::new(plant), &start, 1e-8).unwrap();

    let mut found = Run { position: 0.0, angle: 0.0, tension: [f64::INFINITY, 0.0], swing: 0.0 };
    for i in 0..(stop / step).round() as u32 {
        let time = f64::from(i) * step;
        let forces = controller.forces(CABLES);
        let outputs = plant.outputs();
        controller.measure(&[outputs.pose, outputs.twist].concat());
        controller.0.step(time, step).unwrap();
        plant.set_inputs(Inputs { winch_force: forces, ..Inputs::none(CABLES) });
        plant.advance(step).unwrap();

        for tension in plant.outputs().tension {
            found.tension = [found.tension[0].min(tension), found.tension[1].max(tension)];
        }
        if time > settling {
            let error = |name: &str, k: usize, controller: &mut Controller| controller.get(name) - outputs.pose[k];
            let (x, y) = (error("reference_x", 0, &mut controller), error("reference_y", 1, &mut controller));
            found.position = found.position.max(x.hypot(y));
            found.angle = found.angle.max(error("reference_phi", 2, &mut controller).abs());
        }
    }
    let evaluation = plant.evaluate();
    for i in 0..CABLES {
        found.swing = found.swing.max((evaluation.unstretched_rate[i] - evaluation.kinematics[i].speed).abs());
    }
    found
}

/// From the start at full tension, plant and controller alike.
const TAUT: (&str, f64) = ("start_tension", 20e3);

#[test]
fn a_five_metre_circle_in_a_minute() {
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        for step in [0.01, 0.02] {
            let found = run(model, [0.0; 3], &[TAUT], step, 200.0, 20.0);
            assert!(found.position < 3e-3, "{model:?} {step}: {found:?}");
            assert!(found.angle < 1e-6, "{model:?} {step}: {found:?}");
            assert!(found.tension[0] > 19e3 && found.tension[1] < 21e3, "{model:?} {step}: {found:?}");
            assert!(found.swing < 1e-3, "{model:?} {step}: {found:?}");
        }
    }
}

#[test]
fn a_tilted_platform_far_from_its_place_is_brought_back() {
    for start in [[0.1, 0.1, 0.1], [-20.0, 10.0, -0.2]] {
        let found = run(CableModel::LumpedMass, start, &[TAUT, ("circle_radius", 0.0)], 0.02, 80.0, 60.0);
        assert!(found.position < 1e-6 && found.angle < 1e-6, "{start:?}: {found:?}");
        assert!(found.tension[0] > 1e3, "{start:?}: {found:?}");
    }
}

/// Feedback that reaches the winch masses' own frequency drives them; see `LowPass`.
#[test]
fn without_the_low_pass_the_winch_masses_are_driven() {
    let swing = |filter_time| {
        let settings = [TAUT, ("circle_radius", 0.0), ("filter_time", filter_time)];
        run(CableModel::LumpedMass, [0.1, 0.1, 0.01], &settings, 0.02, 60.0, 0.0).swing
    };
    let (with, without) = (swing(0.3), swing(0.0));
    assert!(without > 100.0 * with, "{with} m/s with it, {without} m/s without");
}

/// The largest difference (N) between a cable's tension and its winch's force over a minute, where the master passes no
/// values on before the first step: each side starts from its own defaults.
fn ringing(settings: &[(&str, f64)]) -> f64 {
    let mut controller = Controller::new(settings);
    controller.0.initialise(Experiment { start_time: 0.0, stop_time: None, tolerance: None }).unwrap();
    let plant = Plant::new(Parameters::default(), vec![]).unwrap();
    let mut plant = Simulation::new(Arc::new(plant), &Start::default(), 1e-8).unwrap();
    let step = 0.02;
    let mut largest = 0.0_f64;
    for i in 0..3000 {
        let forces = controller.forces(CABLES);
        let outputs = plant.outputs();
        controller.measure(&[outputs.pose, outputs.twist].concat());
        controller.0.step(f64::from(i) * step, step).unwrap();
        plant.set_inputs(Inputs { winch_force: forces, ..Inputs::none(CABLES) });
        plant.advance(step).unwrap();
        for (tension, force) in plant.outputs().tension.iter().zip(&forces) {
            largest = largest.max((tension - force).abs());
        }
    }
    largest
}

#[test]
fn a_master_that_passes_no_values_at_initialisation_does_not_make_the_cables_ring() {
    let (by_default, jump) = (ringing(&[]), ringing(&[TAUT]));
    assert!(by_default < 100.0, "{by_default} N");
    assert!(jump > 15e3, "a jump from 1 to 20 kN gives {jump} N only: this test shows nothing");
}

/// A platform of 10 kg and 0.3 m in a frame of a few metres, with elastic cables, as a model file.
fn small_robot(ends: &[[[f64; 2]; 2]]) -> String {
    let mut text = String::from(
        "platform_mass = 10.0\nplatform_inertia = 0.5\ngravity = [0.0, -9.81]\ncentre_of_mass = [0.0, -0.02]\n\
         cable_density = 0.01\nyoungs_modulus = 1e9\ncable_area = 1e-5\ncable_damping = 40.0\n\
         [start]\nx = 0.1\nphi = 0.05\n",
    );
    for [anchor, attachment] in ends {
        write!(text, "[[cable]]\nanchor = {anchor:?}\nattachment = {attachment:?}\n").unwrap();
    }
    text
}

/// Three cables, one of them from below: all pull where the platform hangs in the middle.
const THREE: [[[f64; 2]; 2]; 3] = [[[2.0, 3.0], [0.2, -0.1]], [[-2.5, -1.0], [-0.2, -0.1]], [[1.0, 3.0], [-0.2, 0.1]]];

/// Cables from all around, every other one turning the platform the other way.
fn around(cables: usize) -> Vec<[[f64; 2]; 2]> {
    let at = |radius: f64, angle: f64| [radius * angle.cos(), radius * angle.sin()];
    let angle = |i: usize, shift: f64| TAU * (i as f64 + shift) / cables as f64;
    (0..cables).map(|i| [at(3.0, angle(i, 0.5)), at(0.3, angle(i, [0.9, 0.1][i % 2]))]).collect()
}

#[test]
fn robots_of_other_numbers_of_cables_follow_their_circle() {
    let robots = [THREE.to_vec(), around(4), around(6), around(8), around(12)];
    for ends in robots {
        let (cables, text) = (ends.len(), small_robot(&ends));
        let mut controller = Controller::of(&format!("cables_{cables}"), &text);
        for (name, value) in [
            ("circle_radius", 0.1),
            ("circle_period", 20.0),
            ("ramp_time", 5.0),
            ("position_bandwidth", 2.0),
            ("orientation_bandwidth", 2.0),
            ("filter_time", 0.05),
            ("set_point_x", 0.0),
            ("set_point_phi", 0.0),
        ] {
            controller.set(name, value);
        }
        controller.0.initialise(Experiment { start_time: 0.0, stop_time: None, tolerance: None }).unwrap();
        let mut model = Robot::from_toml(&text).unwrap();
        model.start.inputs.winch_force = controller.forces(cables);
        let mut plant = model.simulation().unwrap();
        let (step, mut worst) = (0.01, 0.0_f64);
        for i in 0..4000 {
            let (forces, outputs) = (controller.forces(cables), plant.outputs());
            controller.measure(&[outputs.pose, outputs.twist].concat());
            controller.0.step(f64::from(i) * step, step).unwrap();
            plant.set_inputs(Inputs { winch_force: forces, ..Inputs::none(cables) });
            plant.advance(step).unwrap();
            if i > 1000 {
                for (name, shown) in ["reference_x", "reference_y", "reference_phi"].into_iter().zip(outputs.pose) {
                    worst = worst.max((controller.get(name) - shown).abs());
                }
            }
            assert!(plant.outputs().tension.iter().all(|tension| *tension > 0.0), "{cables} cables, slack at step {i}");
        }
        // One sample late, pretension pulls a little beside: 80 N in each cable by 0.3 mm in 3 m.
        assert!(worst < 4e-3, "{cables} cables: {worst} m or rad from the reference");
    }
}

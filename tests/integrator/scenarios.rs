//! Motions of the plant that an integrator has to follow, and how far one at some tolerance and step strays.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::integrator::Solver;
use cdpr::parameters::{CableModel, Parameters};
use cdpr::plant::Plant;
use cdpr::release::RELEASE_POSE;
use cdpr::simulation::{Simulation, Start};

/// A motion under forces that jump at multiples of `hold` (s).
pub(crate) struct Scenario {
    pub(crate) name: &'static str,
    model: CableModel,
    /// Lengths of the robot over those of the default.
    scale: f64,
    effects: Vec<EffectSpec>,
    start: [f64; 3],
    pub(crate) duration: f64,
    pub(crate) hold: f64,
    pub(crate) force: fn(f64) -> [f64; 4],
}

fn weave(t: f64) -> [f64; 4] {
    let w = 200.0 * (0.5 * t).sin();
    [2e4 + w, 2e4 - w, 2e4 + w, 2e4 - w]
}

fn released(_: f64) -> [f64; 4] {
    [1e3; 4]
}

/// Two cables let go and pulled again. (Not for long: what is left of the robot is unstable.)
fn let_go(t: f64) -> [f64; 4] {
    let pull = if t % 2.0 < 0.5 { 0.0 } else { 2e4 };
    [pull, 2e4, pull, 2e4]
}

fn jumps(t: f64) -> [f64; 4] {
    let side = if t % 1.0 < 0.5 { 500.0 } else { -500.0 };
    [2e4 + side, 2e4 - side, 2e4 + side, 2e4 - side]
}

/// The scenarios by which accuracy is judged.
pub(crate) fn scenarios() -> Vec<Scenario> {
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).unwrap();
    let six = vec![
        effect("winch_lag", &[0.05]),
        effect("winch_coulomb_friction", &[250.0, 0.01]),
        effect("platform_quadratic_drag", &[20.0, 0.0, 0.0]),
        effect("cable_drag", &[0.02]),
        effect("platform_mass", &[200.0]),
        effect("winch_force_gain", &[0.97]),
    ];
    let plain = |name, scale, start, duration, hold, force| Scenario {
        name,
        model: CableModel::LumpedMass,
        scale,
        effects: Vec::new(),
        start,
        duration,
        hold,
        force,
    };
    vec![
        plain("release", 1.0, RELEASE_POSE, 20.0, 1e3, released),
        plain("weave", 1.0, [0.1; 3], 10.0, 0.1, weave),
        plain("let go", 1.0, [0.1; 3], 4.0, 0.5, let_go),
        Scenario { model: CableModel::MasslessSpring, ..plain("jumps", 1.0, [0.1; 3], 5.0, 0.5, jumps) },
        plain("short cables", 0.1, [0.01, 0.01, 0.01], 5.0, 0.1, weave),
        Scenario { effects: six, ..plain("six effects", 1.0, [0.1; 3], 10.0, 0.1, weave) },
    ]
}

impl Scenario {
    pub(crate) fn begin(&self, solver: Solver, tolerance: f64) -> Simulation {
        let mut parameters = Parameters { cable_model: self.model, ..Parameters::default() };
        parameters.anchor_radius *= self.scale;
        parameters.attachment_radius *= self.scale;
        let plant = Arc::new(Plant::new(parameters, self.effects.clone()).unwrap());
        let inputs = Inputs { winch_force: (self.force)(0.0).into(), disturbance: [0.0; 3] };
        let start = Start { pose: self.start, inputs, ..Start::default() };
        Simulation::new(plant, &start, tolerance).unwrap().with_solver(solver)
    }

    /// Runs it at communication steps of `step` (s); the states at every hundredth of the duration, and at its end.
    pub(crate) fn run(&self, solver: Solver, tolerance: f64, step: f64) -> (Vec<Vec<f64>>, Simulation) {
        let mut simulation = self.begin(solver, tolerance);
        let steps = (self.duration / step).round() as u32;
        let every = (steps / 100).max(1);
        let mut states = Vec::new();
        for k in 0..steps {
            let held = (f64::from(k) * step / self.hold + 1e-9).floor() * self.hold;
            simulation.set_inputs(Inputs { winch_force: (self.force)(held).into(), disturbance: [0.0; 3] });
            simulation.advance(step).unwrap();
            if (k + 1) % every == 0 {
                states.push(simulation.states().to_vec());
            }
        }
        (states, simulation)
    }

    /// Largest difference of pose and unstretched lengths (m), angles times the platform's radius.
    pub(crate) fn difference(&self, a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
        let plant = self.begin(Solver::Radau, 1e-3).plant().clone();
        let arm = plant.parameters().attachment_radius;
        let lengths: Vec<usize> = (0..plant.cables()).filter_map(|i| plant.unstretched_index(i)).collect();
        let every = a.len() / b.len().min(a.len());
        let of = |(a, b): (&Vec<f64>, &Vec<f64>)| {
            let pose = [(0, 1.0), (1, 1.0), (2, arm)].into_iter();
            let all = pose.chain(lengths.iter().map(|at| (*at, 1.0)));
            all.map(|(at, arm)| arm * (a[at] - b[at]).abs()).fold(0.0, f64::max)
        };
        a.iter().skip(every - 1).step_by(every).zip(b).map(of).fold(0.0, f64::max)
    }
}

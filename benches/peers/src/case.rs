//! What is simulated.

use std::sync::Arc;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::integrator::Solver;
use cdpr::parameters::Parameters;
use cdpr::plant::Plant;
use cdpr::simulation::{Simulation, Start};

use crate::circle::{self, Control};
use crate::scenarios::{Scenario, scenarios};

/// A motion of a plant, in communication steps.
pub(crate) struct Case {
    pub(crate) key: &'static str,
    pub(crate) title: String,
    /// Communication step (s).
    pub(crate) step: f64,
    pub(crate) steps: usize,
    /// Whether cables go slack on the way.
    pub(crate) slackens: bool,
    start: Simulation,
    feed: Feed,
    /// Name of its motion by another program, if there is one.
    pub(crate) stored: Option<&'static str>,
}

/// Where the inputs of a step come from.
enum Feed {
    /// From the time.
    Forces { hold: f64, force: fn(f64) -> [f64; 4] },
    /// From a controller of the pose, around the method that is looked at.
    Loop,
}

/// The inputs of one step after the other.
pub(crate) struct Inputting<'a> {
    case: &'a Case,
    control: Option<Control>,
}

impl Case {
    /// The plant at its start.
    pub(crate) fn simulation(&self, solver: Solver, tolerance: f64) -> Simulation {
        let start = &self.start;
        let (plant, states) = (start.plant().clone(), start.states().to_vec());
        Simulation::from_states(plant, 0.0, states, start.inputs(), tolerance).with_solver(solver)
    }

    pub(crate) fn plant(&self) -> &Arc<Plant> {
        self.start.plant()
    }

    /// States at the start.
    pub(crate) fn states(&self) -> &[f64] {
        self.start.states()
    }

    /// Size of an error in each state that counts as much as one of 1 m.
    pub(crate) fn nominal(&self) -> Vec<f64> {
        let arm = self.plant().parameters().attachment_radius;
        let mut nominal: Vec<f64> = self.states().iter().map(|state| state.abs().max(1.0)).collect();
        nominal[..6].copy_from_slice(&[1.0, 1.0, 1.0 / arm, 1.0, 1.0, 1.0 / arm]);
        for at in (0..self.plant().cables()).filter_map(|cable| self.plant().unstretched_index(cable)) {
            nominal[at] = 1.0;
        }
        nominal
    }

    /// The states by which errors are judged: pose and unstretched lengths.
    pub(crate) fn looked_at(&self) -> Vec<usize> {
        let lengths = (0..self.plant().cables()).filter_map(|cable| self.plant().unstretched_index(cable));
        (0..3).chain(lengths).collect()
    }

    pub(crate) fn inputting(&self) -> Inputting<'_> {
        let control = matches!(self.feed, Feed::Loop).then(|| Control::new(*self.plant().geometry()));
        Inputting { case: self, control }
    }
}

impl Inputting<'_> {
    /// The inputs of step `k`, at the start of which the plant has these states.
    pub(crate) fn at(&mut self, k: usize, states: &[f64]) -> Inputs {
        match (&self.case.feed, &mut self.control) {
            (Feed::Forces { hold, force }, _) => {
                let held = (k as f64 * self.case.step / hold + 1e-9).floor() * hold;
                Inputs { winch_force: force(held).into(), disturbance: [0.0; 3] }
            }
            (Feed::Loop, Some(control)) => control.inputs(k, states),
            (Feed::Loop, None) => unreachable!("a loop has its control"),
        }
    }
}

/// The robot on its circle, with `effects`.
fn on_the_circle(key: &'static str, title: &str, effects: Vec<EffectSpec>, stored: Option<&'static str>) -> Case {
    let plant = Arc::new(Plant::new(Parameters::default(), effects).expect("a plant of the defaults"));
    let pose = circle::start_pose();
    let control = || Control::new(Geometry::new(&Parameters::default()));
    let inputs = control().inputs(0, &[pose, [0.0; 3]].concat());
    let start = Simulation::new(plant, &Start { pose, inputs, ..Start::default() }, 1e-8).expect("a start");
    let (step, steps) = (circle::STEP, circle::STEPS);
    Case { key, title: title.to_owned(), step, steps, slackens: false, start, feed: Feed::Loop, stored }
}

fn scenario(key: &'static str, title: &str, scenario: &Scenario, step: f64, stored: &'static str) -> Case {
    let steps = (scenario.duration / step).round() as usize;
    let feed = Feed::Forces { hold: scenario.hold, force: scenario.force };
    let start = scenario.begin(Solver::Radau, 1e-8);
    Case { key, title: title.to_owned(), step, steps, slackens: key == "S4", start, feed, stored: Some(stored) }
}

/// Ten effects at sizes of practice.
fn ten_effects() -> Vec<EffectSpec> {
    let effect = |id: &str, values: &[f64]| EffectSpec::new(id, None, values).expect("in range");
    vec![
        effect("winch_lag", &[0.05]),
        effect("winch_coulomb_friction", &[250.0, 0.01]),
        effect("winch_viscous_friction", &[100.0]),
        effect("winch_force_gain", &[0.97]),
        effect("pulley_capstan_loss", &[0.01, 0.02]),
        effect("platform_quadratic_drag", &[20.0, 0.0, 0.0]),
        effect("cable_drag", &[0.02]),
        effect("platform_mass", &[200.0]),
        effect("cable_sag", &[2.0, 2e4]),
        effect("cable_creep", &[1e8, 10.0]),
    ]
}

/// Every case.
pub(crate) fn all() -> Vec<Case> {
    let list = scenarios();
    let named = |name: &str| list.iter().find(|scenario| scenario.name == name).expect("a scenario of the tests");
    let [release, let_go, jumps, short, six] = ["release", "let go", "jumps", "short cables", "six effects"].map(named);
    vec![
        scenario("S1-1", "S1, release, steps of 1 ms", release, 1e-3, "release"),
        scenario("S1-10", "S1, release, steps of 10 ms", release, 1e-2, "release"),
        scenario("S1-100", "S1, release, steps of 100 ms", release, 1e-1, "release"),
        on_the_circle("S3", "S3, closed loop on a circle, 10 ms", Vec::new(), Some("circle")),
        scenario("S4", "S4, two cables let go and pulled, 10 ms", let_go, 1e-2, "let_go"),
        scenario("S5-10", "S5, massless springs, forces that jump, 10 ms", jumps, 1e-2, "jumps"),
        scenario("S5-100", "S5, massless springs, forces that jump, 100 ms", jumps, 1e-1, "jumps"),
        scenario("S6", "S6, short cables, 10 ms", short, 1e-2, "short_cables"),
        scenario("S7", "S7, six effects, 10 ms", six, 1e-2, "six_effects"),
        on_the_circle("ten", "ten effects on the circle, 10 ms", ten_effects(), None),
    ]
}

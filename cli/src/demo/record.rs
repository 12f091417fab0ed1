//! Recordings of a robot that is not quite the model: a closed loop with noise on every sensor.

use std::f64::consts::TAU;
use std::path::Path;

use cdpr::model_file::Model;
use cdpr::signal::indexed;
use fastrand::Rng;

use super::control::{Controller, Reference};
use crate::simulate;
use crate::whole::WholeFile;

/// Sampling interval (s).
pub(super) const STEP: f64 = 0.04;
/// Noise of the measured pose (m, m, rad) and of the measured unstretched lengths (m).
pub(super) const POSE_NOISE: [f64; 3] = [5e-3, 5e-3, 5e-5];
pub(super) const LENGTH_NOISE: f64 = 2e-3;
/// Time (s) in which the motion grows to its size.
const FADE: f64 = 8.0;
/// The robot is under way this long (s) before the recording begins.
const LEAD_IN: f64 = 10.0;

/// What tells one recording from another.
pub(super) struct Plan {
    /// Length (s).
    pub(super) duration: f64,
    /// Seed of the noise and of the path.
    pub(super) seed: u64,
}

/// Waves of the reference: amplitude (m, m, rad) and period (s). Their phases are drawn.
const WAVES: [([f64; 3], f64); 4] =
    [([2.0, 1.6, 0.020], 31.0), ([1.0, 1.2, 0.012], 17.0), ([0.6, 0.5, 0.008], 11.0), ([0.25, 0.3, 0.004], 6.5)];

/// The path: waves that fade in from rest.
struct Path3 {
    phase: [[f64; 3]; WAVES.len()],
}

impl Path3 {
    fn draw(random: &mut Rng) -> Self {
        Self { phase: std::array::from_fn(|_| std::array::from_fn(|_| TAU * random.f64())) }
    }

    fn at(&self, time: f64) -> Reference {
        // A step of fifth order and its rates.
        let s = (time / FADE).min(1.0);
        let fade = [
            s * s * s * (10.0 + s * (6.0 * s - 15.0)),
            30.0 * s * s * (1.0 - s) * (1.0 - s) / FADE,
            60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / (FADE * FADE),
        ];
        let mut wave: Reference = [[0.0; 3]; 3];
        for ((amplitude, period), phase) in WAVES.iter().zip(&self.phase) {
            let rate = TAU / period;
            for k in 0..3 {
                let (sin, cos) = (rate * time + phase[k]).sin_cos();
                wave[0][k] += amplitude[k] * sin;
                wave[1][k] += amplitude[k] * rate * cos;
                wave[2][k] -= amplitude[k] * rate * rate * sin;
            }
        }
        let each = |f: &dyn Fn(usize) -> f64| std::array::from_fn(f);
        [
            each(&|k| fade[0] * wave[0][k]),
            each(&|k| fade[1] * wave[0][k] + fade[0] * wave[1][k]),
            each(&|k| fade[2] * wave[0][k] + 2.0 * fade[1] * wave[1][k] + fade[0] * wave[2][k]),
        ]
    }
}

/// A normally distributed number by the method of G. E. P. Box and M. E. Muller.
fn normal(random: &mut Rng) -> f64 {
    (-2.0 * (1.0 - random.f64()).ln()).sqrt() * (TAU * random.f64()).cos()
}

/// Records `robot` under control of one who believes in `believed`, and writes the table.
pub(super) fn record(robot: &Model, believed: &Model, plan: &Plan, path: &Path) -> anyhow::Result<()> {
    let mut random = Rng::with_seed(plan.seed);
    let reference = Path3::draw(&mut random);
    let mut controller = Controller::new(&believed.parameters, reference.at(0.0)[0])?;
    let mut robot = robot.clone();
    robot.start.pose = reference.at(0.0)[0];
    robot.start.inputs = controller.forces(robot.start.pose, &reference.at(0.0), STEP)?;
    let mut simulation = simulate::begin_simulation(&robot)?;
    let mut table = csv::Writer::from_writer(WholeFile::create(path)?);
    let cables = robot.parameters.cables();
    let names = |name: &'static str| (0..cables).map(move |i| indexed(name, i));
    let header = ["time".to_owned()].into_iter().chain(names("winch_force"));
    table.write_record(header.chain(["x", "y", "phi"].map(String::from)).chain(names("unstretched_length")))?;
    let lead_in = (LEAD_IN / STEP).round() as u32;
    for k in 0..=lead_in + (plan.duration / STEP).round() as u32 {
        let time = f64::from(k) * STEP;
        simulation.advance_to(time)?;
        let shown = simulation.outputs();
        let pose: [f64; 3] = std::array::from_fn(|a| shown.pose[a] + POSE_NOISE[a] * normal(&mut random));
        let length = shown.unstretched_length.map(|l| l + LENGTH_NOISE * normal(&mut random));
        let inputs = controller.forces(pose, &reference.at(time), STEP)?;
        simulation.set_inputs(inputs);
        if k < lead_in {
            continue;
        }
        let time = f64::from(k - lead_in) * STEP;
        // Written no finer than a sensor shows it.
        let cells = [format!("{time:.2}")].into_iter().chain(inputs.winch_force.iter().map(|u| format!("{u:.3}")));
        table.write_record(
            cells.chain(pose.map(|v| format!("{v:.7}"))).chain(length.iter().map(|l| format!("{l:.5}"))),
        )?;
    }
    table.into_inner().map_err(csv::IntoInnerError::into_error)?.finish()
}

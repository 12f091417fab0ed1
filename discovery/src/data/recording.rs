//! Recordings for tests: a robot under control, with noise on its sensors.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, structure_matrix};
use cdpr::model_file::Model;

use crate::data::{Channel, Trial};
use crate::estimate::{Fit, first_randomness, noise_of_data};

const STEP: f64 = 0.1;
/// Mass (kg, kg, kg m²) as the controller believes.
const MASS: [f64; 3] = [2800.0, 2800.0, 3.5e5];
/// Speed (rad/s) and damping ratio of the control loop.
const LOOP: (f64, f64) = (0.5, 0.8);
/// Speed of the controller's observer (rad/s).
const OBSERVER: f64 = 2.0;
/// Waves of the path: amplitude (m, m, rad) and period (s).
const WAVES: [([f64; 3], f64); 3] = [([1.5, 1.0, 0.015], 19.0), ([0.5, 0.8, 0.01], 11.0), ([0.3, 0.2, 0.005], 6.5)];
const NOISE: [f64; 7] = [2e-3, 2e-3, 5e-5, 2e-3, 2e-3, 2e-3, 2e-3];

/// A sequence of normally distributed numbers, by the method of G. E. P. Box and M. E. Muller.
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        // Multiplier of P. L'Ecuyer, Mathematics of Computation 68 (1999), table 4.
        self.0 = self.0.wrapping_mul(2_862_933_555_777_941_757).wrapping_add(1);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        (-2.0 * (1.0 - self.uniform()).ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// So many numbers of white noise of unit size.
pub(crate) fn noise(count: usize, seed: u64) -> impl Iterator<Item = f64> {
    let mut random = Normal(seed);
    (0..count).map(move |_| random.next())
}

/// `duration` (s) of the default robot with `effects`.
pub(crate) fn record(effects: &[EffectSpec], duration: f64, seed: u64) -> Trial {
    let mut random = Normal(seed);
    for _ in 0..10 {
        random.next();
    }
    let phase: [f64; 9] = std::array::from_fn(|_| TAU * random.uniform());
    // Position, speed and acceleration of one axis.
    let wanted = |axis: usize, time: f64| {
        WAVES.iter().enumerate().fold([0.0; 3], |sum, (w, (amplitude, period))| {
            let rate = TAU / period;
            let (sin, cos) = (rate * time + phase[3 * w + axis]).sin_cos();
            let a = amplitude[axis];
            [sum[0] + a * sin, sum[1] + a * rate * cos, sum[2] - a * rate * rate * sin]
        })
    };
    let mut model = Model { effects: effects.to_vec(), ..Model::default() };
    let geometry = Geometry::new(&model.parameters);
    let bounds = Bounds::new(0.0, 40e3).expect("an interval");
    let distribution = Distribution { objective: Objective::MidTension, bounds };
    // Slow against the cables' vibration: pose, twist and acceleration as the controller believes.
    let mut believed: [[f64; 3]; 3] = [0, 1, 2].map(|k| std::array::from_fn(|axis| wanted(axis, 0.0)[k]));
    let mut forces = |time: f64, pose: [f64; 3]| {
        let [position, twist, acceleration] = &mut believed;
        for k in 0..3 {
            let predicted = position[k] + STEP * twist[k];
            let surprise = pose[k] - predicted;
            position[k] = predicted + 1.4 * OBSERVER * STEP * surprise;
            twist[k] += STEP * (acceleration[k] + OBSERVER * OBSERVER * surprise);
            let [p, v, a] = wanted(k, time);
            let (rate, damping) = LOOP;
            acceleration[k] = a + rate * rate * (p - position[k]) + 2.0 * damping * rate * (v - twist[k]);
        }
        let wrench = std::array::from_fn(|k| MASS[k] * acceleration[k]);
        let tensions = distribution.tensions(&structure_matrix(&geometry, position), &wrench).expect("tensions");
        Inputs { winch_force: tensions, ..Inputs::none(4) }
    };
    model.start.pose = std::array::from_fn(|k| wanted(k, 0.0)[0]);
    model.start.inputs = forces(0.0, model.start.pose);
    let mut simulation = model.simulation().expect("a robot");
    let mut channels: Vec<Channel> = (0..3).map(Channel::Pose).collect();
    channels.extend((0..4).map(Channel::UnstretchedLength));
    let mut trial = Trial { name: "made".to_owned(), time: vec![], inputs: vec![], channels, measured: vec![] };
    for k in 0..=(duration / STEP).round() as u32 {
        let time = f64::from(k) * STEP;
        simulation.advance_to(time).expect("a motion");
        let shown = simulation.outputs();
        let inputs = forces(time, shown.pose);
        simulation.set_inputs(inputs);
        trial.time.push(time);
        trial.inputs.push(inputs);
        let values = shown.pose.iter().chain(&shown.unstretched_length);
        trial.measured.push(values.zip(NOISE).map(|(v, noise)| v + noise * random.next()).collect());
    }
    trial
}

/// The default model with `effects`, fitted to recordings: trajectories and sizes of what is random.
pub(crate) fn fitted(effects: &[EffectSpec], trials: &[Trial]) -> Fit {
    let model = Model { effects: effects.to_vec(), ..Model::default() };
    let noise = noise_of_data(trials);
    let mut fit = Fit::new(&model, trials, &first_randomness(&model, &noise), None).expect("a fit");
    fit.smooth(trials).expect("a fit");
    fit.fit_randomness(trials, &noise, true);
    fit.smooth(trials).expect("a fit");
    fit
}

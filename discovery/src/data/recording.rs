//! Recordings for tests: a robot under control, with noise on its sensors.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::effect::EffectSpec;
use cdpr::geometry::Geometry;
use cdpr::inverse::distribution::{Bounds, Distribution, Objective, structure_matrix};
use cdpr::model_file::Model;
use cdpr::parameters::{CableParameters, Parameters};
use cdpr::simulation::Start;

use crate::data::{Channel, Trial};
use crate::filter::estimate::{Fit, noise_of_data};
use crate::instruments::latents::first_randomness;

/// A robot with its controller, the path it is asked to follow, and its sensors.
pub(crate) struct Bench {
    pub(crate) parameters: Parameters,
    /// Sampling interval (s).
    step: f64,
    /// Mass (kg, kg, kg m²) as the controller believes.
    mass: [f64; 3],
    /// Speed (rad/s) and damping ratio of the control loop.
    control: (f64, f64),
    /// Speed of the controller's observer (rad/s).
    observer: f64,
    /// Tensions lie about the middle of zero and this (N).
    tension: f64,
    /// What the path's waves are multiplied by: lengths, and periods.
    scale: (f64, f64),
    /// Noise of x, y, φ and the lengths (m, rad).
    pub(crate) noise: [f64; 4],
    /// Size (N) of a force on each winch that is another at each sample and is not recorded.
    unrecorded: f64,
}

impl Bench {
    /// The default robot.
    pub(crate) fn large() -> Self {
        Self {
            parameters: Parameters::default(),
            step: 0.1,
            mass: [2800.0, 2800.0, 3.5e5],
            control: (0.5, 0.8),
            observer: 2.0,
            tension: 40e3,
            scale: (1.0, 1.0),
            noise: [2e-3, 2e-3, 5e-5, 2e-3],
            unrecorded: 0.0,
        }
    }

    /// The same driven by so much (N) at each winch that is not recorded.
    pub(crate) fn with_unrecorded_forces(self, unrecorded: f64) -> Self {
        Self { unrecorded, ..self }
    }

    /// One as large with six cables, on a frame without symmetry, and with gravity.
    pub(crate) fn six() -> Self {
        let angles = [-2.7_f64, -2.0, -0.9, -0.2, 1.1, 2.1];
        let cable = angles.iter().enumerate().map(|(i, angle)| {
            let (out, turned) = (820.0 + 30.0 * i as f64, angle + if i % 2 == 0 { 1.5 } else { -1.4 });
            let anchor = [out * angle.cos(), out * angle.sin()];
            CableParameters::between(anchor, [10.0 * turned.cos(), 10.0 * turned.sin()])
        });
        let parameters = Parameters { cable: cable.collect(), gravity: [0.0, -1.6], ..Parameters::default() };
        Self { parameters, ..Self::large() }
    }

    /// One of 4 m and 20 kg under 100 N, whose rotation grows by 4.4 1/s.
    pub(crate) fn laboratory() -> Self {
        let parameters = Parameters {
            anchor_radius: 2.0,
            attachment_radius: 0.2,
            platform_mass: 20.0,
            platform_inertia: 0.4,
            cable_density: 0.02,
            cable_area: 4e-6,
            cable_damping: 100.0,
            ..Parameters::default()
        };
        Self {
            parameters,
            step: 0.01,
            mass: [20.0, 20.0, 0.4],
            control: (10.0, 0.8),
            observer: 40.0,
            tension: 200.0,
            scale: (0.1, 0.2),
            noise: [2e-4, 2e-4, 2e-4, 2e-4],
            unrecorded: 0.0,
        }
    }

    /// The same with softer and heavier cables, whose ends ring for longer than a sampling interval and in less of it than one.
    pub(crate) fn ringing() -> Self {
        let mut bench = Self::laboratory();
        let parameters = &mut bench.parameters;
        (parameters.youngs_modulus, parameters.cable_area) = (1e9, 1e-4);
        (parameters.cable_density, parameters.cable_damping) = (0.1, 40.0);
        (parameters.platform_inertia, bench.mass[2]) = (1.6, 1.6);
        bench
    }

    /// One of 4 m with stiff cables on heavy rotors: its cables stretch by no more than the noise of what is measured.
    pub(crate) fn stiff() -> Self {
        let mut bench = Self::laboratory();
        let parameters = &mut bench.parameters;
        (parameters.youngs_modulus, parameters.cable_area, parameters.cable_damping) = (1e11, 1e-5, 500.0);
        (parameters.winch.drum_radius, parameters.winch.rotor_inertia) = (0.05, Some(0.01));
        (parameters.platform_inertia, bench.mass[2]) = (1.6, 1.6);
        bench.noise = [5e-4, 5e-4, 5e-4, 2e-4];
        bench
    }
}

/// Waves of the path: amplitude (m, m, rad) and period (s).
const WAVES: [([f64; 3], f64); 3] = [([1.5, 1.0, 0.015], 19.0), ([0.5, 0.8, 0.01], 11.0), ([0.3, 0.2, 0.005], 6.5)];

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
    record_on(&Bench::large(), effects, duration, seed)
}

/// `duration` (s) of a robot with `effects`.
pub(crate) fn record_on(bench: &Bench, effects: &[EffectSpec], duration: f64, seed: u64) -> Trial {
    let mut random = Normal(seed);
    for _ in 0..10 {
        random.next();
    }
    let phase: [f64; 9] = std::array::from_fn(|_| TAU * random.uniform());
    // Position, speed and acceleration of one axis.
    let wanted = |axis: usize, time: f64| {
        WAVES.iter().enumerate().fold([0.0; 3], |sum, (w, (amplitude, period))| {
            let rate = TAU / (period * bench.scale.1);
            let (sin, cos) = (rate * time + phase[3 * w + axis]).sin_cos();
            let a = amplitude[axis] * if axis < 2 { bench.scale.0 } else { 1.0 };
            [sum[0] + a * sin, sum[1] + a * rate * cos, sum[2] - a * rate * rate * sin]
        })
    };
    let parameters = bench.parameters.clone();
    let mut model = Model { effects: effects.to_vec(), parameters, ..Model::default() };
    let geometry = Geometry::new(&model.parameters);
    let [weight_x, weight_y] = bench.parameters.gravity.map(|g| g * bench.parameters.platform_mass);
    let weight = [weight_x, weight_y, 0.0];
    let bounds = Bounds::new(0.0, bench.tension).expect("an interval");
    let distribution = Distribution { objective: Objective::MidTension, bounds };
    // Slow against the cables' vibration: pose, twist and acceleration as the controller believes.
    let mut believed: [[f64; 3]; 3] = [0, 1, 2].map(|k| std::array::from_fn(|axis| wanted(axis, 0.0)[k]));
    let mut forces = |time: f64, pose: [f64; 3]| {
        let [position, twist, acceleration] = &mut believed;
        for k in 0..3 {
            let predicted = position[k] + bench.step * twist[k];
            let surprise = pose[k] - predicted;
            position[k] = predicted + 1.4 * bench.observer * bench.step * surprise;
            twist[k] += bench.step * (acceleration[k] + bench.observer * bench.observer * surprise);
            let [p, v, a] = wanted(k, time);
            let (rate, damping) = bench.control;
            acceleration[k] = a + rate * rate * (p - position[k]) + 2.0 * damping * rate * (v - twist[k]);
        }
        let wrench = std::array::from_fn(|k| bench.mass[k] * acceleration[k] - weight[k]);
        let tensions = distribution.tensions(&structure_matrix(&geometry, position), &wrench).expect("tensions");
        Inputs { winch_force: tensions, ..Inputs::none(tensions.len()) }
    };
    model.start = Start::pulling(geometry.cables());
    model.start.pose = std::array::from_fn(|k| wanted(k, 0.0)[0]);
    model.start.inputs = forces(0.0, model.start.pose);
    let mut simulation = model.simulation().expect("a robot");
    let mut channels: Vec<Channel> = (0..3).map(Channel::Pose).collect();
    channels.extend((0..geometry.cables()).map(Channel::UnstretchedLength));
    let mut trial = Trial {
        name: "made".to_owned(),
        time: vec![],
        inputs: vec![],
        channels,
        measured: vec![],
        taken_off: vec![],
        undone: Vec::new(),
    };
    for k in 0..=(duration / bench.step).round() as u32 {
        let time = f64::from(k) * bench.step;
        simulation.advance_to(time).expect("a motion");
        let shown = simulation.outputs();
        let inputs = forces(time, shown.pose);
        let mut driving = inputs;
        if bench.unrecorded > 0.0 {
            driving.winch_force.iter_mut().for_each(|force| *force += bench.unrecorded * random.next());
        }
        simulation.set_inputs(driving);
        trial.time.push(time);
        trial.inputs.push(inputs);
        let values = shown.pose.iter().chain(&shown.unstretched_length);
        let noise = bench.noise.iter().chain(std::iter::repeat(&bench.noise[3]));
        trial.measured.push(values.zip(noise).map(|(v, noise)| v + noise * random.next()).collect());
    }
    trial
}

/// The recording with some of its channels alone, in this order.
pub(crate) fn of_channels(trial: &Trial, channels: &[usize]) -> Trial {
    Trial {
        channels: channels.iter().map(|j| trial.channels[*j]).collect(),
        measured: trial.measured.iter().map(|row| channels.iter().map(|j| row[*j]).collect()).collect(),
        ..trial.clone()
    }
}

/// The default model with `effects`, fitted to recordings: trajectories and sizes of what is random.
pub(crate) fn fitted(effects: &[EffectSpec], trials: &[Trial]) -> Fit {
    fitted_on(&Bench::large(), effects, trials)
}

/// The same of another robot.
pub(crate) fn fitted_on(bench: &Bench, effects: &[EffectSpec], trials: &[Trial]) -> Fit {
    let parameters = bench.parameters.clone();
    let model = Model { effects: effects.to_vec(), parameters, ..Model::default() };
    let noise = noise_of_data(trials);
    let mut fit = Fit::new(&model, trials, &first_randomness(&model, trials, &noise), None).expect("a fit");
    fit.smooth(trials).expect("a fit");
    fit.fit_randomness(trials, &noise, true);
    fit.smooth(trials).expect("a fit");
    fit
}

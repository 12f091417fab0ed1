use super::distribution::{Bounds, Distribution, Objective};
use super::*;
use crate::effect::EffectSpec;
use crate::integrator::{Complex64, DenseFactors, System};
use crate::parameters::{CableInertia, CableParameters, Parameters};
use crate::per_cable::PerCable;
use nalgebra::DMatrix;

mod forces;

/// A smooth motion in closed form: each coordinate a sum of two sines.
struct Sines {
    amplitude: [[f64; 2]; 3],
    frequency: [[f64; 2]; 3],
    gust: [f64; 3],
}

impl Trajectory for Sines {
    fn span(&self) -> [f64; 2] {
        [0.0, 100.0]
    }

    fn motion(&self, t: f64) -> Motion {
        let sine = |a: f64, w: f64, order: usize| {
            let phase = w * t + 0.5 * std::f64::consts::PI * order as f64;
            a * w.powi(order as i32) * phase.sin()
        };
        Motion {
            pose: std::array::from_fn(|k| {
                std::array::from_fn(|n| (0..2).map(|m| sine(self.amplitude[k][m], self.frequency[k][m], n)).sum())
            }),
            disturbance: std::array::from_fn(|k| std::array::from_fn(|n| sine(self.gust[k], 0.7 + 0.1 * k as f64, n))),
        }
    }
}

fn sines() -> Sines {
    Sines {
        amplitude: [[5.0, 0.5], [3.0, 0.8], [0.1, 0.01]],
        frequency: [[0.2, 1.1], [0.31, 0.9], [0.15, 0.8]],
        gust: [300.0, 200.0, 1500.0],
    }
}

fn distribution(objective: Objective) -> Distribution {
    Distribution { objective, bounds: Bounds::new(5e3, 35e3).unwrap() }
}

fn plant(model: CableModel, inertia: CableInertia, effects: Vec<EffectSpec>) -> Arc<Plant> {
    let parameters = Parameters { cable_model: model, cable_inertia: inertia, ..Parameters::default() };
    Arc::new(Plant::new(parameters, effects).unwrap())
}

fn effect(id: &str, cable: Option<usize>, values: &[f64]) -> EffectSpec {
    EffectSpec::new(id, cable, values).unwrap()
}

/// Largest residual of the implicit equations, in each row's own size.
fn worst_residual(plant: &Arc<Plant>, objective: Objective) -> f64 {
    let (trajectory, redundancy) = (sines(), distribution(objective));
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
    let mut worst = 0.0_f64;
    for time in [0.3, 7.7, 31.4, 55.0] {
        let mut internal = problem.start(time).unwrap();
        // Off the slow solution too: the equations hold for any paid-out length near it.
        for v in &mut internal {
            *v *= 1.0 + 1e-8;
        }
        let instant = problem.at(time, &internal).unwrap();
        let y = &instant.states;
        let mut rates = vec![0.0; plant.dimension()];
        let taut = PerCable::filled(plant.cables(), false);
        plant.rates(time, y, &instant.inputs(), &taut, &mut rates);
        // The accelerations asked for, and those of the paid-out lengths, in place of those that follow.
        for k in 0..3 {
            rates[3 + k] = instant.motion.pose[k][2];
        }
        for i in 0..plant.cables() {
            if let Some(at) = plant.unstretched_index(i) {
                rates[at] = instant.unstretched_rate[i];
            }
            if let Some(at) = plant.rate_index(i) {
                rates[at] = instant.unstretched_acceleration[i];
            }
        }
        let mut residual = vec![0.0; plant.dimension()];
        plant.residual(time, y, &rates, &instant.inputs(), &taut, &mut residual);
        for (row, r) in residual.iter().enumerate() {
            let size = if row == 5 { 1e5 } else { 1e4 };
            worst = worst.max(r.abs() / size);
        }
    }
    worst
}

#[test]
fn the_implicit_equations_hold_for_every_model() {
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        for inertia in [CableInertia::Paper, CableInertia::Reeled, CableInertia::None] {
            for objective in
                [Objective::MinimumNorm, Objective::PNorm(6.0), Objective::MidTension, Objective::AnalyticCentre]
            {
                let worst = worst_residual(&plant(model, inertia, Vec::new()), objective);
                assert!(worst < 1e-11, "{model:?} {inertia:?} {objective:?}: {worst:e}");
            }
        }
    }
}

#[test]
fn the_implicit_equations_hold_for_more_cables_in_gravity() {
    for cables in [5, 6, 8, 12] {
        let cable = (0..cables).map(|i| {
            let angle = std::f64::consts::TAU * (i as f64 + 0.4) / cables as f64;
            let on_body = angle + if i % 2 == 0 { 0.7 } else { -0.7 };
            CableParameters::between(
                [900.0 * angle.cos(), 900.0 * angle.sin()],
                [10.0 * on_body.cos(), 10.0 * on_body.sin()],
            )
        });
        let parameters = Parameters {
            cable: cable.collect(),
            gravity: [0.0, -2.0],
            centre_of_mass: [0.3, 0.2],
            ..Parameters::default()
        };
        let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
        for objective in [Objective::MinimumNorm, Objective::MidTension, Objective::AnalyticCentre] {
            let worst = worst_residual(&plant, objective);
            assert!(worst < 1e-9, "{cables} {objective:?}: {worst:e}");
        }
    }
}

#[test]
fn two_cables_are_too_few_for_a_motion() {
    let cable = [-9.0, 9.0].map(|x| CableParameters::between([x, 900.0], [x, 5.0]));
    let parameters = Parameters { cable: cable.to_vec(), gravity: [0.0, -9.81], ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, Vec::new()).unwrap());
    let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
    let error = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap().start(0.3).unwrap_err();
    assert!(matches!(error, InverseError::Pose { .. } | InverseError::Distribution { .. }), "{error}");
}

#[test]
fn the_implicit_equations_hold_with_effects() {
    let effects = vec![
        effect("platform_quadratic_drag", None, &[30.0, 3.0, -1.0]),
        effect("platform_com_offset", None, &[0.4, -0.2]),
        effect("umbilical", None, &[2.0, 5.0, 100.0, -300.0]),
        effect("cable_drag", Some(2), &[0.01]),
        effect("cable_axial_mass", Some(3), &[0.3]),
        effect("anchor_offset", Some(1), &[0.5, 0.2]),
        effect("cable_thermal_expansion", None, &[2e-4, 300.0, 0.3]),
        effect("cable_stiffening", None, &[500.0]),
        effect("winch_coulomb_friction", Some(3), &[250.0, 0.05]),
        effect("pulley_capstan_loss", Some(1), &[0.05, 0.01]),
        effect("winch_force_gain", Some(4), &[-0.03]),
        effect("winch_force_bias", None, &[40.0]),
        effect("winch_saturation", None, &[0.0, 60e3]),
        effect("winch_drum_inertia", Some(2), &[50.0]),
        EffectSpec::expression("winch[2]", "20*sin(x) + 0.01*winch_force[1]").unwrap(),
    ];
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        let worst = worst_residual(&plant(model, CableInertia::Paper, effects.clone()), Objective::MidTension);
        assert!(worst < 1e-11, "{model:?}: {worst:e}");
    }
}

/// Plant and inverse problem side by side: the forces come from the inverse problem's own states alone.
struct FeedForward<'a> {
    problem: &'a InverseDynamics<'a>,
    plant: &'a Plant,
    jacobian: DMatrix<f64>,
    factors: DenseFactors,
}

impl System for FeedForward<'_> {
    fn dimension(&self) -> usize {
        self.plant.dimension() + self.problem.internal_dimension()
    }

    fn rates(&mut self, time: f64, y: &[f64], rates: &mut [f64]) {
        let n = self.plant.dimension();
        let inputs = self.problem.at(time, &y[n..]).unwrap().inputs();
        self.plant.rates(time, &y[..n], &inputs, &[false; 4].into(), &mut rates[..n]);
        self.problem.internal_rates(time, &y[n..], &mut rates[n..]).unwrap();
    }

    fn scale(&self, _y: &[f64], scale: &mut [f64]) {
        scale.fill(1.0);
        scale[2] = 0.1;
        scale[5] = 0.1;
    }

    fn linearise(&mut self, time: f64, y: &[f64]) {
        let n = self.dimension();
        let mut point = y.to_vec();
        let (mut ahead, mut behind) = (vec![0.0; n], vec![0.0; n]);
        self.jacobian = DMatrix::zeros(n, n);
        for c in 0..n {
            let h = 1e-6 * y[c].abs().max(1e-2);
            point[c] = y[c] + h;
            self.rates(time, &point, &mut ahead);
            point[c] = y[c] - h;
            self.rates(time, &point, &mut behind);
            point[c] = y[c];
            for r in 0..n {
                self.jacobian[(r, c)] = (ahead[r] - behind[r]) / (2.0 * h);
            }
        }
    }

    fn factor(&mut self, real: f64, complex: Complex64) {
        self.factors.factor(&self.jacobian, real, complex);
    }

    fn solve_real(&mut self, b: &mut [f64]) {
        self.factors.solve_real(b);
    }

    fn solve_complex(&mut self, re: &mut [f64], im: &mut [f64]) {
        self.factors.solve_complex(re, im);
    }
}

/// How far the forward simulation is from the trajectory after `duration`, as metres and radians.
fn miss(plant: &Arc<Plant>, duration: f64, tolerance: f64) -> f64 {
    let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
    let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
    let internal = problem.start(0.0).unwrap();
    let mut y = problem.at(0.0, &internal).unwrap().states;
    y.extend(internal);
    let mut system =
        FeedForward { problem: &problem, plant, jacobian: DMatrix::zeros(0, 0), factors: DenseFactors::default() };
    let mut integrator = Integrator::new(y.len(), 0, tolerance);
    integrator.advance(&mut system, 0.0, &mut y, duration).unwrap();
    let asked = trajectory.motion(duration).derivative(0);
    (0..3).map(|k| (y[k] - asked[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn forward_simulation_returns_the_trajectory() {
    for model in [CableModel::Rigid, CableModel::MasslessSpring, CableModel::LumpedMass] {
        let plant = plant(model, CableInertia::Paper, Vec::new());
        let miss = miss(&plant, 10.0, 1e-10);
        assert!(miss < 1e-9, "{model:?}: {miss:e}");
    }
}

#[test]
fn forward_simulation_returns_the_trajectory_without_damping() {
    let undamped = Parameters { cable_damping: 0.0, ..Parameters::default() };
    let miss = miss(&Arc::new(Plant::new(undamped, Vec::new()).unwrap()), 5.0, 1e-10);
    assert!(miss < 2e-9, "{miss:e}");
}

#[test]
fn forward_simulation_returns_the_trajectory_behind_a_lag() {
    let effects = vec![effect("winch_lag", None, &[0.2]), effect("winch_force_gain", Some(2), &[0.05])];
    // The fast pole cubed magnifies the rounding of the lengths: behind a damper the force is good to some mN.
    for (model, tolerance, bound) in [
        (CableModel::Rigid, 1e-10, 2e-9),
        (CableModel::MasslessSpring, 1e-10, 2e-9),
        (CableModel::LumpedMass, 1e-6, 1e-6),
    ] {
        let miss = miss(&plant(model, CableInertia::Paper, effects.clone()), 5.0, tolerance);
        assert!(miss < bound, "{model:?}: {miss:e}");
    }
}

#[test]
fn a_force_that_changes_faster_than_its_winch_is_told() {
    let run = |rate_limit: f64| {
        let plant = plant(CableModel::Rigid, CableInertia::Paper, vec![effect("winch_lag", None, &[0.2, rate_limit])]);
        let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
        let problem = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap();
        problem.run(&[0.0, 1.0, 2.0], 1e-8).map(|run| run[2].winch_force).map_err(|e| e.to_string())
    };
    assert_eq!(run(1e6).unwrap(), run(0.0).unwrap());
    let error = run(0.1).unwrap_err();
    assert!(error.contains("`winch_lag`") && error.contains("N/s"), "{error}");
}

#[test]
fn forward_simulation_returns_the_trajectory_with_creep_sag_hysteresis_and_pulleys() {
    for spec in [
        effect("cable_creep", None, &[1e8, 20.0]),
        effect("cable_sag", None, &[2.1, 2e4]),
        effect("cable_hysteresis", None, &[100.0, 2e-4]),
        effect("pulley_radius", None, &[3.0]),
    ] {
        let miss = miss(&plant(CableModel::LumpedMass, CableInertia::Paper, vec![spec.clone()]), 2.0, 1e-9);
        assert!(miss < 2e-9, "{}: {miss:e}", spec.id);
    }
}

#[test]
fn hysteresis_of_cables_without_damping_is_refused() {
    let parameters = Parameters { cable_damping: 0.0, ..Parameters::default() };
    let plant = Arc::new(Plant::new(parameters, vec![effect("cable_hysteresis", None, &[100.0, 2e-4])]).unwrap());
    let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
    let error = InverseDynamics::new(plant, &trajectory, &redundancy).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("`cable_hysteresis`") && error.contains("damping"), "{error}");
}

/// The one that is named is the one that begins or ends there, not the first that does so at any time.
#[test]
fn what_begins_along_the_trajectory_is_refused_by_name() {
    let during = |mut spec: EffectSpec, from: f64| {
        spec.from = Some(from);
        spec
    };
    let before = during(effect("winch_viscous_friction", None, &[30.0]), -5.0);
    let (trajectory, redundancy) = (sines(), distribution(Objective::MidTension));
    let new = |effects| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, effects);
        InverseDynamics::new(plant, &trajectory, &redundancy).map(|_| ()).map_err(|e| e.to_string())
    };
    assert_eq!(new(vec![before.clone()]), Ok(()));
    let error = new(vec![before, during(effect("platform_mass", None, &[30.0]), 1.0)]).unwrap_err();
    assert!(error.contains("`platform_mass`"), "{error}");
}

#[test]
fn paid_out_lengths_of_a_run_follow_the_slow_solution() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, Vec::new());
    let (trajectory, redundancy) = (sines(), distribution(Objective::AnalyticCentre));
    let problem = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap();
    let times: Vec<f64> = (0..=50).map(|k| 0.1 * f64::from(k)).collect();
    let run = problem.run(&times, 1e-10).unwrap();
    for instant in &run {
        let slow = problem.start(instant.time).unwrap();
        for i in 0..4 {
            let difference = (instant.unstretched[i] - slow[i]).abs();
            assert!(difference < 1e-7, "t {}: {difference:e}", instant.time);
        }
    }
}

#[test]
fn tension_rates_are_those_of_the_tensions() {
    let plant = plant(CableModel::Rigid, CableInertia::Paper, Vec::new());
    let trajectory = sines();
    for objective in [Objective::MinimumNorm, Objective::PNorm(6.0), Objective::MidTension, Objective::AnalyticCentre] {
        let redundancy = distribution(objective);
        let problem = InverseDynamics::new(plant.clone(), &trajectory, &redundancy).unwrap();
        let (t, h) = (12.3, 1e-4);
        let rate = problem.at(t, &[]).unwrap().tension_rate;
        let (ahead, behind) = (problem.at(t + h, &[]).unwrap().tension, problem.at(t - h, &[]).unwrap().tension);
        for i in 0..4 {
            let difference = (ahead[i] - behind[i]) / (2.0 * h);
            assert!(
                (difference - rate[i]).abs() < 1e-4 * (1.0 + rate[i].abs()),
                "{objective:?}: {difference} {rate:?}"
            );
        }
    }
}

#[test]
fn an_impossible_motion_is_told_with_time_wrench_and_nearest_tensions() {
    let plant = plant(CableModel::LumpedMass, CableInertia::Paper, Vec::new());
    let trajectory = Sines { gust: [0.0, 0.0, 2e6], ..sines() };
    let redundancy = distribution(Objective::MidTension);
    let problem = InverseDynamics::new(plant, &trajectory, &redundancy).unwrap();
    let times: Vec<f64> = (0..=100).map(|k| 0.1 * f64::from(k)).collect();
    let error = problem.run(&times, 1e-8).map(|_| ()).unwrap_err();
    let InverseError::Distribution { time, error: DistributionError::Infeasible(found) } = &error else {
        panic!("{error}");
    };
    assert!(*time > 0.1 && *time < 2.0, "{error}");
    assert!(found.shortfall[2].abs() > 1.0, "{error}");
    let earlier = problem.run(&times[..(time / 0.1).round() as usize], 1e-8);
    assert!(earlier.is_ok(), "the first infeasible time is told: {error}");
}

#[test]
fn effects_that_cannot_be_turned_round_are_refused_by_name() {
    let trajectory = sines();
    let redundancy = distribution(Objective::MidTension);
    let refusal = |effects: Vec<EffectSpec>| {
        let plant = plant(CableModel::LumpedMass, CableInertia::Paper, effects);
        match InverseDynamics::new(plant, &trajectory, &redundancy) {
            Err(error) => error.to_string(),
            Ok(problem) => problem.run(&[0.0, 1.0], 1e-8).map(|_| ()).unwrap_err().to_string(),
        }
    };
    for (effects, part) in [
        (vec![effect("winch_delay", None, &[0.1])], "winch_delay"),
        (vec![effect("winch_dead_band", Some(2), &[50.0, 0.1])], "winch_dead_band"),
        (vec![effect("cable_transverse_mode", Some(1), &[0.2, 0.0, 0.0])], "cable_transverse_mode"),
        (vec![EffectSpec::expression("platform.force_x", "0.1*winch_force[2]").unwrap()], "expression"),
        (vec![effect("winch_saturation", Some(2), &[0.0, 10e3])], "effect `winch_saturation` of cable 2"),
    ] {
        let text = refusal(effects);
        assert!(text.contains(part), "{text}");
    }
}

//! Accuracy: tolerances are kept, the order is five, switches are where they are.

use cdpr::integrator::{Integrator, Solver};

use crate::problems::{
    Dense, Dipping, Dragged, Oscillator, Problem, ProtheroRobinson, Robertson, TwoPulls, Unweighed, VanDerPol,
    assert_order,
};
use crate::scenarios::scenarios;

fn run(problem: impl Problem, y: &mut [f64], tolerance: f64, stops: &[f64]) {
    let switches = problem.switches();
    let mut system = Dense::new(problem);
    let mut integrator = Integrator::new(y.len(), switches, tolerance);
    let mut time = 0.0;
    for stop in stops {
        integrator.advance(&mut system, time, y, stop - time).unwrap();
        time = *stop;
    }
}

#[test]
fn van_der_pol_ends_where_it_should() {
    for (tolerance, allowed) in [(1e-5, 1e-3), (1e-8, 1e-6), (1e-11, 1e-9)] {
        let mut y = VanDerPol::START;
        run(VanDerPol, &mut y, tolerance, &[2.0]);
        for k in 0..2 {
            assert!((y[k] - VanDerPol::AT_2[k]).abs() < allowed, "tolerance {tolerance:e}: {y:?}");
        }
    }
}

#[test]
fn robertson_ends_where_it_should() {
    let stops: Vec<f64> = (-2..=11).map(|k| 10.0_f64.powi(k)).collect();
    let mut y = [1.0, 0.0, 0.0];
    run(Robertson, &mut y, 1e-8, &stops);
    for k in 0..3 {
        assert!((y[k] / Robertson::AT_1E11[k] - 1.0).abs() < 1e-4, "{y:?}");
    }
    assert!((y.iter().sum::<f64>() - 1.0).abs() < 1e-9, "mass is conserved");
}

#[test]
fn a_stiff_component_follows_its_slow_solution() {
    for lambda in [-1.0, -1e3, -1e6, -1e9] {
        let mut y = [1.0];
        run(ProtheroRobinson { lambda }, &mut y, 1e-9, &[10.0]);
        // In stiff parts the order falls to that of the stages, three.
        let error = (y[0] - 10.0_f64.cos()).abs();
        assert!(error < if lambda < -100.0 { 5e-6 } else { 1e-7 }, "λ = {lambda:e}: {error:e}");
    }
}

#[test]
fn tolerances_are_kept_over_many_periods() {
    let mut last = f64::INFINITY;
    for tolerance in [1e-5, 1e-7, 1e-9, 1e-11] {
        let problem = Oscillator { frequency: 13.0, damping: 0.01 };
        let exact = problem.at(5.0);
        let mut y = [1.0, 0.0];
        run(problem, &mut y, tolerance, &[5.0]);
        let error = (y[0] - exact[0]).abs().max((y[1] - exact[1]).abs() / 13.0);
        assert!(error < 200.0 * tolerance, "tolerance {tolerance:e}: {error:e}");
        assert!(error < 0.2 * last, "a tighter tolerance must help: {error:e} after {last:e}");
        last = error;
    }
}

/// While it sticks, the Jacobian is so stiff that each correction is small whatever the pull: that must not hold it for good.
#[test]
fn friction_that_begins_to_slide_is_not_held_by_an_old_jacobian() {
    for tolerance in [1e-3, 1e-4, 1e-6, 1e-8, 1e-10] {
        for width in [1e-3, 1e-6, 1e-9] {
            let stops: Vec<f64> = (1..=1000).map(|k| 0.01 * f64::from(k)).collect();
            let mut y = [0.0];
            run(Dragged { width }, &mut y, tolerance, &stops);
            let exact = Dragged::AT_10;
            assert!((y[0] / exact - 1.0).abs() < 0.01, "width {width:e}, tolerance {tolerance:e}: {y:?}, {exact}");
        }
    }
}

/// Equal steps: the error must fall by 2⁵ with each halving. (A linear problem, so that Newton's method ends at once.)
#[test]
fn order_is_five() {
    let error = |steps: u32| {
        let problem = Oscillator { frequency: 2.0, damping: 0.1 };
        let exact = problem.at(1.0);
        let mut system = Dense::new(Unweighed(problem));
        let mut integrator = Integrator::new(2, 0, 1e-8);
        let mut y = [1.0, 0.0];
        let h = 1.0 / f64::from(steps);
        for k in 0..steps {
            integrator.advance(&mut system, f64::from(k) * h, &mut y, h).unwrap();
        }
        assert_eq!(integrator.statistics().steps, u64::from(steps));
        (y[0] - exact[0]).hypot(y[1] - exact[1])
    };
    let errors: Vec<f64> = [8, 16, 32, 64].map(error).to_vec();
    assert_order(&errors, 5.0);
}

/// Parabolas are integrated exactly, so that all error is in the location of the switches.
#[test]
fn switches_are_located_to_rounding() {
    for stops in [vec![10.0], (1..=100).map(|k| 0.1 * f64::from(k)).collect()] {
        let mut y = [1.0, 0.0];
        run(TwoPulls { above: true }, &mut y, 1e-6, &stops);
        let exact = TwoPulls::at(10.0);
        for k in 0..2 {
            assert!((y[k] - exact[k]).abs() < 1e-10, "{} stops: {y:?}, {exact:?}", stops.len());
        }
    }
}

/// Lower than -0.99 for a twentieth of its period, or a fifth of a step: seldom at one of the five looks.
#[test]
fn a_function_that_dips_between_the_looks_is_seen() {
    for solver in [Solver::Radau, Solver::DormandPrince] {
        for k in 0..40 {
            let step = 1.2 + 0.01 * f64::from(k);
            let oscillator = Oscillator { frequency: 1.0, damping: 0.0 };
            let mut system = Dense::new(Dipping { oscillator, level: 0.99, below: false });
            let mut integrator = Integrator::new(2, 1, 1e-8);
            integrator.set_solver(solver);
            let mut y = [1.0, 0.0];
            for k in 0..5 {
                integrator.advance(&mut system, f64::from(k) * step, &mut y, step).unwrap();
            }
            assert_eq!(integrator.statistics().switches, 2, "{solver:?}, steps of {step}");
        }
    }
}

/// Whatever the step, and with one Newton iteration as with many: the error in metres is at most ten times the tolerance, over
/// all steps together.
#[test]
fn the_plant_keeps_its_tolerance_at_every_step() {
    for scenario in scenarios() {
        for step in [1e-3, 1e-2, 1e-1] {
            let (exact, _) = scenario.run(Solver::Radau, 1e-13, step);
            for tolerance in [1e-6, 1e-8, 1e-10] {
                let (found, _) = scenario.run(Solver::Radau, tolerance, step);
                let error = scenario.difference(&found, &exact);
                assert!(
                    error < 10.0 * tolerance,
                    "{}, step {step} s, tolerance {tolerance:e}: {error:e} m",
                    scenario.name
                );
            }
        }
    }
}

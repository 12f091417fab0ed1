//! The integrator says when it cannot go on, with the time and the state reached.

use cdpr::integrator::{IntegrationError, Integrator};
use nalgebra::DMatrix;

use crate::problems::{Dense, Problem};

/// `y' = y²`, infinite at t = 1 from y = 1.
struct Explosion;

impl Problem for Explosion {
    fn dimension(&self) -> usize {
        1
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        rates[0] = y[0] * y[0];
    }
    fn jacobian(&self, _time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = 2.0 * y[0];
    }
}

#[test]
fn an_explosion_is_an_error_near_its_time() {
    let mut integrator = Integrator::new(1, 0, 1e-8);
    let mut y = [1.0];
    let error = integrator.advance(&mut Dense::new(Explosion), 0.0, &mut y, 2.0).unwrap_err();
    assert!((error.time() - 1.0).abs() < 1e-6, "{error}");
    assert!(matches!(error, IntegrationError::StepTooSmall { .. } | IntegrationError::NotFinite { .. }), "{error}");
    assert!(y[0].is_finite() && integrator.statistics().steps < 10_000, "{y:?}");
}

/// Rates that are no numbers from t = 0.3 on.
struct Ends;

impl Problem for Ends {
    fn dimension(&self) -> usize {
        1
    }
    fn rates(&self, time: f64, _y: &[f64], rates: &mut [f64]) {
        rates[0] = if time < 0.3 { 1.0 } else { f64::NAN };
    }
    fn jacobian(&self, _time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = 0.0;
    }
}

#[test]
fn rates_that_end_stop_the_integration_there() {
    let mut integrator = Integrator::new(1, 0, 1e-8);
    let mut y = [0.0];
    let error = integrator.advance(&mut Dense::new(Ends), 0.0, &mut y, 1.0).unwrap_err();
    assert!((error.time() - 0.3).abs() < 1e-9 && (y[0] - 0.3).abs() < 1e-9, "{error}");
    let error = integrator.advance(&mut Dense::new(Ends), 0.4, &mut y, 1.0).unwrap_err();
    assert_eq!(error, IntegrationError::NotFinite { time: 0.4, state: y.to_vec() });
}

/// Two pulls that always push back across the switch: it can neither stay nor leave.
struct Chatter {
    up: bool,
}

impl Problem for Chatter {
    fn dimension(&self) -> usize {
        1
    }
    fn rates(&self, _time: f64, _y: &[f64], rates: &mut [f64]) {
        rates[0] = if self.up { 1.0 } else { -1.0 };
    }
    fn jacobian(&self, _time: f64, _y: &[f64], j: &mut DMatrix<f64>) {
        j[(0, 0)] = 0.0;
    }
    fn switches(&self) -> usize {
        1
    }
    fn switching_functions(&self, y: &[f64], values: &mut [f64]) {
        values[0] = if self.up { -y[0] } else { y[0] };
    }
    fn switch(&mut self) {
        self.up = !self.up;
    }
}

#[test]
fn endless_switching_is_an_error() {
    let mut integrator = Integrator::new(1, 1, 1e-8);
    let mut y = [-0.5];
    let error = integrator.advance(&mut Dense::new(Chatter { up: true }), 0.0, &mut y, 1.0).unwrap_err();
    assert!(matches!(error, IntegrationError::Chatter { .. }), "{error}");
    assert!((error.time() - 0.5).abs() < 1e-6 && y[0].abs() < 1e-6, "{error}");
}

/// A circle that attracts, gone round at a million radians a second.
struct Fast;

impl Problem for Fast {
    fn dimension(&self) -> usize {
        2
    }
    fn rates(&self, _time: f64, y: &[f64], rates: &mut [f64]) {
        let pull = 1.0 - y[0] * y[0] - y[1] * y[1];
        rates[0] = 1e6 * (y[1] + y[0] * pull);
        rates[1] = 1e6 * (y[1] * pull - y[0]);
    }
    fn jacobian(&self, _time: f64, y: &[f64], j: &mut DMatrix<f64>) {
        let pull = 1.0 - y[0] * y[0] - y[1] * y[1];
        j[(0, 0)] = 1e6 * (pull - 2.0 * y[0] * y[0]);
        j[(0, 1)] = 1e6 * (1.0 - 2.0 * y[0] * y[1]);
        j[(1, 0)] = 1e6 * (-1.0 - 2.0 * y[0] * y[1]);
        j[(1, 1)] = 1e6 * (pull - 2.0 * y[1] * y[1]);
    }
}

/// However long the call was to be: what it may cost grows with the time reached.
#[test]
fn a_call_that_does_not_get_on_ends() {
    for duration in [0.1, 10.0, 1e3] {
        let mut integrator = Integrator::new(2, 0, 1e-8);
        let mut system = Dense::new(Fast);
        let mut y = [1.0, 0.0];
        let error = integrator.advance(&mut system, 0.0, &mut y, duration).unwrap_err();
        let IntegrationError::TooMuchWork { evaluations, since, time, .. } = error else { panic!("{error}") };
        assert!(evaluations < 300_000 && integrator.statistics().evaluations < 300_000, "{error}");
        assert!(since == 0.0 && time > 0.0 && time < 0.1, "{error}");
        assert!((y[0].hypot(y[1]) - 1.0).abs() < 1e-3, "{y:?}");
        // The next call has an allowance of its own.
        integrator.advance(&mut system, time, &mut y, 1e-6).unwrap();
    }
}

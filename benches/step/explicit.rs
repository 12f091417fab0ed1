//! The classical Runge-Kutta method of order 4, as a measure for the implicit one.

use cdpr::dynamics::Inputs;
use cdpr::plant::Plant;

/// The state after `steps` communication steps of `step` seconds, each of `parts` equal Runge-Kutta steps.
pub(crate) fn runge_kutta_4(
    plant: &Plant,
    start: &[f64],
    steps: usize,
    parts: usize,
    step: f64,
    command: impl Fn(usize) -> Inputs,
) -> Vec<f64> {
    let n = start.len();
    let h = step / parts as f64;
    let mut y = start.to_vec();
    let mut stage = vec![0.0; n];
    let mut k = [vec![0.0; n], vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    for s in 0..steps {
        let u = command(s);
        for _ in 0..parts {
            plant.rates(0.0, &y, &u, [false; 4], &mut k[0]);
            for (next, weight) in [(1, 0.5), (2, 0.5), (3, 1.0)] {
                for i in 0..n {
                    stage[i] = y[i] + weight * h * k[next - 1][i];
                }
                plant.rates(0.0, &stage, &u, [false; 4], &mut k[next]);
            }
            for i in 0..n {
                y[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
            }
        }
    }
    y
}

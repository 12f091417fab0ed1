//! The filter and the smoother beside the textbook's, with full matrices.

use nalgebra::{DMatrix, DVector};

use super::predict::STEP_ERROR;
use super::*;
use crate::data::recording::{Bench, fitted, fitted_on, record, record_on};
use crate::instruments::expected::with_memory;
use crate::model::examined::WRENCH;
use crate::model::randomness::Memory;

/// The textbook's filter and smoother (H. E. Rauch, F. Tung and C. T. Striebel, 1965) with full matrices: `-2 log L`, the
/// smoothed deviations of states and latents, and the covariance before each sample's measurements.
fn dense(linear: &LinearTrial, randomness: &Randomness) -> (f64, Vec<f64>, Vec<DMatrix<f64>>) {
    let (n, m, w) = (linear.states, linear.channels, linear.states + randomness.processes());
    let shown = randomness.shown_by_channel(m);
    let mut x = DVector::zeros(w);
    let mut p = DMatrix::zeros(w, w);
    (0..n).for_each(|c| x[c] = linear.prior.mean[c]);
    (0..n * n).for_each(|at| p[(at / n, at % n)] = linear.prior.covariance[at]);
    let estimated = randomness.estimated();
    (0..estimated).for_each(|l| x[n + l] = -linear.latents(0)[l]);
    (0..w - n).for_each(|l| p[(n + l, n + l)] = randomness.deviation(l).powi(2));
    let together = |p: &mut DMatrix<f64>, by: &dyn Fn(usize, usize) -> f64| {
        for (a, b) in randomness.correlated() {
            p[(n + a, n + b)] = by(a, b) * randomness.force_error_covariance();
            p[(n + b, n + a)] = p[(n + a, n + b)];
        }
    };
    together(&mut p, &|_, _| 1.0);
    let (mut value, mut past) = (0.0, Vec::new());
    for k in 0..linear.len {
        let (before, covariance) = (x.clone(), p.clone());
        for j in (0..m).filter(|j| linear.residual[k * m + j].is_finite()) {
            let mut h = DVector::zeros(w);
            linear.shown_by(k, j).for_each(|(c, slope)| h[c] = slope);
            shown[j].clone().for_each(|l| h[n + l] = 1.0);
            let jitter = randomness.jitter * linear.rate[k * m + j];
            let s = h.dot(&(&p * &h)) + randomness.noise[j].powi(2) + jitter.powi(2);
            let innovation = linear.residual[k * m + j] - h.dot(&x);
            let gain = &p * &h / s;
            value += s.ln() + innovation * innovation / s;
            x += &gain * innovation;
            p -= &gain * gain.transpose() * s;
        }
        let (mut f, mut add, mut q) = (DMatrix::zeros(w, w), DVector::zeros(w), DMatrix::zeros(w, w));
        if k + 1 < linear.len {
            for c in 0..n + estimated {
                linear.column(k, c).enumerate().for_each(|(r, slope)| f[(r, c)] = slope);
            }
            (0..n).for_each(|r| add[r] = linear.defect[k * n + r]);
            let latents =
                (n..linear.width()).map(|c| DVector::from_iterator(w, linear.column(k, c).chain(vec![0.0; w - n])));
            let latents: Vec<DVector<f64>> = latents.collect();
            let winches = &latents[WRENCH..];
            if estimated == 0 {
                // White noise with the power that a process of first order has at low frequency, of each state by itself.
                let decay = (-linear.interval[k] / randomness.time).exp();
                for (l, column) in latents.iter().enumerate() {
                    add -= column * linear.latents(k)[l];
                    let variance = randomness.latent_deviation(l).powi(2) * (1.0 + decay) / (1.0 - decay);
                    (0..n).for_each(|r| q[(r, r)] += variance * column[r].powi(2));
                }
            }
            match randomness.expected {
                None => winches.iter().for_each(|c| q += randomness.input.powi(2) * c * c.transpose()),
                Some(_) => {
                    let errors = [winches, winches].concat();
                    errors.iter().rev().enumerate().for_each(|(i, c)| f.set_column(w - 1 - i, c));
                }
            }
            (0..n).for_each(|r| q[(r, r)] += STEP_ERROR * STEP_ERROR);
            for l in 0..w - n {
                let decay = randomness.decay(l, linear.interval[k]);
                f[(n + l, n + l)] = decay;
                q[(n + l, n + l)] = randomness.deviation(l).powi(2) * (1.0 - decay * decay);
                if l < estimated {
                    add[n + l] = decay * linear.latents(k)[l] - linear.latents(k + 1)[l];
                }
            }
            let decay = |l: usize| randomness.decay(l, linear.interval[k]);
            together(&mut q, &|a, b| 1.0 - decay(a) * decay(b));
        }
        past.push((before, covariance, x.clone(), p.clone(), f.clone()));
        x = &f * &x + add;
        p = &f * &p * f.transpose() + q;
    }
    let width = n + estimated;
    let mut smoothed = vec![0.0; linear.len * width];
    let mut next: Option<DVector<f64>> = None;
    for k in (0..linear.len).rev() {
        let (_, _, x, p, f) = &past[k];
        let state = match &next {
            None => x.clone(),
            Some(next) => {
                let (before, covariance, ..) = &past[k + 1];
                // By correlations: variances are between metres and a billionth of one, squared.
                let size = covariance.diagonal().map(f64::sqrt);
                let correlation = covariance.component_div(&(&size * size.transpose()));
                let inverse = correlation.svd(true, true).solve(&(next - before).component_div(&size), 1e-14);
                x + p * f.transpose() * inverse.expect("a solution").component_div(&size)
            }
        };
        smoothed[k * width..(k + 1) * width].copy_from_slice(&state.as_slice()[..width]);
        next = Some(state);
    }
    (value, smoothed, past.into_iter().map(|(_, covariance, ..)| covariance).collect())
}

#[test]
fn the_filter_and_the_smoother_are_those_of_the_textbook() {
    are_those_of_the_textbook(&Bench::large());
}

#[test]
fn the_filter_and_the_smoother_have_room_for_six_cables() {
    are_those_of_the_textbook(&Bench::six());
}

/// With everything that an instrument may have, in a trial with gaps.
fn are_those_of_the_textbook(bench: &Bench) {
    // Longer than what is filtered together.
    let mut trials = [record_on(bench, &[], 60.0, 3)];
    (20..30).for_each(|k| trials[0].measured[k][1] = f64::NAN);
    let fit = fitted_on(bench, &[], &trials);
    let plain = crate::filter::estimate::for_trial(&fit.randomness, &trials[0]);
    let memory = |channel, time, drift| Memory { channel, deviation: 3e-3, time, drift };
    let rich = Randomness { input: 40.0, jitter: 3e-3, force: 5.0, winch: 8.0, ..plain.clone() }
        .with_memory(memory(4, 0.7, false))
        .with_memory(memory(0, 0.3, false))
        .with_memory(memory(0, 40.0, true));
    let expected = Randomness { expected: Some(with_memory(0.05, 0.02)), ..rich.clone() };
    let mut linear = fit.linear(&trials)[0].clone();
    // Along a trajectory that has settled next to nothing is left to smooth, and rounding would be compared.
    linear.residual.iter_mut().enumerate().for_each(|(at, slot)| *slot += 5e-3 * (0.01 * at as f64).sin());
    // The textbook inverts covariances, which reach from those of the first states to a billionth squared.
    linear.prior.covariance.iter_mut().for_each(|covariance| *covariance *= 1e-4);
    let linear = &linear;
    assert!(expected.has_latents());
    let without = [rich.without_latents(), expected.without_latents()];
    for randomness in [plain, rich, expected].into_iter().chain(without) {
        let (smoothed, own) = smooth(linear, &randomness);
        let (value, expected, covariances) = dense(linear, &randomness);
        let width = linear.states + randomness.estimated();
        assert!((own - value).abs() < 1e-6 * value.abs(), "{own} {value}");
        for c in 0..linear.states {
            let of = |all: &[f64], width: usize| all.iter().skip(c).step_by(width).copied().collect::<Vec<f64>>();
            let (own, expected) = (of(&smoothed, linear.width()), of(&expected, width));
            // Of single samples the textbook's inverses, which are near singular, are less exact.
            let mean = |sum: f64| (sum / linear.len as f64).sqrt();
            let size = mean(expected.iter().map(|v| v * v).sum()).max(1e-9);
            let off = mean(own.iter().zip(&expected).map(|(a, b)| (a - b).powi(2)).sum());
            assert!(off < 1e-3 * size, "state {c}: {off} of {size}");
        }
        // Rows of it are found beside noise with memory too.
        let (k, w) = (linear.len / 2, linear.states + randomness.processes());
        let own = &super::covariances(linear, &randomness, [k])[0];
        for (r, c) in (0..width).flat_map(|r| (0..width).map(move |c| (r, c))) {
            let (own, expected) = (own[r * w + c], covariances[k][(r, c)]);
            let size = (covariances[k][(r, r)] * covariances[k][(c, c)]).sqrt();
            assert!((own - expected).abs() <= 1e-3 * size, "{r}, {c}: {own} {expected}");
        }
    }
}

/// What a signature adds to the innovations is what the filter makes of data with it minus what it makes of data
/// without.
#[test]
fn whitening_is_the_difference_of_two_runs_of_the_filter() {
    let trials = [record(&[], 6.0, 4)];
    let fit = fitted(&[], &trials);
    let plain = crate::filter::estimate::for_trial(&fit.randomness, &trials[0]);
    let memory = Memory { channel: 1, deviation: 3e-3, time: 0.5, drift: false };
    let randomness = Randomness { input: 40.0, jitter: 3e-3, ..plain }.with_memory(memory);
    whitening_is_that_difference(&fit.linear(&trials)[0], &randomness);
    let expected = Some(with_memory(0.05, 0.02));
    let expected = Randomness { expected, ..randomness };
    whitening_is_that_difference(&fit.linear(&trials)[0], &expected);
    whitening_is_that_difference(&fit.linear(&trials)[0], &Randomness { force: 5.0, winch: 8.0, ..expected });
}

fn whitening_is_that_difference(linear: &LinearTrial, randomness: &Randomness) {
    let (n, m) = (linear.states, linear.channels);
    let sensor: Vec<f32> = (0..linear.len * m).map(|at| 1e-3 * (0.1 * at as f32).sin()).collect();
    let step: Vec<f32> = (0..(linear.len - 1) * n).map(|at| 1e-4 * (0.03 * at as f32).cos()).collect();
    let mut moved = linear.clone();
    moved.residual.iter_mut().zip(&sensor).for_each(|(slot, value)| *slot += f64::from(*value));
    moved.defect.iter_mut().zip(&step).for_each(|(slot, value)| *slot -= f64::from(*value));
    let [before, after] = [linear, &moved].map(|linear| filter(linear, randomness, Keep::Innovations));
    let forcing = crate::filter::whiten::Forcing { first: 0, columns: 1, step, sensor };
    crate::filter::whiten::whitened_rows(linear, randomness, &forcing, |at, innovation, e| {
        assert_eq!(innovation, before.whitened[at], "interrupted or not");
        let difference = after.whitened[at] - before.whitened[at];
        assert!((difference - e[0]).abs() < 1e-5 * (1.0 + e[0].abs()), "{at}: {difference} {}", e[0]);
    });
}

//! What free runs would have the parameters be, and standard errors that allow for it.
//!
//! The likelihood looks one sample ahead, the gap some seconds. By the right law both ask for the same parameters; by another
//! one they do not, and neither is right (J. A. Hausman, Specification tests in econometrics, Econometrica 46 (1978), 1251).
//! So where free runs leave more than noise, a parameter is as uncertain as it is from one to the other.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::estimate::{Fit, for_trial};
use crate::filter::whiten::Normal;
use crate::hypothesis::parameter::Free;
use crate::hypothesis::signature::Varied;
use crate::hypothesis::survey::regularise;
use crate::verdict::by_block::Column;
use crate::verdict::gap::{Known, Prediction, predict_by};
use crate::weigh::proposal::varied_by;
use crate::weigh::solve::solve;

/// Standard errors of parameters, wider where free runs over one of the `horizons` (s) ask for others than the likelihood
/// does, by more than their own error. Clocks keep theirs.
pub(crate) fn widened(fit: &Fit, trials: &[Trial], errors: &[(Column, f64)], horizons: &[f64]) -> Vec<(Column, f64)> {
    let mut out = errors.to_vec();
    let moved = errors.iter().enumerate().filter_map(|(at, (column, error))| match column {
        // By its error: over less, the turn of friction has no slope that free runs see.
        Column::Parameter(free) if error.is_finite() && *error > 0.0 => {
            Some((at, *free, varied_by(&fit.model, *free, *error)?))
        }
        Column::Parameter(_) | Column::Expression(_) | Column::Clock(_) => None,
    });
    let moved: Vec<(usize, Free, Varied)> = moved.collect();
    if horizons.is_empty() || moved.is_empty() {
        return out;
    }
    let known = Known::of(fit, trials);
    for horizon in horizons {
        for ((at, ..), apart) in moved.iter().zip(apart(fit, trials, &moved, *horizon, &known)) {
            out[*at].1 = out[*at].1.max(errors[*at].1.hypot(apart));
        }
    }
    out
}

/// How far from the parameters as they are those are which free runs ask for, to first order, beyond the error of that: by how
/// it differs from one run to the next.
fn apart(fit: &Fit, trials: &[Trial], moved: &[(usize, Free, Varied)], horizon: f64, known: &[Known]) -> Vec<f64> {
    let predicted = |examined| predict_by(fit, examined, trials, horizon, known);
    let shown = predicted(&fit.examined);
    let shown_by: Vec<Vec<Prediction>> = moved.par_iter().map(|(.., varied)| predicted(&varied.examined)).collect();
    let runs: Vec<Normal> = (0..trials.len())
        .flat_map(|t| {
            let slopes: Vec<(&Prediction, f64)> =
                shown_by.iter().zip(moved).map(|(shown, (.., varied))| (&shown[t], varied.size)).collect();
            of_runs(fit, &trials[t], &shown[t], &slopes)
        })
        .collect();
    let columns = moved.len();
    let whole = runs.iter().fold(Normal::empty(columns), |mut sum, run| {
        sum.add(run);
        sum
    });
    let spare = runs.iter().filter(|run| run.count > 0).count() as f64 - columns as f64;
    if spare < 1.0 {
        return vec![0.0; columns];
    }
    // In units of what the runs leave.
    let left = whole.total / whole.count as f64;
    let scaled = |normal: &Normal| Normal {
        gram: normal.gram.iter().map(|entry| entry / left).collect(),
        right: normal.right.iter().map(|entry| entry / left).collect(),
        ..normal.clone()
    };
    let mut normal = scaled(&whole);
    regularise(&mut normal, &fit.model, moved.iter().map(|(_, free, _)| Some(*free)));
    let (step, covariance) = solve(&normal);
    let told = |column: &usize| covariance[(*column, *column)].is_finite();
    let told: Vec<usize> = (0..columns).filter(told).collect();
    let inverse = DMatrix::from_fn(told.len(), told.len(), |r, c| covariance[(told[r], told[c])]);
    let scatter = runs.iter().map(scaled).fold(DMatrix::zeros(told.len(), told.len()), |sum, run| {
        let slope = DVector::from_fn(told.len(), |r, _| {
            let row = &run.gram[told[r] * columns..(told[r] + 1) * columns];
            run.right[told[r]] - row.iter().zip(&step).map(|(entry, step)| entry * step).sum::<f64>()
        });
        sum + &slope * slope.transpose()
    });
    let variance = &inverse * scatter * &inverse * ((spare + columns as f64) / spare);
    let beyond = |column: usize| {
        let at = told.iter().position(|told| *told == column)?;
        Some((step[column].powi(2) - variance[(at, at)]).max(0.0).sqrt())
    };
    (0..columns).map(|column| beyond(column).unwrap_or(0.0)).collect()
}

/// The normal equations of what free runs leave, run by run, on their slopes: what they show with each parameter moved, and how
/// far it was.
fn of_runs(fit: &Fit, trial: &Trial, shown: &Prediction, slopes: &[(&Prediction, f64)]) -> Vec<Normal> {
    let noise = for_trial(&fit.randomness, trial).noise;
    let mut runs = vec![Normal::empty(slopes.len()); shown.restarts.len()];
    for k in (0..trial.len()).filter(|k| !shown.is_restart(*k)) {
        let Some(run) = shown.restarts.partition_point(|restart| *restart < k).checked_sub(1) else { continue };
        for (j, noise) in noise.iter().enumerate() {
            let left = (trial.measured[k][j] - shown.shown[k][j]) / noise;
            let slope = |(by, size): &(&Prediction, f64)| (by.shown[k][j] - shown.shown[k][j]) / (size * noise);
            let row: Vec<f64> = slopes.iter().map(slope).collect();
            if left.is_finite() && row.iter().all(|slope| slope.is_finite()) {
                runs[run].push(&row, left);
                (runs[run].total, runs[run].count) = (runs[run].total + left * left, runs[run].count + 1);
            }
        }
    }
    runs.iter_mut().for_each(Normal::mirror);
    runs
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;

    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::verdict::by_block::ByBlock;

    /// Drag in proportion to speed, fitted to recordings with this drag: its size, its error by the likelihood, and by free runs too.
    fn fitted_drag(hidden: EffectSpec) -> [f64; 3] {
        let trials = [record(std::slice::from_ref(&hidden), 60.0, 31), record(&[hidden], 60.0, 32)];
        let mut fit = fitted(&[EffectSpec::new("platform_linear_drag", None, &[60.0]).expect("an effect")], &trials);
        crate::weigh::refine::refine(&mut fit, &trials, 0, 10, None).expect("a fit");
        let errors = ByBlock::new(&fit, &trials, 0).standard_errors(&fit.model);
        let wider = widened(&fit, &trials, &errors, &[1.0, 5.0]);
        [fit.model.effects[0].values[0], errors[0].1, wider[0].1]
    }

    #[test]
    fn errors_are_wider_where_free_runs_ask_for_other_parameters() {
        let drag = |id: &str, size: f64| EffectSpec::new(id, None, &[size]).expect("an effect");
        let [size, error, wider] = fitted_drag(drag("platform_linear_drag", 60.0));
        assert!((size - 60.0).abs() < 3.0 * error && wider < 2.0 * error, "{size} {error} {wider}");
        // Another law than the one fitted.
        let [size, error, wider] = fitted_drag(drag("platform_quadratic_drag", 200.0));
        assert!(wider > 2.0 * error, "{size} {error} {wider}");
    }
}

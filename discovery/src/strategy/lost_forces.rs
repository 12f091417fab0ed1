//! Winch forces that were recorded and did not act: readings that a logger lost.

use cdpr::model_file::Model;

use crate::data::Trial;
use crate::data::lost_forces::with_forces_between;
use crate::filter::error::FitError;
use crate::journal::Journal;
use crate::strategy::begin::begun_by_data;
use crate::strategy::fitted::Evidence;
use crate::weigh::criterion::EVIDENCE;

/// The recordings with straight lines where recorded forces jump away and back, if the model makes them likelier so: then the plant felt
/// nothing of these jumps. With a remark.
pub(crate) fn without_lost_forces(evidence: &Evidence, model: &Model) -> Option<(Evidence, String)> {
    let all: Vec<Trial> = evidence.train.iter().chain(&evidence.holdout).cloned().collect();
    let (filled, counts): (Vec<Trial>, Vec<Vec<usize>>) = all.iter().map(with_forces_between).unzip();
    let by_winch: Vec<usize> =
        (0..model.parameters.cables()).map(|winch| counts.iter().map(|of_trial| of_trial[winch]).sum()).collect();
    if by_winch.iter().all(|count| *count == 0) {
        return None;
    }
    let value = |trials: &[Trial]| -> Result<f64, FitError> {
        let together = Evidence::new(trials.to_vec(), Vec::new(), evidence.noise.clone());
        // The search says itself what does not go with the data.
        let fit = begun_by_data(&together, model, &Journal::default())?;
        Ok(fit.minus_two_log_likelihood(trials, &fit.randomness))
    };
    // What goes with no trajectory is no more likely than anything.
    let likely = |trials: &[Trial]| value(trials).unwrap_or(f64::INFINITY);
    if likely(&filled) >= likely(&all) - EVIDENCE {
        return None;
    }
    let rows: usize = all.iter().map(Trial::len).sum();
    let winches: Vec<String> = (1..)
        .zip(&by_winch)
        .filter(|(_, count)| **count > 0)
        .map(|(winch, count)| format!("{winch} in {count} row{}", if *count == 1 { "" } else { "s" }))
        .collect();
    let mut filled = filled.into_iter();
    let train = filled.by_ref().take(evidence.train.len()).collect();
    let lost = Evidence { train, holdout: filled.collect(), ..evidence.clone() };
    let remark = format!(
        "Of {rows} rows the recorded force jumps away and back, and the plant felt nothing of it: of winch {}. There it counts as not recorded, \
         and is taken to go straight from the reading before to the one after.",
        winches.join(", of winch ")
    );
    Some((lost, remark))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::{noise, record};
    use crate::filter::estimate::noise_of_data;

    /// Forces of 0 in single rows of a log were named a limit of that winch's force; pulses that a winch gave were none.
    #[test]
    fn forces_that_the_plant_did_not_feel_were_not_there() {
        let [train, holdout] = [record(&[], 40.0, 4), record(&[], 30.0, 5)];
        let noise = noise_of_data(&[train.clone(), holdout.clone()]);
        let rows = [60, 61, 150, 220];
        let away = |trial: &Trial| {
            let mut trial = trial.clone();
            rows.iter().for_each(|k| trial.inputs[*k].winch_force[1] = 0.0);
            trial
        };
        let lost = |train: Trial, holdout: Trial| {
            let evidence = Evidence::new(vec![train], vec![holdout], noise.clone());
            without_lost_forces(&evidence, &Model::default())
        };
        assert!(lost(train.clone(), holdout.clone()).is_none());
        // Also where only what is held out has them.
        for (train, holdout) in [(away(&train), holdout.clone()), (train.clone(), away(&holdout))] {
            let (evidence, remark) = lost(train, holdout).expect("forces that were lost");
            let least = evidence.train.iter().chain(&evidence.holdout).flat_map(|trial| &trial.inputs);
            assert!(least.map(|inputs| inputs.winch_force[1]).fold(f64::INFINITY, f64::min) > 1e3);
            assert!(remark.contains("of winch 2 in 4 rows"), "{remark}");
        }
    }

    #[test]
    fn pulses_that_a_winch_gave_stay() {
        let mut trial = record(&[], 20.0, 4);
        let mut model = Model::default();
        model.start.inputs = trial.inputs[0];
        let mut simulation = model.simulation().expect("a robot");
        let white: Vec<f64> = noise(7 * trial.len(), 9).collect();
        for k in 0..trial.len() {
            simulation.advance_to(trial.time[k]).expect("a motion");
            let shown = simulation.outputs();
            let values = shown.pose.iter().chain(&shown.unstretched_length);
            let sizes = [0.005, 0.005, 5e-5, 0.002, 0.002, 0.002, 0.002];
            let noise = white[7 * k..].iter().zip(sizes).map(|(white, size)| size * white);
            trial.measured[k] = values.zip(noise).map(|(value, noise)| value + noise).collect();
            if k % 40 == 30 {
                trial.inputs[k].winch_force[1] = 12e3;
            }
            simulation.set_inputs(trial.inputs[k]);
        }
        assert!(with_forces_between(&trial).1[1] > 0);
        let noise = noise_of_data(std::slice::from_ref(&trial));
        let evidence = Evidence::new(vec![trial], Vec::new(), noise);
        assert!(without_lost_forces(&evidence, &Model::default()).is_none());
    }
}

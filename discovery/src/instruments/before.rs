//! Winch forces as they were before a recorder made them late and smooth.

use crate::data::clean::median;
use crate::data::{Recorder, Trial};
use crate::model::delayed::earlier;

impl Trial {
    /// The same with the winch forces as they were before they were recorded so.
    pub(crate) fn with_forces_before(&self, recorder: Recorder) -> Self {
        let mut before = self.clone();
        for winch in 0..self.cables() {
            let recorded: Vec<f64> = self.inputs.iter().map(|inputs| inputs.winch_force[winch]).collect();
            let forces = before.inputs.iter_mut().map(|inputs| &mut inputs.winch_force[winch]);
            forces.zip(undone(recorder, &self.time, &recorded)).for_each(|(force, undone)| *force = undone);
        }
        for series in &mut before.taken_off {
            *series = undone(recorder, &self.time, series);
        }
        before
    }
}

/// A series as it was before it was recorded so: by a filter of first order that has this variance, from sample to sample, and for the
/// rest of the delay by a later one.
fn undone(recorder: Recorder, time: &[f64], series: &[f64]) -> Vec<f64> {
    let interval = median(time.windows(2).map(|pair| pair[1] - pair[0]).collect());
    // From sample to sample a filter of this delay has the variance `delay * (delay + interval)`.
    let filter = 0.5 * ((interval * interval + 4.0 * recorder.variance).sqrt() - interval);
    let mut sharp = series.to_vec();
    if recorder.variance > 0.0 {
        let constant = interval / ((filter + interval) / filter).ln();
        for k in 1..series.len() {
            let decay = (-(time[k] - time[k - 1]) / constant).exp();
            sharp[k] = (series[k] - decay * series[k - 1]) / (1.0 - decay);
        }
    }
    earlier(time, &sharp, filter - recorder.delay)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::recording::record;

    /// Late by two samples and a half, and behind a filter as well; ends are what they can be.
    #[test]
    fn forces_are_what_they_were_before_they_were_recorded() {
        let trial = record(&[], 40.0, 5);
        let interval = trial.interval();
        let force = |trial: &Trial, k: usize| trial.inputs[k].winch_force[2];
        for (decay, late) in [(0.0, 2.5), (0.6, 0.0), (0.6, 1.0)] {
            let mut recorded = trial.clone();
            let series: Vec<f64> = (0..trial.len()).map(|k| force(&trial, k)).collect();
            let mut filtered = series.clone();
            (1..series.len()).for_each(|k| filtered[k] = decay * filtered[k - 1] + (1.0 - decay) * series[k]);
            let shown = earlier(&trial.time, &filtered, late * interval);
            recorded.inputs.iter_mut().zip(shown).for_each(|(inputs, force)| inputs.winch_force[2] = force);
            let filter = interval * decay / (1.0 - decay);
            let recorder = Recorder { delay: late * interval + filter, variance: filter * (filter + interval) };
            let found = recorded.with_forces_before(recorder);
            let moved = series.iter().fold(0.0_f64, |most, force| most.max((force - series[0]).abs()));
            for k in 10..trial.len() - 10 {
                let off = (force(&found, k) - force(&trial, k)).abs();
                assert!(off < 2e-3 * moved, "{decay} {late} {k}: {off} of {moved}");
            }
        }
    }
}

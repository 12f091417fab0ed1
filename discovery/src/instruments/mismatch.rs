//! By how much the measured pose and the measured lengths disagree, by kinematics alone, and what of it no force can do.

use crate::data::clean::white_noise;
use crate::data::{Channel, Trial};
use crate::model::examined::Examined;

/// Standard deviation of the force that a disagreement would ask for, as a share of what the cable carries, from which no force
/// explains it: three times of it are all that there is, and the cable would be slack that was not.
pub(super) const NO_FORCE: f64 = 1.0 / 3.0;
/// Share of its variance that noise with memory has forgotten after its time constant: `1 - 1/e`.
const FORGOTTEN: f64 = 0.632;

/// Lengths of one cable (m), a sample each; `NAN` where they are not known.
pub(super) struct Lengths {
    /// By the measured pose, as it is shown when it is late.
    pub(super) of_pose: Vec<f64>,
    /// That less the measured one, stretched by the recorded force.
    pub(super) mismatch: Vec<f64>,
}

impl Lengths {
    /// Of a pose that is `late` by so much (s) against the lengths.
    pub(super) fn of(model: &Examined, trial: &Trial, cable: usize, late: f64) -> Self {
        let shown: Vec<f64> = (0..trial.len()).map(|k| length_of_pose(model, trial, k, cable)).collect();
        let of_pose: Vec<f64> = trial.time.iter().map(|time| at(&trial.time, &shown, time + late)).collect();
        let measured = |k: usize| {
            let shown = |wanted: Channel| value(trial, k, wanted);
            model.lengths(shown, &trial.inputs[k])[cable].unwrap_or(f64::NAN)
        };
        let mismatch = of_pose.iter().enumerate().map(|(k, length)| length - measured(k)).collect();
        Self { of_pose, mismatch }
    }
}

/// Stiffness (N/m) of a cable of these lengths (m).
pub(super) fn stiffness(model: &Examined, lengths: &[f64], cable: usize) -> f64 {
    let elastic = model.plant.unstretched_index(cable).is_some();
    let some = lengths.iter().copied().find(|length| length.is_finite()).unwrap_or(f64::INFINITY);
    if elastic { model.plant.data().cables[cable].axial_stiffness / some } else { f64::INFINITY }
}

/// An error of the instruments that does not change at once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wander {
    /// Its standard deviation (m).
    pub(crate) deviation: f64,
    /// The time (s) after which it is another one.
    pub(crate) time: f64,
}

/// By how much a pose that is `late` by so much (s) against the lengths and these wander against each other, beside what is constant and
/// what is white, where no force can do that.
pub(super) fn wander(model: &Examined, trials: &[Trial], late: f64) -> Option<Wander> {
    let mut most: Option<Wander> = None;
    let mut beyond_forces = false;
    for trial in trials {
        for cable in 0..trial.cables() {
            let Lengths { of_pose, mismatch } = Lengths::of(model, trial, cable, late);
            let Some(wander) = wander_of(&trial.time, &mismatch) else { continue };
            let carried =
                trial.inputs.iter().map(|inputs| inputs.winch_force[cable].abs()).sum::<f64>() / trial.len() as f64;
            // Cables that do not stretch are left to the search.
            let force = stiffness(model, &of_pose, cable) * wander.deviation;
            beyond_forces |= force.is_finite() && force > NO_FORCE * carried;
            if most.is_none_or(|most| most.deviation < wander.deviation) {
                most = Some(wander);
            }
        }
    }
    most.filter(|_| beyond_forces)
}

/// What of a signal is neither constant nor white; none where that is nothing.
fn wander_of(time: &[f64], signal: &[f64]) -> Option<Wander> {
    let known: Vec<(f64, f64)> =
        time.iter().copied().zip(signal.iter().copied()).filter(|(_, value)| value.is_finite()).collect();
    let count = known.len() as f64;
    let mean = known.iter().map(|(_, value)| value).sum::<f64>() / count;
    let square = known.iter().map(|(_, value)| (value - mean).powi(2)).sum::<f64>() / count;
    let (times, values): (Vec<f64>, Vec<f64>) = known.into_iter().unzip();
    let variance = square - white_noise(&times, &values).powi(2);
    if variance.is_nan() || variance <= 0.0 {
        return None;
    }
    // Half the mean square of a difference is what was forgotten in that time, beside what is white.
    let forgotten = |lag: usize| {
        let differences = values.iter().zip(&values[lag..]).map(|(a, b)| (b - a).powi(2));
        0.5 * differences.sum::<f64>() / (values.len() - lag) as f64 - (square - variance)
    };
    let mut lags = (0..).map(|k| 1 << k).take_while(|lag| 2 * lag < values.len());
    let lag = lags.find(|lag| forgotten(*lag) > FORGOTTEN * variance).unwrap_or(values.len() / 2);
    let interval = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
    Some(Wander { deviation: variance.sqrt(), time: lag as f64 * interval })
}

/// A signal at a time, linear between samples; `NAN` outside of them.
fn at(time: &[f64], signal: &[f64], wanted: f64) -> f64 {
    let after = time.partition_point(|t| *t < wanted);
    match (after.checked_sub(1), time.get(after)) {
        (_, Some(t)) if *t == wanted => signal[after],
        (Some(before), Some(t)) => {
            let share = (wanted - time[before]) / (t - time[before]);
            (1.0 - share) * signal[before] + share * signal[after]
        }
        _ => f64::NAN,
    }
}

/// What a channel shows at sample `k`.
fn value(trial: &Trial, k: usize, wanted: Channel) -> Option<f64> {
    let j = trial.channels.iter().position(|c| *c == wanted)?;
    Some(trial.measured[k][j]).filter(|value| value.is_finite())
}

/// Length of a cable (m) at the measured pose; `NAN` where that is not measured.
fn length_of_pose(model: &Examined, trial: &Trial, k: usize, cable: usize) -> f64 {
    let pose: [f64; 3] = std::array::from_fn(|axis| value(trial, k, Channel::Pose(axis)).unwrap_or(f64::NAN));
    cdpr::kinematics::cable_lengths(model.plant.geometry(), &pose)[cable]
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, noise, record_on};

    /// A recording whose x wanders by so much (m), forgetting in a tenth of a second; cables that are oblique show two thirds of it.
    fn wandering(bench: &Bench, deviation: f64) -> Option<Wander> {
        let mut trial = record_on(bench, &[], 40.0, 4);
        let kept = (-trial.interval() / 0.1).exp();
        let mut error = 0.0;
        for (row, white) in trial.measured.iter_mut().zip(noise(trial.time.len(), 7)) {
            error = kept * error + (1.0 - kept * kept).sqrt() * deviation * white;
            row[0] += error;
        }
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        wander(&Examined::new(&model).unwrap(), &[trial], 0.0)
    }

    #[test]
    fn a_pose_that_wanders_where_no_force_can_is_seen_by_kinematics() {
        let bench = Bench::laboratory();
        let Wander { deviation, time } = wandering(&bench, 5e-3).expect("a wander");
        assert!((3e-3..4.5e-3).contains(&deviation) && (0.05..0.3).contains(&time), "{deviation} {time}");
        assert!(wandering(&bench, 0.0).is_none());
        // A small force moves a soft robot as far.
        assert!(wandering(&Bench::large(), 0.02).is_none());
    }

    /// A late pose of a small robot was taken for noise with memory, beside which a wind stood for a gain.
    #[test]
    fn a_pose_that_is_late_does_not_wander() {
        let bench = Bench::laboratory();
        let mut trial = record_on(&bench, &[], 20.0, 4);
        let then = trial.measured.clone();
        for (k, row) in trial.measured.iter_mut().enumerate() {
            row[..3].copy_from_slice(&then[k.saturating_sub(3)][..3]);
        }
        let model = Model { parameters: bench.parameters.clone(), ..Model::default() };
        let examined = Examined::new(&model).unwrap();
        let late = 3.0 * trial.interval();
        let [in_time, late] = [0.0, late].map(|late| wander(&examined, std::slice::from_ref(&trial), late));
        assert!(in_time.is_some() && late.is_none(), "{in_time:?} {late:?}");
    }

    #[test]
    fn a_signal_is_linear_between_its_samples() {
        let (time, signal) = ([0.0, 1.0, 3.0], [2.0, 4.0, 0.0]);
        assert_eq!([0.0, 0.5, 1.0, 2.5, 3.0].map(|t| at(&time, &signal, t)), [2.0, 3.0, 4.0, 1.0, 0.0]);
        assert!([-0.1, 3.1].iter().all(|t| at(&time, &signal, *t).is_nan()));
    }
}

//! Recordings as values at a few instants: noise averaged, channels and inputs at the same times.

use cdpr::dynamics::Inputs;

use crate::data::Trial;

/// Instants on each side of a window's middle.
pub(super) const SIDE: usize = 8;
/// Time between instants (s), where the sampling allows it: well below the periods in which a platform is moved.
const STEP: f64 = 0.25;
/// Most windows of a recording: enough to see what holds throughout.
const MOST_WINDOWS: usize = 24;

/// What a recording says at one time.
#[derive(Clone, Debug)]
pub(super) struct Instant {
    pub(super) time: f64,
    /// Means over one step around it.
    pub(super) inputs: Inputs,
    /// Channels in the trial's order, by a straight line through the samples around it; `NAN` where there are too few.
    pub(super) shown: Vec<f64>,
}

/// Instants at equal distances.
#[derive(Clone, Debug)]
pub(super) struct Window {
    /// Time between them (s).
    pub(super) step: f64,
    pub(super) instants: Vec<Instant>,
}

/// Windows spread over a trial, those in which every channel says something throughout if there are any.
pub(super) fn windows(trial: &Trial) -> Vec<Window> {
    let (first, last) = (trial.time[0], trial.time[trial.len() - 1]);
    let intervals = 2 * SIDE;
    let step = STEP.max(trial.interval()).min((last - first) / intervals as f64);
    let length = step * intervals as f64;
    let count = (((last - first) / length) as usize).clamp(1, MOST_WINDOWS);
    let reach: Vec<f64> =
        (0..trial.channels.len()).map(|j| step.max(1.6 * trial.stride(j) as f64 * trial.interval())).collect();
    let room = last - first - length;
    let all: Vec<Window> = (0..count)
        .map(|w| {
            let begin = first + room * if count > 1 { w as f64 / (count - 1) as f64 } else { 0.5 };
            let instant = |k: usize| {
                let time = begin + step * k as f64;
                let shown = reach.iter().enumerate().map(|(j, reach)| value_at(trial, j, time, *reach)).collect();
                Instant { time, inputs: mean_inputs(trial, time, step), shown }
            };
            Window { step, instants: (0..=intervals).map(instant).collect() }
        })
        .collect();
    let whole = |window: &&Window| window.instants.iter().flat_map(|i| &i.shown).all(|v| v.is_finite());
    let full: Vec<Window> = all.iter().filter(whole).cloned().collect();
    if full.is_empty() { all } else { full }
}

/// The value of a straight line through the samples of channel `j` within `reach` (s) of a time.
fn value_at(trial: &Trial, j: usize, time: f64, reach: f64) -> f64 {
    let begin = trial.time.partition_point(|t| *t < time - reach);
    let (mut s, mut st, mut stt, mut sv, mut stv) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for k in (begin..trial.len()).take_while(|k| trial.time[*k] <= time + reach) {
        let v = trial.measured[k][j];
        if v.is_finite() {
            let t = (trial.time[k] - time) / reach;
            s += 1.0;
            st += t;
            stt += t * t;
            sv += v;
            stv += t * v;
        }
    }
    let determinant: f64 = s * stt - st * st;
    if determinant > 1e-3 { (stt * sv - st * stv) / determinant } else { f64::NAN }
}

/// The mean of the inputs, held from row to row, over `step` (s) around a time.
fn mean_inputs(trial: &Trial, time: f64, step: f64) -> Inputs {
    let (begin, end) = (time - 0.5 * step, time + 0.5 * step);
    let first = trial.time.partition_point(|t| *t <= begin).saturating_sub(1);
    let (mut sum, mut total) = (Inputs::none(trial.inputs[first].winch_force.len()), 0.0);
    for k in (first..trial.len()).take_while(|k| *k == first || trial.time[*k] < end) {
        let until = trial.time.get(k + 1).copied().unwrap_or(f64::INFINITY).min(end);
        let weight = (until - trial.time[k].max(begin)).max(1e-9 * step);
        total += weight;
        for (s, v) in sum.winch_force.iter_mut().zip(trial.inputs[k].winch_force) {
            *s += weight * v;
        }
        for (s, v) in sum.disturbance.iter_mut().zip(trial.inputs[k].disturbance) {
            *s += weight * v;
        }
    }
    sum.winch_force.iter_mut().chain(&mut sum.disturbance).for_each(|v| *v /= total);
    sum
}

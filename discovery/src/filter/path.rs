//! A trajectory of states and latent disturbances, and the model linearised along it.

use std::sync::Arc;

use cdpr::dynamics::{Evaluation, Inputs};
use cdpr::per_cable::PerCable;
use rayon::prelude::*;

use crate::data::Trial;
use crate::filter::error::FitError;
use crate::filter::prior::Prior;
use crate::filter::sensor_slopes::{SensorSlopes, Slopes};
use crate::filter::variation::{Step, Variation};
use crate::filter::vector::padded;
use crate::filter::within::{Turning, Within};
use crate::hypothesis::facts::facts;
use crate::model::delayed::{Clock, at_instants, rates};
use crate::model::examined::{Examined, Moment, disturb};
use crate::model::state_size::effect_state_scale;

/// States and latents at every sample of a trial.
#[derive(Clone, Debug)]
pub(crate) struct Trajectory {
    /// Plant states, then latents; `width` numbers a sample.
    pub(crate) values: Vec<f64>,
    pub(crate) width: usize,
    /// Plant states of a sample.
    pub(crate) states: usize,
}

impl Trajectory {
    pub(crate) fn row(&self, k: usize) -> &[f64] {
        &self.values[k * self.width..(k + 1) * self.width]
    }

    pub(crate) fn states(&self, k: usize) -> &[f64] {
        &self.row(k)[..self.states]
    }

    pub(crate) fn latents(&self, k: usize) -> &[f64] {
        &self.row(k)[self.states..]
    }
}

/// The model of one trial as a linear one in the deviation from a trajectory.
#[derive(Clone, Debug)]
pub(crate) struct LinearTrial {
    /// Samples.
    pub(crate) len: usize,
    /// Plant states.
    pub(crate) states: usize,
    /// Latent disturbances.
    pub(crate) disturbances: usize,
    /// Channels.
    pub(crate) channels: usize,
    /// Sampling intervals (s), one less than samples.
    pub(crate) interval: Vec<f64>,
    /// States with zeros up to a width for which there is code.
    pub(crate) padded: usize,
    /// `∂x(k+1)/∂(x, latents)(k)` less one on its diagonal: `padded` numbers for each state or latent, what it does to the
    /// states. As short numbers: what they leave out is ten millions times smaller than a step's change of a deviation, and
    /// acts on deviations alone, which are none where a trajectory has settled. It is most of a linear model, and shared by
    /// those whose steps only end elsewhere.
    transition: Arc<Vec<f32>>,
    /// Where one step of the model misses the trajectory's next point, `states` a step.
    pub(crate) defect: Vec<f64>,
    /// Where the integrator has stopped within the steps.
    pub(crate) within: Within,
    /// Latents of the trajectory, `disturbances` a sample.
    latents: Vec<f64>,
    /// The states that each channel shows anything of.
    shows: Vec<Vec<usize>>,
    /// `∂h/∂x` of these, channel after channel, and where those of each channel begin among those of a sample.
    slopes: Vec<f64>,
    first_slope: Vec<usize>,
    /// What the sensors would show on the trajectory, `channels` a sample.
    pub(crate) shown: Vec<f64>,
    /// How fast what is measured changes along the trajectory (per s).
    pub(crate) rate: Vec<f64>,
    /// Measured minus what is shown then; `NAN` is a gap. What a late channel shows stands where it was so, not at its stamp.
    pub(crate) residual: Vec<f64>,
    /// Measurements of each channel that show what was before the first sample, or after the last.
    pub(crate) outside: Vec<usize>,
    /// Inputs as the plant feels them, and slack cables, at each sample.
    pub(crate) felt: Vec<Inputs>,
    pub(crate) slack: Vec<PerCable<bool>>,
    pub(crate) prior: Prior,
    /// Sizes of the states.
    scale: Vec<f64>,
}

impl LinearTrial {
    pub(crate) fn width(&self) -> usize {
        self.states + self.disturbances
    }

    /// What it takes of memory.
    pub(crate) fn bytes(&self) -> usize {
        let doubles =
            [&self.interval, &self.defect, &self.latents, &self.slopes, &self.shown, &self.rate, &self.residual];
        size_of_val(&self.transition[..])
            + doubles.map(|values| size_of_val(&values[..])).iter().sum::<usize>()
            + size_of_val(&self.felt[..])
            + size_of_val(&self.slack[..])
            + self.within.bytes()
    }

    /// Latents of the trajectory at sample `k`.
    pub(crate) fn latents(&self, k: usize) -> &[f64] {
        &self.latents[k * self.disturbances..(k + 1) * self.disturbances]
    }

    /// What state or latent `c` does to the states in step `k`.
    #[inline(always)]
    pub(crate) fn column(&self, k: usize, c: usize) -> impl Iterator<Item = f64> {
        let at = (k * self.width() + c) * self.padded;
        let changes = self.transition[at..at + self.states].iter().enumerate();
        changes.map(move |(r, change)| f64::from(*change) + if r == c { 1.0 } else { 0.0 })
    }

    /// Writes what each state or latent does to the states in step `k`, with zeros up to the padded width.
    #[inline(always)]
    pub(crate) fn columns(&self, k: usize, out: &mut [f64]) {
        let of_step = self.width() * self.padded;
        for (slot, change) in out.iter_mut().zip(&self.transition[k * of_step..(k + 1) * of_step]) {
            *slot = f64::from(*change);
        }
        for slot in out.iter_mut().step_by(self.padded + 1).take(self.states) {
            *slot += 1.0;
        }
    }

    /// The states that channel `j` shows, with the slopes by which it does at sample `k`.
    #[inline(always)]
    pub(crate) fn shown_by(&self, k: usize, j: usize) -> impl Iterator<Item = (usize, f64)> + Clone {
        let at = k * self.slopes_of_sample() + self.first_slope[j];
        self.shows[j].iter().zip(&self.slopes[at..]).map(|(c, slope)| (*c, *slope))
    }

    fn slopes_of_sample(&self) -> usize {
        self.shows.iter().map(Vec::len).sum()
    }

    /// The same where the latents are what the trajectory has, and no part of a deviation.
    pub(crate) fn with_latents_given(&self) -> Self {
        Self { latents: vec![0.0; self.latents.len()], ..self.clone() }
    }

    /// Compares channel `j` with what was shown along the trajectory when it was so.
    fn delay(&mut self, trial: &Trial, j: usize, clock: Clock) {
        let m = self.channels;
        let column = |values: &[f64]| -> Vec<f64> { values.iter().skip(j).step_by(m).copied().collect() };
        let instants: Vec<Option<f64>> = (0..self.len).map(|k| clock.instant(&trial.time, k)).collect();
        let known = || instants.iter().flatten().copied();
        let mut shown = at_instants(&trial.time, &column(&self.shown), known()).into_iter();
        let mut rate = at_instants(&trial.time, &column(&self.rate), known()).into_iter();
        for (k, instant) in instants.iter().enumerate() {
            let measured = |_| Some(trial.measured[clock.row(k, self.len)?][j] - shown.next()?);
            self.residual[k * m + j] = instant.and_then(measured).unwrap_or(f64::NAN);
            if let Some(rate) = instant.and_then(|_| rate.next()) {
                self.rate[k * m + j] = rate;
            }
        }
        let finite = |rows: &mut dyn Iterator<Item = f64>| rows.filter(|value| value.is_finite()).count();
        let measured = finite(&mut trial.measured.iter().map(|row| row[j]));
        self.outside[j] = measured - finite(&mut column(&self.residual).into_iter());
    }

    /// Sum of all defects, each relative to the typical size of its state.
    pub(crate) fn total_defect(&self) -> f64 {
        let of_step = |step: &[f64]| step.iter().zip(&self.scale).map(|(d, size)| d.abs() / size).sum::<f64>();
        self.defect.chunks_exact(self.states).map(of_step).sum()
    }
}

/// Sizes of the states.
pub(super) fn scale(model: &Examined) -> Vec<f64> {
    let mut scale = vec![1.0; model.states()];
    scale[..6].copy_from_slice(&[1.0, 1.0, 0.1, 0.5, 0.5, 0.05]);
    for i in 0..model.plant.cables() {
        if let Some(at) = model.plant.unstretched_index(i) {
            scale[at] = 2.0;
        }
        if let Some(at) = model.plant.rate_index(i) {
            scale[at] = 0.5;
        }
        for at in model.plant.effect_states(i) {
            scale[at] = effect_state_scale(model, i, at);
        }
    }
    scale
}

/// Steps of the integrator (a sample, on average) from which a trajectory is taken for one that has run away.
const STEPS: u64 = 100;

/// Samples that are linearised one after the other, side by side with others.
const STRETCH: usize = 1000;

/// Linearises `model` along `trajectory`, each channel `late` (s) against its stamp by its clock, and by what the model says.
///
/// # Errors
/// When the model cannot be simulated from a point of the trajectory, or only in steps far smaller than a sample.
pub(crate) fn linearise(
    model: &Examined,
    trial: &Trial,
    trajectory: &Trajectory,
    first: &[f64],
    late: &[f64],
) -> Result<LinearTrial, FitError> {
    let (n, m, len) = (model.states(), trial.channels.len(), trial.len());
    let (disturbances, padded) = (model.latents(), padded(n));
    let width = n + disturbances;
    let late = late.iter().zip(&trial.channels).map(|(late, channel)| late + model.late(*channel));
    let clocks: Vec<Option<Clock>> =
        late.map(|late| (late != 0.0).then(|| Clock::new(late, trial.interval()))).collect();
    let mut linear = LinearTrial {
        len,
        states: n,
        disturbances,
        channels: m,
        interval: trial.time.windows(2).map(|w| w[1] - w[0]).collect(),
        padded,
        // One step more than there are, so that there is one for each sample.
        transition: Arc::default(),
        defect: vec![0.0; len * n],
        within: Within::default(),
        latents: (0..len).flat_map(|k| trajectory.latents(k).to_vec()).collect(),
        shows: Vec::new(),
        slopes: Vec::new(),
        first_slope: Vec::new(),
        shown: vec![0.0; len * m],
        rate: vec![0.0; len * m],
        residual: vec![0.0; len * m],
        outside: vec![0; m],
        felt: vec![Inputs::none(model.plant.cables()); len],
        slack: vec![PerCable::filled(model.plant.cables(), false); len],
        prior: Prior { mean: Vec::new(), covariance: Vec::new() },
        scale: scale(model),
    };
    let mut transition = vec![0.0; len * padded * width];
    // Behind a dead time is what was commanded before.
    let stretch = if has_dead_time(model) { len } else { STRETCH };
    let parts = (
        transition.par_chunks_mut(stretch * padded * width),
        linear.defect.par_chunks_mut(stretch * n),
        linear.shown.par_chunks_mut(stretch * m),
        linear.residual.par_chunks_mut(stretch * m),
        linear.felt.par_chunks_mut(stretch),
        linear.slack.par_chunks_mut(stretch),
    );
    let filled = parts.into_par_iter().enumerate().map(|(at, (transition, defect, shown, residual, felt, slack))| {
        let part = Part { first: at * stretch, transition, defect, shown, residual, felt, slack };
        part.fill(model, trial, trajectory, &clocks)
    });
    let (slopes, within): (_, Vec<Within>) = filled.collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
    let slopes = Slopes::joined(slopes);
    linear.within = Within::joined(within);
    linear.prior = Prior::new(model, trial, trajectory, first, &linear.felt[0], &linear.slack[0]);
    linear.rate = rates(&trial.time, &linear.shown, m);
    for (j, clock) in clocks.iter().enumerate() {
        clock.iter().for_each(|clock| linear.delay(trial, j, *clock));
    }
    transition.truncate((len - 1) * padded * width);
    linear.transition = Arc::new(transition);
    linear.defect.truncate((len - 1) * n);
    linear.first_slope = (0..m).map(|j| slopes.shows[..j].iter().map(Vec::len).sum()).collect();
    (linear.shows, linear.slopes) = (slopes.shows, slopes.values);
    Ok(linear)
}

fn has_dead_time(model: &Examined) -> bool {
    model.plant.effects().iter().any(|effect| facts(&effect.id).dead_time)
}

/// Some samples of a [`LinearTrial`], from `first` on.
struct Part<'a> {
    first: usize,
    transition: &'a mut [f32],
    defect: &'a mut [f64],
    shown: &'a mut [f64],
    residual: &'a mut [f64],
    felt: &'a mut [Inputs],
    slack: &'a mut [PerCable<bool>],
}

impl Part<'_> {
    /// Returns the slopes of what the sensors show: of a deviation those that are late show as much as it was by its velocity
    /// when they did.
    fn fill(
        self,
        model: &Examined,
        trial: &Trial,
        trajectory: &Trajectory,
        clocks: &[Option<Clock>],
    ) -> Result<(Slopes, Within), FitError> {
        let (n, m, len) = (model.states(), trial.channels.len(), self.felt.len());
        let mut simulation = model.simulation(trial, self.first, trajectory.states(self.first)).with_path();
        let (mut within, turning) = (Within::default(), Turning::of(model));
        let mut sensors = SensorSlopes::new(model, trial);
        let mut shown = Vec::new();
        let mut variation = Variation::new(model);
        let mut carries = vec![0.0; self.transition.len() / len];
        let steps = self.transition.chunks_exact_mut(self.transition.len() / len).zip(self.defect.chunks_exact_mut(n));
        let mut before: Option<Before> = None;
        let mut sensor = vec![0.0; len * m * n];
        let samples = sensor.chunks_exact_mut(m * n).zip(self.shown.chunks_exact_mut(m));
        let samples = samples.zip(self.residual.chunks_exact_mut(m)).zip(self.felt.iter_mut().zip(self.slack));
        for (at, ((transition, defect), (((slopes, all_shown), residual), (all_felt, all_slack)))) in
            steps.zip(samples).enumerate()
        {
            let k = self.first + at;
            let x = trajectory.states(k);
            simulation.nudge_states(x);
            disturb(&mut simulation, &trial.inputs[k], trajectory.latents(k));
            let (felt, slack) = (simulation.inputs_at_plant(), simulation.slack());
            let moment = Moment { time: trial.time[k], y: x, felt: &felt, slack };
            let e = model.measure_at(&simulation, &moment, &trial.channels, &mut shown);
            for ((slot, measured), shown) in residual.iter_mut().zip(&trial.measured[k]).zip(&shown) {
                *slot = measured - shown;
            }
            all_shown.copy_from_slice(&shown);
            (*all_felt, *all_slack) = (felt, slack);
            if !model.sensor_slopes(trial.time[k], &e, &trial.channels, slopes) {
                sensors.at(&simulation, &moment, &shown, slopes);
            }
            for (slopes, clock) in slopes.chunks_exact_mut(n).zip(clocks) {
                let Some(rest) = clock.map(|clock| clock.rest(&trial.time, k)) else { continue };
                let before = before.get_or_insert_with(|| {
                    let (time, interval) = (trial.time[k], trial.interval());
                    Before::of(
                        &mut Variation::new(model),
                        &Step { time, interval, from: x, to: x, felt, slack, within: &[] },
                    )
                });
                before.shown(&e, rest, slopes);
            }
            if k + 1 == trial.len() {
                break;
            }
            let interval = trial.time[k + 1] - trial.time[k];
            simulation.advance(interval).map_err(FitError::Simulation)?;
            let cost = simulation.statistics();
            if cost.steps + cost.rejections + cost.newton_failures > STEPS * (at as u64 + 10) {
                return Err(FitError::Diverged { trial: trial.name.clone(), time: trial.time[k] });
            }
            let next = simulation.states();
            for ((slot, next), aim) in defect.iter_mut().zip(next).zip(trajectory.states(k + 1)) {
                *slot = next - aim;
            }
            within.push(x, simulation.path(), &turning);
            let step = Step { time: trial.time[k], interval, from: x, to: next, felt, slack, within: within.step(at) };
            variation.transition(&step, &mut carries);
            // What stays is known.
            carries.iter_mut().step_by(padded(n) + 1).take(n).for_each(|stays| *stays -= 1.0);
            transition.iter_mut().zip(&carries).for_each(|(slot, value)| *slot = *value as f32);
        }
        Ok((Slopes::of(&sensor, m, n), within))
    }
}

/// How positions were a while before, by the rates that are.
struct Before {
    /// Positions by their own rates.
    own: Vec<(usize, usize)>,
    /// Lengths of cables that ring within an interval about their chords, with the cables: they were where the chord was.
    ringing: Vec<(usize, usize)>,
}

impl Before {
    /// By what rings at a step.
    fn of(variation: &mut Variation<'_>, step: &Step<'_>) -> Self {
        let mut before = Self { own: Vec::new(), ringing: Vec::new() };
        let (moving, ringing) = variation.ringing(step);
        for (moving, rings) in moving.iter().zip(ringing) {
            match moving.cable.filter(|_| rings.is_some()) {
                Some(cable) => before.ringing.push((moving.position, cable)),
                None => before.own.push((moving.position, moving.rate)),
            }
        }
        before
    }

    /// Has a channel that shows these slopes of a deviation show it as it was by so much (s) before.
    fn shown(&self, e: &Evaluation, rest: f64, slopes: &mut [f64]) {
        self.own.iter().for_each(|(position, rate)| slopes[*rate] -= rest * slopes[*position]);
        for (position, cable) in &self.ringing {
            let row = e.kinematics[*cable].jacobian_row();
            (0..3).for_each(|axis| slopes[3 + axis] -= rest * slopes[*position] * row[axis]);
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::effect::EffectSpec;
    use cdpr::model_file::Model;
    use cdpr::simulation::{Simulation, Start};

    use super::*;
    use crate::data::recording::{fitted, record};
    use crate::filter::variation::tests::ringing;

    /// Late by more than a sample, as an effect or by its clock: what is measured is compared with what was then.
    #[test]
    fn a_late_pose_is_compared_with_the_pose_of_then() {
        let delay = EffectSpec::new("pose_sensor_delay", None, &[0.13]).unwrap();
        let trials = [record(std::slice::from_ref(&delay), 40.0, 7)];
        let mut fit = fitted(&[delay], &trials);
        fit.settle(&trials, 10).unwrap();
        let linear = fit.linear(&trials);
        let (linear, m) = (&linear[0], linear[0].channels);
        assert_eq!(&linear.outside[..4], [1, 1, 1, 0]);
        let late: Vec<f64> = trials[0].channels.iter().map(|c| fit.examined.late(*c)).collect();
        let on_time = Examined::new(&Model::default()).unwrap();
        let by_clock = linearise(&on_time, &trials[0], &fit.trajectories[0], &fit.first[0], &late).unwrap();
        for (j, noise) in [2e-3, 2e-3, 5e-5, 2e-3].into_iter().enumerate() {
            let residuals = |linear: &LinearTrial| -> Vec<f64> {
                linear.residual.iter().skip(j).step_by(m).copied().filter(|v| v.is_finite()).collect()
            };
            let own = residuals(linear);
            let size = (own.iter().map(|v| v * v).sum::<f64>() / own.len() as f64).sqrt();
            assert!((0.8..1.2).contains(&(size / noise)), "channel {j}: {size}");
            assert_eq!(own, residuals(&by_clock), "channel {j}");
        }
    }

    /// One sample after the other at the tolerance in use, against one ten thousand times finer.
    #[test]
    fn steps_are_far_more_exact_than_measurements() {
        let friction = EffectSpec::new("winch_coulomb_friction", None, &[100.0, 0.01]).unwrap();
        let trials = [record(std::slice::from_ref(&friction), 20.0, 6)];
        let mut fit = fitted(&[friction], &trials);
        fit.settle(&trials, 10).unwrap();
        let linear = fit.linear(&trials);
        let (trial, trajectory, linear) = (&trials[0], &fit.trajectories[0], &linear[0]);
        let mut fine = Simulation::from_states(
            fit.examined.plant.clone(),
            trial.time[0],
            trajectory.states(0).to_vec(),
            trial.inputs[0],
            1e-10,
        );
        let n = linear.states;
        let mut sums = vec![0.0; n];
        for k in 0..trial.len() - 1 {
            fine.nudge_states(trajectory.states(k));
            disturb(&mut fine, &trial.inputs[k], trajectory.latents(k));
            fine.advance(linear.interval[k]).unwrap();
            for (c, sum) in sums.iter_mut().enumerate() {
                let defect = fine.states()[c] - trajectory.states(k + 1)[c];
                *sum += (defect - linear.defect[k * n + c]).abs();
            }
        }
        // All errors of 20 s together, without regard to their signs: metres or radians, and the same per second.
        for (c, sum) in sums.iter().enumerate() {
            assert!(*sum < 1e-4, "state {c}: {sum}");
        }
    }

    /// Its own rate says nothing of where a length that rings was two milliseconds before; the chord's does.
    #[test]
    fn a_length_that_rings_was_where_its_chord_was() {
        let (model, still) = ringing();
        let before = |model: &Examined, simulation: &Simulation| {
            let (from, felt, slack) = (simulation.states(), simulation.inputs(), simulation.slack());
            let step = Step { time: 0.0, interval: 0.01, from, to: from, felt, slack, within: &[] };
            Before::of(&mut Variation::new(model), &step)
        };
        let ringing = before(&model, &still);
        assert_eq!((ringing.own.len(), ringing.ringing.len()), (3, 4));
        let [at, rate] = [model.plant.unstretched_index(2), model.plant.rate_index(2)].map(Option::unwrap);
        let e = still.evaluate();
        let mut slopes = vec![0.0; model.states()];
        slopes[at] = 1.0;
        ringing.shown(&e, 2e-3, &mut slopes);
        let row = e.kinematics[2].jacobian_row();
        assert_eq!((slopes[3..6].to_vec(), slopes[rate]), (row.map(|slope| -2e-3 * slope).to_vec(), 0.0));
        // On a large robot cables swing slower than that.
        let large = Examined::new(&Model::default()).unwrap();
        let start = Start { inputs: Inputs::pulling(4, 2e4), ..Start::default() };
        let resting = before(&large, &Simulation::new(large.plant.clone(), &start, 1e-8).unwrap());
        assert_eq!((resting.own.len(), resting.ringing.len()), (7, 0));
    }

    #[test]
    fn states_have_the_size_of_their_effect_whatever_stands_before() {
        let effects = "[[effect]]\nid = 'cable_transverse_mode'\ncable = 2\nlinear_density = 0.2\n\
                       [[effect]]\nid = 'winch_lag'\ntime_constant = 0.1\n\
                       [[effect]]\nid = 'cable_creep'\naxial_stiffness = 1e8\ntime_constant = 10.0\n";
        let model = Examined::new(&Model::from_toml(effects).unwrap()).unwrap();
        for (cable, expected) in [(0, vec![1e3, 1e-3]), (1, vec![1.0, 1.0, 1e3, 1e-3])] {
            let sizes: Vec<f64> =
                model.plant.effect_states(cable).map(|at| effect_state_scale(&model, cable, at)).collect();
            assert_eq!(sizes, expected);
        }
    }
}

//! Signatures: what a variation of the model would add to the states at each step and to the sensors at each sample.

use std::ops::Range;

use cdpr::effect::{EffectKind, EffectSpec, Site, Stage};
use cdpr::simulation::Simulation;
use rayon::prelude::*;

use crate::data::{Channel, Trial};
use crate::filter::error::FitError;
use crate::filter::variation::{Step, Variation};
use crate::filter::whiten::Forcing;
use crate::hypothesis::along::Along;
use crate::hypothesis::beside::with_variation;
use crate::hypothesis::ends::Ends;
use crate::hypothesis::facts::{Told, facts};
use crate::hypothesis::late::LateForces;
use crate::model::examined::{Examined, Moment, disturb};

/// What one variation adds over some samples: `states` numbers a step, `channels` a sample.
pub(crate) struct Single {
    pub(crate) step: Vec<f32>,
    pub(crate) sensor: Vec<f32>,
}

impl Single {
    pub(crate) fn nothing(along: &Along<'_>, samples: &Range<usize>) -> Self {
        let (n, m) = (along.base.states(), along.trial.channels.len());
        Self { step: vec![0.0; along.steps(samples) * n], sensor: vec![0.0; samples.len() * m] }
    }

    fn if_finite(self, trial: &Trial) -> Result<Self, FitError> {
        let finite = self.step.iter().chain(&self.sensor).all(|v| v.is_finite());
        if finite { Ok(self) } else { Err(FitError::NotFinite { trial: trial.name.clone() }) }
    }
}

/// A variation of a model, followed along a trajectory.
pub(crate) enum Follower {
    Late(LateForces),
    Quick(Box<Quick>),
    Simulated(Box<Simulated>),
}

impl Follower {
    /// # Errors
    /// Where the variation is no plant at all.
    pub(crate) fn new(along: &Along<'_>, spec: &EffectSpec) -> Result<Self, FitError> {
        let Along { base, trial, .. } = along;
        let told = facts(&spec.id).told;
        if told == Told::LateForce && !shows_tension(trial) {
            return Ok(Self::Late(LateForces::new(spec, along)));
        }
        let varied =
            Examined::new(&with_variation(along.model, spec)).map_err(|error| FitError::Model(error.to_string()))?;
        if told != Told::Rates {
            return Ok(Self::Simulated(Box::new(Simulated::new(along, varied)?)));
        }
        let sensors = acts_on_sensors(&spec.id, trial, base.plant.unstretched_index(0).is_none());
        let acts = Acts { plant: !is_of_sensors(&spec.id), sensors, by_states: acts_by_states(spec) };
        Ok(Self::Quick(Box::new(Quick::new(along, varied, acts)?)))
    }

    /// What it adds over the next samples, given the base plant at both `ends` of each step.
    ///
    /// # Errors
    /// Where it cannot be simulated.
    pub(crate) fn advance(
        &mut self,
        along: &Along<'_>,
        samples: &Range<usize>,
        ends: &Ends<'_>,
    ) -> Result<Single, FitError> {
        match self {
            Self::Late(late) => {
                Ok(Single { step: late.advance(along, samples.clone()), ..Single::nothing(along, samples) })
            }
            Self::Quick(quick) => quick.advance(along, samples, ends),
            Self::Simulated(simulated) => simulated.advance(along, samples),
        }
    }
}

/// Index in the varied plant of each state of the base plant.
fn state_map(base: &Examined, varied: &Examined) -> Result<Vec<usize>, FitError> {
    let mut map: Vec<usize> = (0..6).collect();
    for i in 0..base.plant.cables() {
        map.extend(base.plant.unstretched_index(i).map(|_| varied.plant.unstretched_index(i)).into_iter().flatten());
        map.extend(base.plant.rate_index(i).map(|_| varied.plant.rate_index(i)).into_iter().flatten());
        let start = varied.plant.effect_states(i).start;
        // New effects come last in the model, so their states come last on each cable.
        map.extend((0..base.plant.effect_states(i).len()).map(|k| start + k));
    }
    if map.len() == base.states() {
        return Ok(map);
    }
    Err(FitError::Model("it lacks states that the model has".to_owned()))
}

/// A variation that is simulated, from the trajectory's point on at each sample.
pub(crate) struct Simulated {
    varied: Examined,
    map: Vec<usize>,
    y: Vec<f64>,
    simulation: Simulation,
    /// Of the base plant, along the same points.
    base: Simulation,
    shown: Vec<f64>,
}

impl Simulated {
    /// Own states of the varied plant begin at rest under the first sample and then follow the trajectory.
    fn new(along: &Along<'_>, varied: Examined) -> Result<Self, FitError> {
        let y = varied.first_states(along.trial);
        let simulation = varied.simulation(along.trial, 0, &y);
        let base = along.base.simulation(along.trial, 0, along.states(0));
        Ok(Self { map: state_map(along.base, &varied)?, y, simulation, base, shown: Vec::new(), varied })
    }

    fn advance(&mut self, along: &Along<'_>, samples: &Range<usize>) -> Result<Single, FitError> {
        let trial = along.trial;
        let Self { varied, map, y, simulation, base, shown } = self;
        let (n, m) = (along.base.states(), trial.channels.len());
        let mut out = Single::nothing(along, samples);
        for k in samples.clone() {
            let at = k - samples.start;
            let x = along.states(k);
            y.copy_from_slice(simulation.states());
            for (value, at) in x.iter().zip(&*map) {
                y[*at] = *value;
            }
            if k == 0 {
                start_effect_states(varied, trial, y, along.base);
            }
            simulation.nudge_states(y);
            disturb(simulation, &trial.inputs[k], along.latents(k));
            varied.measure(simulation, &trial.channels, shown);
            for (slot, more) in out.sensor[at * m..].iter_mut().zip(along.shows_more(varied, k, shown)) {
                *slot = more as f32;
            }
            if k + 1 < trial.len() {
                base.nudge_states(x);
                disturb(base, &trial.inputs[k], along.latents(k));
                for simulation in [&mut *simulation, &mut *base] {
                    simulation.advance(trial.time[k + 1] - trial.time[k]).map_err(FitError::Simulation)?;
                }
                let end = base.states();
                for (r, place) in map.iter().enumerate() {
                    out.step[at * n + r] = (simulation.states()[*place] - end[r]) as f32;
                }
            }
        }
        out.if_finite(trial)
    }
}

/// Whether what a variation adds to the rates depends on states and time alone, and not on the inputs.
fn acts_by_states(spec: &EffectSpec) -> bool {
    let text = spec.expression.as_deref().unwrap_or_default();
    let by_inputs = facts(&spec.id).by_inputs || ["winch_force", "disturbance"].iter().any(|i| text.contains(i));
    let Ok(stage) = EffectKind::new(spec).map(|kind| kind.stage()) else { return false };
    let added = matches!(stage, Stage::WinchLoss | Stage::WinchPull(_) | Stage::WinchPosition | Stage::PlatformWrench);
    !by_inputs && (added || matches!(stage, Stage::ElasticLaw | Stage::Transverse))
}

/// Whether a variation only changes what the sensors show.
fn is_of_sensors(id: &str) -> bool {
    cdpr::effect::find(id)
        .is_some_and(|info| matches!(info.site, Site::LengthSensor | Site::TensionSensor | Site::PoseSensor))
}

/// Whether a variation changes what the sensors show of the same states.
fn acts_on_sensors(id: &str, trial: &Trial, rigid: bool) -> bool {
    facts(id).shifts_sensors || is_of_sensors(id) || (shows_tension(trial) && (rigid || id.starts_with("cable_")))
}

fn shows_tension(trial: &Trial) -> bool {
    trial.channels.iter().any(|c| matches!(c, Channel::Tension(_)))
}

/// What a variation acts on, and whether on the plant by its states alone.
#[derive(Clone, Copy)]
struct Acts {
    plant: bool,
    sensors: bool,
    by_states: bool,
}

/// As [`Simulated`], by the difference of rates at both ends of each step, carried to its end as [`Ends`] does: an order faster.
/// Own states of the variation follow by the trapezoidal rule, so they must be slow. For weighing candidates, not for estimates.
pub(crate) struct Quick {
    varied: Examined,
    acts: Acts,
    map: Vec<usize>,
    /// States that the base plant does not have.
    own: Vec<usize>,
    y: Vec<f64>,
    simulation: Simulation,
    shown: Vec<f64>,
    rates: [Vec<f64>; 2],
    difference: Vec<f64>,
}

impl Quick {
    fn new(along: &Along<'_>, varied: Examined, acts: Acts) -> Result<Self, FitError> {
        let Along { base, trial, .. } = along;
        let map = state_map(base, &varied)?;
        let mut y = varied.first_states(trial);
        start_effect_states(&varied, trial, &mut y, base);
        let own: Vec<usize> = (0..y.len()).filter(|at| !map.contains(at)).collect();
        let simulation = varied.simulation(trial, 0, &y);
        let acts = Acts { by_states: acts.by_states && own.is_empty(), ..acts };
        let rates = [vec![0.0; y.len()], vec![0.0; y.len()]];
        Ok(Self {
            acts,
            map,
            own,
            y,
            simulation,
            shown: Vec::new(),
            rates,
            difference: vec![0.0; base.states()],
            varied,
        })
    }

    fn advance(&mut self, along: &Along<'_>, samples: &Range<usize>, ends: &Ends<'_>) -> Result<Single, FitError> {
        let Along { base, linear, trial, .. } = along;
        let Self { varied, acts, map, own, y, simulation, shown, rates, difference } = self;
        let (n, m) = (base.states(), trial.channels.len());
        let mut out = Single::nothing(along, samples);
        let take = |y: &mut [f64], states: &[f64]| map.iter().zip(states).for_each(|(at, value)| y[*at] = *value);
        for k in samples.clone() {
            let at = k - samples.start;
            let (felt, slack) = (along.felt(k), linear.slack[k]);
            take(y, along.states(k));
            if acts.sensors {
                let moment = Moment { time: trial.time[k], y, felt, slack };
                varied.measure_at(simulation, &moment, &trial.channels, shown);
                for (slot, more) in out.sensor[at * m..].iter_mut().zip(along.shows_more(varied, k, shown)) {
                    *slot = more as f32;
                }
            }
            if !acts.plant || k + 1 == trial.len() {
                continue;
            }
            let half = 0.5 * linear.interval[k];
            let target = &mut out.step[at * n..(at + 1) * n];
            let [from, to] = along.ends(k);
            // Else it is that at the end of the step before.
            if k == 0 || !acts.by_states || slack != linear.slack[k - 1] {
                take(y, from);
                varied.plant.rates(trial.time[k], y, felt, &slack, &mut rates[0]);
                for (slot, (place, base)) in difference.iter_mut().zip(map.iter().zip(ends.rates(k, 0))) {
                    *slot = rates[0][*place] - base;
                }
            }
            ends.carry(k, 0, difference, target);
            take(y, to);
            own.iter().for_each(|at| y[*at] += 2.0 * half * rates[0][*at]);
            varied.plant.rates(trial.time[k + 1], y, felt, &slack, &mut rates[1]);
            own.iter().for_each(|at| y[*at] += half * (rates[1][*at] - rates[0][*at]));
            for (slot, (place, base)) in difference.iter_mut().zip(map.iter().zip(ends.rates(k, 1))) {
                *slot = rates[1][*place] - base;
            }
            ends.carry(k, 1, difference, target);
        }
        out.if_finite(trial)
    }
}

/// Own states of a variation at rest, as at the start of a simulation.
fn start_effect_states(varied: &Examined, trial: &Trial, y: &mut [f64], base: &Examined) {
    let mut rest = varied.first_states(trial);
    rest[..6].copy_from_slice(&y[..6]);
    varied.plant.straighten(&mut rest);
    for i in 0..base.plant.cables() {
        let known = base.plant.effect_states(i).len();
        for at in varied.plant.effect_states(i).skip(known) {
            y[at] = rest[at];
        }
    }
}

/// A model moved in one parameter.
pub(crate) struct Varied {
    pub(crate) examined: Examined,
    /// The effect that the parameter belongs to.
    pub(crate) effect: String,
    /// How far it was moved.
    pub(crate) size: f64,
}

/// Steps that are done one after the other, side by side with others.
const STRETCH: usize = 500;

/// The sensitivities to parameters: the forcing of a move to each of `varied`, models with the same states, over its size.
///
/// By the variational equation with the parameters as inputs; a dead time, which is none in it, by simulation. Where that
/// fails a move of it says nothing, and it stays as it is.
pub(crate) fn sensitivities(along: &Along<'_>, varied: &[Varied]) -> Forcing {
    let Along { base, linear, trial, .. } = *along;
    let (n, m, len, columns) = (base.states(), trial.channels.len(), trial.len(), varied.len());
    let mut forcing =
        Forcing { first: 0, columns, step: vec![0.0; (len - 1) * n * columns], sensor: vec![0.0; len * m * columns] };
    if columns == 0 {
        return forcing;
    }
    let stretches = forcing.step.par_chunks_mut(STRETCH * n * columns).enumerate();
    stretches.for_each(|(at, steps)| respond(along, varied, at * STRETCH, steps));
    let rigid = base.plant.unstretched_index(0).is_none();
    for (c, varied) in varied.iter().enumerate() {
        let scale = 1.0 / varied.size;
        if facts(&varied.effect).dead_time {
            let simulated = Simulated::new(along, varied.examined.clone());
            let Ok(single) = simulated.and_then(|mut all| all.advance(along, &(0..len))) else { continue };
            for (at, value) in single.step.iter().enumerate() {
                forcing.step[at * columns + c] = value * scale as f32;
            }
            for (at, value) in single.sensor.iter().enumerate() {
                forcing.sensor[at * columns + c] = value * scale as f32;
            }
        } else if acts_on_sensors(&varied.effect, trial, rigid) {
            let simulation = varied.examined.simulation(trial, 0, along.states(0));
            let mut shown = Vec::new();
            for k in 0..len {
                let (felt, slack) = (along.felt(k), linear.slack[k]);
                let moment = Moment { time: trial.time[k], y: along.states(k), felt, slack };
                varied.examined.measure_at(&simulation, &moment, &trial.channels, &mut shown);
                for (j, more) in along.shows_more(&varied.examined, k, &shown).enumerate() {
                    forcing.sensor[(k * m + j) * columns + c] = (more * scale) as f32;
                }
            }
        }
    }
    forcing
}

/// Writes the response to each of `varied` over the steps from `first` on.
fn respond(along: &Along<'_>, varied: &[Varied], first: usize, steps: &mut [f32]) {
    let base = along.base;
    let (n, columns) = (base.states(), varied.len());
    let acting: Vec<usize> =
        (0..columns).filter(|c| !is_of_sensors(&varied[*c].effect) && !facts(&varied[*c].effect).dead_time).collect();
    if acting.is_empty() {
        return;
    }
    let mut variation = Variation::new(base);
    let mut point = vec![0.0; n];
    let (mut own, mut moved) = (vec![0.0; n], vec![0.0; n]);
    let width = acting.len();
    let mut response = vec![0.0; n * width];
    for (k, target) in steps.chunks_exact_mut(n * columns).enumerate() {
        let forced = |part: &Step<'_>, forced: &mut [Vec<f64>; 2]| {
            part.inner_point(&mut point);
            let places = [(part.inner_time(), &point[..]), (part.end_time(), part.to)];
            for ((time, y), forced) in places.into_iter().zip(forced) {
                base.plant.rates(time, y, &part.felt, &part.slack, &mut own);
                for (c, at) in acting.iter().enumerate() {
                    let Varied { examined, size, .. } = &varied[*at];
                    examined.plant.rates(time, y, &part.felt, &part.slack, &mut moved);
                    for (r, (moved, own)) in moved.iter().zip(&own).enumerate() {
                        forced[r * width + c] = (moved - own) / size;
                    }
                }
            }
        };
        variation.response(&along.own_step(first + k), width, forced, &mut response);
        for (row, target) in response.chunks_exact(width).zip(target.chunks_exact_mut(columns)) {
            for (at, value) in acting.iter().zip(row) {
                target[*at] = *value as f32;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use cdpr::model_file::Model;

    use super::*;
    use crate::data::recording::{Bench, fitted, fitted_on, record, record_on};
    use crate::filter::estimate::for_trial;
    use crate::filter::whiten::whiten;
    use crate::hypothesis::stream::forcing;

    fn simulated(along: &Along<'_>, varied: &Examined) -> Single {
        let mut simulated = Simulated::new(along, varied.clone()).unwrap();
        simulated.advance(along, &(0..along.linear.len)).unwrap()
    }
    use crate::hypothesis::parameter::free_parameters;
    use crate::weigh::proposal::varied_models;

    /// Sensitivities by the variational equation, against differences of simulations.
    #[test]
    fn sensitivities_are_those_of_simulations() {
        let effect = |id: &str, cable, values: &[f64]| EffectSpec::new(id, cable, values).unwrap();
        let effects = [
            effect("platform_linear_drag", None, &[60.0]),
            effect("winch_coulomb_friction", Some(1), &[80.0, 0.05]),
            effect("winch_force_gain", Some(3), &[0.01]),
            effect("winch_lag", None, &[0.1]),
            effect("cable_stiffness", Some(2), &[-0.02]),
            effect("winch_delay", Some(4), &[0.05]),
            effect("length_sensor_scale", Some(4), &[1e-5]),
        ];
        let trials = [record(&effects, 30.0, 4)];
        let fit = fitted(&effects, &trials);
        let linear = fit.linear(&trials);
        let along = Along::new(&fit, &linear, &trials, 0);
        let varied: Vec<Varied> =
            varied_models(&fit.model, &free_parameters(&fit.model, 0)).into_iter().flatten().collect();
        assert_eq!(varied.len(), 8, "friction has two parameters in use");
        let all = sensitivities(&along, &varied);
        for (c, varied) in varied.iter().enumerate() {
            let whole = simulated(&along, &varied.examined);
            let column = |values: &[f32]| values.iter().skip(c).step_by(all.columns).copied().collect::<Vec<f32>>();
            let own = [column(&all.step), column(&all.sensor)].concat();
            let other: Vec<f32> = whole.step.iter().chain(&whole.sensor).map(|v| v / varied.size as f32).collect();
            let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
            let (size, whole_size) = (product(&own, &own), product(&other, &other));
            let alike = product(&own, &other) / (size * whole_size).sqrt();
            let ratio = (size / whole_size).sqrt();
            assert!(alike > 0.95, "{} (parameter {c}): correlation {alike}", varied.effect);
            assert!((0.85..1.15).contains(&ratio), "{} (parameter {c}): {ratio}", varied.effect);
        }
    }

    /// Forcing without a simulation of its own, against the difference of two simulations.
    #[test]
    fn quick_forcing_is_that_of_a_simulation() {
        let trials = [record(&[], 30.0, 3)];
        let fit = fitted(&[], &trials);
        let linear = fit.linear(&trials);
        let along = Along::new(&fit, &linear, &trials, 0);
        let late: [(&str, &[f64]); 4] = [
            ("winch_lag", &[0.2]),
            ("winch_delay", &[0.15]),
            ("cable_creep", &[3e8, 2.0]),
            ("cable_creep", &[3e8, 10.0]),
        ];
        for (id, values) in late {
            let spec = EffectSpec::new(id, Some(2), values).unwrap();
            let quick = forcing(&along, (std::slice::from_ref(&spec), &[vec![(0, 1.0)]]));
            let varied = Model { effects: vec![spec], ..fit.model.clone() };
            let whole = simulated(&along, &Examined::new(&varied).unwrap());
            let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
            let (own, other) = (product(&quick.step, &quick.step), product(&whole.step, &whole.step));
            let alike = product(&quick.step, &whole.step) / (own * other).sqrt();
            assert!(alike > 0.97, "{id} {values:?}: correlation {alike}");
            // At this sampling rate the fastest mode turns by more than a radian in an interval.
            assert!((0.8..1.25).contains(&(own / other).sqrt()), "{id} {values:?}: {own} {other}");
        }
    }

    /// A drum of 0.8 kg at a winch of 0.1 kg explained nothing by its signature, which took a force that had just jumped for one that
    /// accelerates the winch: an axial mass of that cable was named. By the trapezoidal rule a force on a winch that rings gave it
    /// the speed of a free one.
    #[test]
    fn where_winches_ring_between_samples_quick_forcing_says_what_a_simulation_does() {
        let bench = Bench::ringing();
        let trials = [record_on(&bench, &[], 10.0, 3)];
        let fit = fitted_on(&bench, &[], &trials);
        let linear = fit.linear(&trials);
        let along = Along::new(&fit, &linear, &trials, 0);
        assert!(along.rings());
        let laws: [(&str, &[f64]); 6] = [
            ("winch_force_bias", &[2.0]),
            ("winch_force_gain", &[0.01]),
            ("winch_viscous_friction", &[5.0]),
            // A tenth of what the winch has: of more it shows as much less as it makes the winch heavier.
            ("winch_drum_inertia", &[2e-3]),
            ("cable_axial_mass", &[0.02]),
            ("cable_stiffness", &[0.05]),
        ];
        for (id, values) in laws {
            let spec = EffectSpec::new(id, Some(2), values).unwrap();
            let quick = forcing(&along, (std::slice::from_ref(&spec), &[vec![(0, 1.0)]]));
            let varied = Model { effects: vec![spec], ..fit.model.clone() };
            let whole = simulated(&along, &Examined::new(&varied).unwrap());
            let beside = |own: &[f32], other: &[f32]| own.iter().zip(other).flat_map(|(a, b)| [*a, *b]).collect();
            let (step, sensor) = (beside(&quick.step, &whole.step), beside(&quick.sensor, &whole.sensor));
            let both = Forcing { first: 0, columns: 2, step, sensor };
            let gram = whiten(along.linear, &for_trial(&fit.randomness, &trials[0]), &both).gram;
            let (alike, ratio) = (gram[1] / (gram[0] * gram[3]).sqrt(), (gram[0] / gram[3]).sqrt());
            // A simulation also has what the force's jumps from sample to sample do to a drum, a quarter beside its own motion.
            assert!(alike > 0.95 && (0.75..1.15).contains(&ratio), "{id}: {alike} {ratio}");
        }
    }
}

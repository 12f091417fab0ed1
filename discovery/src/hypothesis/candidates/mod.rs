//! The catalogue as candidates for regression: one or more signatures each, and how amplitudes become parameters.

mod dictionary;

use std::f64::consts::PI;

use cdpr::effect::EffectSpec;
use cdpr::model_file::Model;
use cdpr::parameters::CableModel;

use crate::data::{Channel, Trial};
use crate::hypothesis::spectrum::Wave;
use crate::model::sizes::{Sizes, usual_force};

pub(crate) use dictionary::dictionary;

/// A column of the regression: a weighted sum of simulated variations of the model.
pub(crate) type Combination = Vec<(usize, f64)>;

/// Turns the amplitudes of a candidate's columns into an effect; `None` where no parameter values have them.
type Build = Box<dyn Fn(&[f64]) -> Option<EffectSpec> + Send + Sync>;

/// One explanation.
pub(crate) struct Candidate {
    /// Id in the catalogue.
    pub(crate) id: &'static str,
    /// Cable, or all.
    pub(crate) cable: Option<usize>,
    /// Its columns.
    pub(crate) columns: Vec<usize>,
    /// Parameters found by trying several values rather than by regression.
    pub(crate) tried: usize,
    build: Build,
}

impl Candidate {
    /// The effect with these amplitudes.
    pub(crate) fn effect(&self, amplitudes: &[f64]) -> Option<EffectSpec> {
        let known = amplitudes.iter().all(|a| a.is_finite());
        known.then(|| (self.build)(amplitudes)).flatten().filter(|spec| spec.check().is_ok())
    }
}

/// What is known of the data when candidates are set up.
#[derive(Clone, Debug)]
pub(crate) struct Situation {
    /// Longest trial (s).
    pub(crate) duration: f64,
    /// Mean size of the winch forces (N).
    pub(crate) mean_tension: f64,
    /// Winch commands sorted, by cable (N).
    pub(crate) commands: Vec<Vec<f64>>,
    /// Frequencies (rad/s) at which the latent forces have peaks.
    pub(crate) peaks: Vec<f64>,
    /// Lengths at which the latent forces repeat.
    pub(crate) waves: Vec<Wave>,
    /// Radii (m) that a drum may have by the waves in its measured length, by cable, and of all alike.
    pub(crate) drums: (Vec<Option<f64>>, Option<f64>),
    /// Whether unstretched lengths, cable lengths, tensions, poses are measured.
    pub(crate) unstretched: Vec<bool>,
    pub(crate) lengths: Vec<bool>,
    pub(crate) tensions: Vec<bool>,
    pub(crate) pose: bool,
}

impl Situation {
    pub(crate) fn of(trials: &[Trial]) -> Self {
        let cables = trials.first().map_or(0, Trial::cables);
        let mut commands = vec![Vec::new(); cables];
        for trial in trials {
            for inputs in &trial.inputs {
                for (list, force) in commands.iter_mut().zip(inputs.winch_force) {
                    list.push(force);
                }
            }
        }
        for list in &mut commands {
            list.sort_by(f64::total_cmp);
        }
        let has = |wanted: Channel| trials.iter().any(|t| t.channels.contains(&wanted));
        Self {
            duration: trials.iter().map(|t| t.time[t.len() - 1] - t.time[0]).fold(0.0, f64::max),
            mean_tension: usual_force(trials),
            commands,
            peaks: Vec::new(),
            waves: Vec::new(),
            drums: (Vec::new(), None),
            unstretched: (0..cables).map(|i| has(Channel::UnstretchedLength(i))).collect(),
            lengths: (0..cables).map(|i| has(Channel::CableLength(i))).collect(),
            tensions: (0..cables).map(|i| has(Channel::Tension(i))).collect(),
            pose: (0..3).any(|k| has(Channel::Pose(k))),
        }
    }

    /// Number of cables.
    pub(crate) fn cables(&self) -> usize {
        self.commands.len()
    }

    /// All cables together, and each by its number.
    pub(crate) fn cables_and_all(&self) -> impl Iterator<Item = Option<usize>> + use<> {
        std::iter::once(None).chain((1..=self.cables()).map(Some))
    }

    /// The winch command below which a share of the commands lies (N), of one cable or of all.
    pub(crate) fn quantile(&self, cable: Option<usize>, share: f64) -> f64 {
        let of = |list: &[f64]| list[((list.len() - 1) as f64 * share) as usize];
        match cable {
            Some(c) => of(&self.commands[c - 1]),
            None => {
                let mut all: Vec<f64> = self.commands.iter().flatten().copied().collect();
                all.sort_by(f64::total_cmp);
                of(&all)
            }
        }
    }
}

/// Variations to simulate, columns made of them, and candidates made of columns.
#[derive(Default)]
pub(crate) struct Library {
    /// Cables of the robot.
    cables: usize,
    /// Each variation is one effect added to the model.
    pub(crate) variations: Vec<EffectSpec>,
    pub(crate) columns: Vec<Combination>,
    pub(crate) candidates: Vec<Candidate>,
    /// Columns of what is free beside every candidate, and what is known of their amplitudes beforehand: these errors of the
    /// survey move along when a candidate comes in.
    pub(crate) beside: Vec<(usize, Known)>,
}

/// What is known of an amplitude beforehand: its mean, and the inverse of its variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) mean: f64,
    pub(crate) precision: f64,
}

impl Library {
    fn new(cables: usize) -> Self {
        Self { cables, ..Self::default() }
    }

    /// The columns of one candidate alone, in its order, and what they are made of.
    pub(crate) fn only(&self, candidate: usize) -> Self {
        self.of_columns(&self.candidates[candidate].columns)
    }

    /// These columns alone, in their order, and what they are made of.
    pub(crate) fn of_columns(&self, columns: &[usize]) -> Self {
        let mut used: Vec<usize> = columns.iter().flat_map(|c| &self.columns[*c]).map(|(at, _)| *at).collect();
        used.sort_unstable();
        used.dedup();
        let place = |at: &usize| used.binary_search(at).unwrap_or_else(|_| unreachable!("it is one of those used"));
        let column = |c: &usize| self.columns[*c].iter().map(|(at, weight)| (place(at), *weight)).collect();
        Self {
            variations: used.iter().map(|at| self.variations[*at].clone()).collect(),
            columns: columns.iter().map(column).collect(),
            ..Self::new(self.cables)
        }
    }

    /// The candidates, with the columns and variations that they need alone.
    fn in_use(mut self) -> Self {
        let mut used: Vec<usize> = self.candidates.iter().flat_map(|c| c.columns.iter().copied()).collect();
        used.sort_unstable();
        used.dedup();
        let place = |at: &usize| used.binary_search(at).unwrap_or_else(|_| unreachable!("it is one of those used"));
        for candidate in &mut self.candidates {
            candidate.columns.iter_mut().for_each(|column| *column = place(column));
        }
        Self { candidates: std::mem::take(&mut self.candidates), ..self.of_columns(&used) }
    }

    /// The same with one more column of what is free beside every candidate.
    pub(crate) fn set_beside(&mut self, variation: EffectSpec, known: Known) {
        self.variations.push(variation);
        let column = self.column(vec![(self.variations.len() - 1, 1.0)]);
        self.beside.push((column, known));
    }

    /// What tells a candidate from every other one: its id and cable, of a term also its target and text.
    pub(crate) fn name(&self, candidate: &Candidate) -> String {
        let term = candidate.columns.first().and_then(|column| self.columns[*column].first()).and_then(|(at, _)| {
            let spec = &self.variations[*at];
            Some(format!("{} {}", spec.target.as_deref()?, spec.expression.as_deref()?))
        });
        format!("{} {:?} {}", candidate.id, candidate.cable, term.unwrap_or_default())
    }

    fn vary(&mut self, id: &str, cable: Option<usize>, values: &[f64]) -> usize {
        self.variations
            .push(EffectSpec::new(id, cable, values).unwrap_or_else(|e| unreachable!("a variation of our own: {e}")));
        self.variations.len() - 1
    }

    fn column(&mut self, combination: Combination) -> usize {
        self.columns.push(combination);
        self.columns.len() - 1
    }

    fn candidate(&mut self, id: &'static str, cable: Option<usize>, columns: Vec<usize>, tried: usize, build: Build) {
        self.candidates.push(Candidate { id, cable, columns, tried, build });
    }

    /// For each single cable and, as their sum, for all cables: one column per set of values; `build` makes parameter
    /// values of the amplitudes.
    fn each_cable(
        &mut self,
        id: &'static str,
        variations: &[Vec<f64>],
        tried: usize,
        build: impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static,
    ) {
        if !possible(id, Some(1), variations) {
            return;
        }
        let mut by_cable = Vec::new();
        for cable in 1..=self.cables {
            let sims: Vec<usize> = variations.iter().map(|values| self.vary(id, Some(cable), values)).collect();
            let columns: Vec<usize> = sims.iter().map(|s| self.column(vec![(*s, 1.0)])).collect();
            let b = build.clone();
            let make = move |a: &[f64]| b(a).and_then(|values| EffectSpec::new(id, Some(cable), &values).ok());
            self.candidate(id, Some(cable), columns, tried, Box::new(make));
            by_cable.push(sims);
        }
        let columns =
            (0..variations.len()).map(|v| self.column(by_cable.iter().map(|sims| (sims[v], 1.0)).collect())).collect();
        let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(id, None, &values).ok());
        self.candidate(id, None, columns, tried, Box::new(make));
    }

    fn whole(
        &mut self,
        id: &'static str,
        variations: &[Vec<f64>],
        tried: usize,
        build: impl Fn(&[f64]) -> Option<Vec<f64>> + Send + Sync + 'static,
    ) {
        if !possible(id, None, variations) {
            return;
        }
        let columns = variations
            .iter()
            .map(|values| {
                let sim = self.vary(id, None, values);
                self.column(vec![(sim, 1.0)])
            })
            .collect();
        let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(id, None, &values).ok());
        self.candidate(id, None, columns, tried, Box::new(make));
    }
}

/// Whether an effect can have these values, which come from the model and the data: a cable without mass has no transverse mode.
fn possible(id: &str, cable: Option<usize>, variations: &[Vec<f64>]) -> bool {
    variations.iter().all(|values| EffectSpec::new(id, cable, values).is_ok())
}

/// One parameter in proportion to one amplitude.
fn proportional(size: f64) -> impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static {
    move |a| Some(vec![a[0] * size])
}

/// Share of the winch forces by which forces at a winch are varied.
const SMALL: f64 = 2.5e-3;
/// Shares of the commands that are beyond a limit of a winch's force: it may be reached often or hardly ever.
const REACHED: [f64; 4] = [0.4, 0.2, 0.07, 0.01];
/// Share of the platform's mass below which what swings at a winch is as good as without mass.
const LIGHT: f64 = 1e-3;

/// The catalogue, set up for this model and data.
pub(crate) fn catalogue(model: &Model, situation: &Situation) -> Library {
    let mut lib = Library::new(situation.cables());
    let sizes = &Sizes::of(&model.parameters);
    let elastic =
        model.parameters.cable_model != CableModel::Rigid || model.effects.iter().any(|e| e.id == "cable_elasticity");
    if elastic {
        cables(&mut lib, situation, sizes, model.parameters.cable_density);
    }
    winches(&mut lib, situation, sizes);
    platform(&mut lib, situation, sizes);
    sensors(&mut lib, situation, sizes);
    // An effect that the model already has on that cable is refined, not found again.
    lib.candidates.retain(|c| !model.effects.iter().any(|effect| is_there(effect, c.id, c.cable)));
    lib.in_use()
}

/// Whether an effect is the law `id` on that cable, or one of them is on all.
pub(crate) fn is_there(effect: &EffectSpec, id: &str, cable: Option<usize>) -> bool {
    effect.id == id && (effect.cable.is_none() || cable.is_none() || effect.cable == cable)
}

fn cables(lib: &mut Library, situation: &Situation, sizes: &Sizes, density: f64) {
    lib.each_cable("cable_stiffness", &[vec![0.02]], 0, proportional(0.02));
    lib.each_cable("cable_damping", &[vec![0.5]], 0, proportional(0.5));
    for tau in [2.0, 10.0, 50.0] {
        // Creep strain is in proportion to 1/EA_c.
        let build = move |a: &[f64]| (a[0] > 0.0).then(|| vec![3e8 / a[0], tau]);
        lib.each_cable("cable_creep", &[vec![3e8, tau]], 1, build);
    }
    lib.each_cable("cable_stiffening", &[vec![2e4]], 0, proportional(2e4));
    let t = situation.mean_tension;
    let held = SMALL * t;
    for strain in [3e-5, 2e-4] {
        lib.each_cable("cable_hysteresis", &[vec![held, strain]], 1, move |a| {
            (a[0] > 0.0).then(|| vec![held * a[0], strain])
        });
    }
    // A weight that makes a cable sag by a hundredth of its length.
    let (w0, t1) = (0.1 * t / sizes.reach, 0.8 * t);
    let build = move |a: &[f64]| {
        // a0 w0²/T² + a1 w0² (1/T1² - 1/T²) = w²/T_ref² with w² = (a0 + a1) w0² carried by the two columns together.
        let square = a[0] + a[1];
        let reference = (a[0] / (t * t) + a[1] / (t1 * t1)) / square;
        (square > 0.0 && reference > 0.0).then(|| vec![w0 * square.sqrt(), 1.0 / reference.sqrt()])
    };
    lib.each_cable("cable_sag", &[vec![w0, t], vec![w0, t1]], 0, build);
    let mut period = situation.duration / 8.0;
    while period < 6.0 * situation.duration {
        let build = move |a: &[f64]| Some(vec![1e-5 * a[0].hypot(a[1]), period, a[1].atan2(a[0])]);
        lib.whole("cable_thermal_expansion", &[vec![1e-5, period, 0.0], vec![1e-5, period, PI / 2.0]], 1, build);
        period *= 2.0;
    }
    lib.each_cable("cable_drag", &[vec![0.01]], 0, proportional(0.01));
    // The amplitude says how well a cable of this density fits; the density itself is refined later.
    let build = move |a: &[f64]| (0.2..5.0).contains(&a[0]).then(|| vec![density, 0.02, 0.01]);
    lib.each_cable("cable_transverse_mode", &[vec![density, 0.02, 0.01]], 2, build);
    lib.each_cable("cable_axial_mass", &[vec![0.2]], 0, proportional(0.2));
}

fn winches(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let force = SMALL * situation.mean_tension;
    for speed in [0.005, 0.02, 0.08, 0.3] {
        lib.each_cable("winch_coulomb_friction", &[vec![force, speed]], 1, move |a| Some(vec![force * a[0], speed]));
    }
    lib.each_cable("winch_viscous_friction", &[vec![force]], 0, proportional(force));
    let speed = 0.05;
    stribeck(lib, speed, force, move |a: &[f64]| {
        // Columns: Coulomb part, the peak above it, viscous part.
        (a[0] > 0.0 && a[0] + a[1] > 0.0)
            .then(|| vec![force * a[0], force * (a[0] + a[1]), speed, (force * a[2]).max(0.0)])
    });
    for speed in [0.005, 0.02, 0.08] {
        lib.each_cable("pulley_capstan_loss", &[vec![0.005, speed]], 1, move |a| Some(vec![0.005 * a[0], speed]));
    }
    lib.each_cable("winch_force_gain", &[vec![0.01]], 0, proportional(0.01));
    lib.each_cable("winch_force_bias", &[vec![force]], 0, proportional(force));
    for tau in [0.03, 0.2] {
        lib.each_cable("winch_lag", &[vec![tau]], 1, move |a| (a[0] > 0.05).then(|| vec![tau * a[0].min(4.0)]));
        lib.each_cable("winch_delay", &[vec![tau]], 1, move |a| (a[0] > 0.05).then(|| vec![tau * a[0].min(4.0)]));
    }
    let drum = 0.2 * sizes.winch_mass.max(LIGHT * sizes.mass);
    lib.each_cable("winch_drum_inertia", &[vec![drum]], 0, proportional(drum));
    for cable in situation.cables_and_all() {
        let (low, high) = (situation.quantile(cable, 0.0), situation.quantile(cable, 1.0));
        let margin = 0.5 * (high - low).max(1e-4 * situation.mean_tension);
        for share in REACHED {
            let (lower, upper) = (situation.quantile(cable, share), situation.quantile(cable, 1.0 - share));
            saturation(lib, cable, low - margin, upper);
            saturation(lib, cable, lower, high + margin);
            // Recordings in which one limit is reached say nothing of the other one.
            saturation(lib, cable, lower, upper);
        }
    }
}

fn saturation(lib: &mut Library, cable: Option<usize>, lower: f64, upper: f64) {
    if upper <= lower || !possible("winch_saturation", cable, &[vec![lower, upper]]) {
        return;
    }
    let sim = lib.vary("winch_saturation", cable, &[lower, upper]);
    let column = lib.column(vec![(sim, 1.0)]);
    // The amplitude says how well the level fits; the level itself is refined later.
    let build = move |a: &[f64]| {
        (0.2..5.0).contains(&a[0]).then(|| EffectSpec::new("winch_saturation", cable, &[lower, upper]).ok()).flatten()
    };
    lib.candidate("winch_saturation", cable, vec![column], 1, Box::new(build));
}

/// Stribeck friction needs differences of variations: the Coulomb part alone, the peak, the viscous part.
fn stribeck(
    lib: &mut Library,
    speed: f64,
    force: f64,
    build: impl Fn(&[f64]) -> Option<Vec<f64>> + Clone + Send + Sync + 'static,
) {
    const ID: &str = "winch_stribeck_friction";
    let mut all = [Vec::new(), Vec::new(), Vec::new()];
    for cable in 1..=lib.cables {
        let flat = lib.vary(ID, Some(cable), &[force, force, speed, 0.0]);
        let peak = lib.vary(ID, Some(cable), &[0.0, force, speed, 0.0]);
        let viscous = lib.vary(ID, Some(cable), &[0.0, 0.0, speed, force]);
        let sets = [vec![(flat, 1.0)], vec![(peak, 1.0)], vec![(viscous, 1.0)]];
        for (sum, set) in all.iter_mut().zip(&sets) {
            sum.extend_from_slice(set);
        }
        let columns = sets.into_iter().map(|set| lib.column(set)).collect();
        let b = build.clone();
        let make = move |a: &[f64]| b(a).and_then(|values| EffectSpec::new(ID, Some(cable), &values).ok());
        lib.candidate(ID, Some(cable), columns, 1, Box::new(make));
    }
    let columns = all.into_iter().map(|set| lib.column(set)).collect();
    let make = move |a: &[f64]| build(a).and_then(|values| EffectSpec::new(ID, None, &values).ok());
    lib.candidate(ID, None, columns, 1, Box::new(make));
}

fn platform(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let force = 0.4 * SMALL * situation.mean_tension;
    let (mass, inertia, offset) = (0.01 * sizes.mass, 0.01 * sizes.inertia, 0.005 * sizes.arm);
    lib.whole("platform_mass", &[vec![mass]], 0, proportional(mass));
    lib.whole("platform_inertia", &[vec![inertia]], 0, proportional(inertia));
    let sets = [vec![offset, 0.0], vec![0.0, offset]];
    lib.whole("platform_com_offset", &sets, 0, move |a| Some(vec![offset * a[0], offset * a[1]]));
    lib.whole("platform_linear_drag", &[vec![20.0]], 0, proportional(20.0));
    lib.whole("platform_quadratic_drag", &[vec![20.0, 0.0, 0.0]], 0, |a| Some(vec![20.0 * a[0], 0.0, 0.0]));
    for direction in 0..8 {
        drag_in_wind(lib, 6.0, f64::from(direction) * PI / 4.0);
    }
    lib.whole("platform_rotational_damping", &[vec![5e3]], 0, proportional(5e3));
    let torque = force * sizes.arm;
    let wind = [vec![force, 0.0, 0.0], vec![0.0, force, 0.0], vec![0.0, 0.0, torque]];
    lib.whole("steady_wind", &wind, 0, move |a| Some(vec![force * a[0], force * a[1], torque * a[2]]));
    for frequency in situation.peaks.clone() {
        let sets: Vec<Vec<f64>> = [(0.0, 0.0), (PI / 2.0, 0.0), (0.0, PI / 2.0), (PI / 2.0, PI / 2.0)]
            .iter()
            .map(|(phase, direction)| vec![force, frequency, *phase, *direction])
            .collect();
        lib.whole("periodic_gust", &sets, 1, move |a| Some(gust(a, force, frequency)));
    }
    let sets = [vec![10.0, 0.0, 0.0, 0.0], vec![0.0, 10.0, 0.0, 0.0]];
    let spring = lib.vary("umbilical", None, &sets[0]);
    let damper = lib.vary("umbilical", None, &sets[1]);
    let constant_x = lib.vary("steady_wind", None, &[force, 0.0, 0.0]);
    let constant_y = lib.vary("steady_wind", None, &[0.0, force, 0.0]);
    let columns = [spring, damper, constant_x, constant_y].map(|s| lib.column(vec![(s, 1.0)])).to_vec();
    let build = move |a: &[f64]| {
        let stiffness = 10.0 * a[0];
        let values = [stiffness, (10.0 * a[1]).max(0.0), force * a[2] / stiffness, force * a[3] / stiffness];
        (stiffness > 0.0).then(|| EffectSpec::new("umbilical", None, &values).ok()).flatten()
    };
    lib.candidate("umbilical", None, columns, 0, Box::new(build));
}

/// Amplitude, frequency, phase, direction of the straight oscillation nearest to sine and cosine amplitudes on x and y.
fn gust(a: &[f64], force: f64, frequency: f64) -> Vec<f64> {
    let m = nalgebra::Matrix2::new(a[0], a[1], a[2], a[3]) * force;
    let svd = m.svd(true, true);
    let k = svd.singular_values.imax();
    let (u, v) = (svd.u.unwrap_or_default(), svd.v_t.unwrap_or_default());
    let (direction, phase) = (u[(1, k)].atan2(u[(0, k)]), v[(k, 1)].atan2(v[(k, 0)]));
    vec![svd.singular_values[k], frequency, phase, direction]
}

/// Drag in a wind of a speed (m/s) and a direction (rad), and what changes with the wind, along it and across.
fn drag_in_wind(lib: &mut Library, speed: f64, angle: f64) {
    const ID: &str = "platform_quadratic_drag";
    const STEP: f64 = 1.5;
    let along = [angle.cos(), angle.sin()];
    let wind = move |more: f64, across: f64| {
        [(speed + more) * along[0] - across * along[1], (speed + more) * along[1] + across * along[0]]
    };
    let [still, stronger, turned] =
        [wind(0.0, 0.0), wind(STEP, 0.0), wind(0.0, STEP)].map(|w| lib.vary(ID, None, &[5.0, w[0], w[1]]));
    let columns = vec![
        lib.column(vec![(still, 1.0)]),
        lib.column(vec![(stronger, 1.0), (still, -1.0)]),
        lib.column(vec![(turned, 1.0), (still, -1.0)]),
    ];
    let build = move |a: &[f64]| {
        let [more, across] = [a[1], a[2]].map(|change| (STEP * change / a[0]).clamp(-0.8 * speed, 0.8 * speed));
        let w = wind(more, across);
        (a[0] > 0.0).then(|| EffectSpec::new(ID, None, &[5.0 * a[0], w[0], w[1]]).ok()).flatten()
    };
    lib.candidate(ID, None, columns, 0, Box::new(build));
}

fn sensors(lib: &mut Library, situation: &Situation, sizes: &Sizes) {
    let (anchor, attachment, late) = (5e-5 * sizes.reach, 2e-3 * sizes.arm, 0.03 * sizes.swing);
    let offset = |size: f64| move |a: &[f64]| Some(vec![size * a[0], size * a[1]]);
    lib.each_cable("anchor_offset", &[vec![anchor, 0.0], vec![0.0, anchor]], 0, offset(anchor));
    lib.each_cable("attachment_offset", &[vec![attachment, 0.0], vec![0.0, attachment]], 0, offset(attachment));
    for (channel, present) in [("unstretched_length", &situation.unstretched), ("cable_length", &situation.lengths)] {
        for cable in (1..=lib.cables).filter(|c| present[c - 1]) {
            let spec = move |bias: f64| {
                let mut spec = EffectSpec::new("length_sensor_bias", Some(cable), &[bias]).ok()?;
                spec.channel = Some(channel.to_owned());
                Some(spec)
            };
            if let Some(variation) = spec(0.02) {
                lib.variations.push(variation);
                let column = lib.column(vec![(lib.variations.len() - 1, 1.0)]);
                let build = move |a: &[f64]| spec(0.02 * a[0]);
                lib.candidate("length_sensor_bias", Some(cable), vec![column], 0, Box::new(build));
            }
        }
    }
    if situation.unstretched.iter().any(|p| *p) {
        lib.each_cable("length_sensor_scale", &[vec![1e-4]], 0, proportional(1e-4));
        for cable in situation.cables_and_all() {
            let seen = cable.map_or(situation.drums.1, |c| situation.drums.0.get(c - 1).copied().flatten());
            drum(lib, cable, sizes.drum_radius, 0);
            seen.into_iter().for_each(|radius| drum(lib, cable, radius, 1));
        }
    }
    if situation.tensions.iter().any(|p| *p) {
        let force = SMALL * situation.mean_tension;
        lib.each_cable("tension_sensor_gain", &[vec![0.01]], 0, proportional(0.01));
        lib.each_cable("tension_sensor_bias", &[vec![force]], 0, proportional(force));
        // A sensor that is not recorded shows nothing.
        let recorded = |c: &Candidate| c.cable.is_none_or(|cable| situation.tensions[cable - 1]);
        lib.candidates.retain(|c| !c.id.starts_with("tension_sensor") || recorded(c));
    }
    if situation.pose {
        let sets = [vec![0.02, 0.0, 0.0], vec![0.0, 0.02, 0.0], vec![0.0, 0.0, 0.002]];
        lib.whole("pose_sensor_bias", &sets, 0, |a| Some(vec![0.02 * a[0], 0.02 * a[1], 0.002 * a[2]]));
        let turned = 0.02 / sizes.reach;
        // The measured point's offset is, at orientations that change little, a bias of the position.
        lib.whole("pose_sensor_frame", &[vec![turned]], 0, proportional(turned));
        lib.whole("pose_sensor_delay", &[vec![late]], 0, proportional(late));
    }
}

/// A drum of a radius (m) off its axis: the wave e (cos(l/r + ψ) - cos ψ) has two parts. The model's radius is one to look at,
/// but a wave of another radius is at right angles to it, so that what the data show is another.
fn drum(lib: &mut Library, cable: Option<usize>, radius: f64, tried: usize) {
    const ID: &str = "winch_drum_eccentricity";
    let off = 1e-3 * radius;
    let columns = [0.0, PI / 2.0].map(|phase| {
        let cables = cable.map_or(1..=lib.cables, |c| c..=c);
        let waves = cables.map(|c| (lib.vary(ID, Some(c), &[off, radius, phase]), 1.0)).collect();
        lib.column(waves)
    });
    let build = move |a: &[f64]| EffectSpec::new(ID, cable, &[off * a[0].hypot(a[1]), radius, a[1].atan2(a[0])]).ok();
    lib.candidate(ID, cable, columns.to_vec(), tried, Box::new(build));
}

#[cfg(test)]
mod tests {
    use cdpr::effect::CATALOGUE;

    use super::*;
    use crate::data::recording::record;

    /// Effects that are not looked for, and why.
    const NOT_SOUGHT: [(&str, &str); 11] = [
        (
            "anchor_compliance",
            "at lengths that change little it is an error of the cable's stiffness, which is looked for",
        ),
        ("cable_catenary", "to first order in the sag it is the parabola, which is looked for"),
        ("cable_wind", "at poses near each other it is a steady wind and drag, which are looked for"),
        ("pulley_radius", "to first order in the angle it is an anchor off across its cable, which is looked for"),
        ("pulley_wrap_friction", "to first order it is the capstan loss, as whose form it is tried"),
        (
            "winch_dead_band",
            "what it holds back depends on the turns of the whole command, not in proportion to the band; lag and bias are looked for",
        ),
        (
            "winch_drum_layers",
            "over lengths that change little it is the scale of a length sensor, which is looked for",
        ),
        ("winch_power_limit", "where it is reached it is a limit of the force, which is looked for"),
        ("winch_torque_ripple", "waves along the paid-out length are found in the spectrum and named as terms"),
        ("cable_elasticity", "another base model, which `discover` tries as such"),
        ("expression", "the dictionary of terms"),
    ];

    #[test]
    fn every_effect_has_a_candidate_or_a_reason() {
        let mut trial = record(&[], 5.0, 1);
        trial.channels.extend((0..4).map(Channel::Tension));
        let mut situation = Situation::of(&[trial]);
        situation.peaks.push(1.0);
        let library = catalogue(&Model::default(), &situation);
        for info in CATALOGUE {
            let sought = library.candidates.iter().any(|c| c.id == info.id);
            let reason = NOT_SOUGHT.iter().find(|(id, _)| *id == info.id);
            assert!(sought != reason.is_some(), "{}: sought is {sought}, reason {reason:?}", info.id);
        }
    }

    #[test]
    fn the_tension_sensor_of_a_cable_is_a_candidate_where_it_is_recorded() {
        let mut trial = record(&[], 5.0, 1);
        let sensors = |trial: &Trial| -> Vec<Option<usize>> {
            let library = catalogue(&Model::default(), &Situation::of(std::slice::from_ref(trial)));
            library.candidates.iter().filter(|c| c.id == "tension_sensor_bias").map(|c| c.cable).collect()
        };
        trial.channels.retain(|c| !matches!(c, Channel::Tension(_)));
        assert_eq!(sensors(&trial), []);
        trial.channels.push(Channel::Tension(2));
        assert_eq!(sensors(&trial), [Some(3), None]);
    }

    #[test]
    fn what_stands_already_is_not_varied_again() {
        let situation = Situation::of(&[record(&[], 5.0, 1)]);
        let whole = catalogue(&Model::default(), &situation);
        let gain = EffectSpec::new("winch_force_gain", Some(2), &[0.01]).unwrap();
        let less = catalogue(&Model { effects: vec![gain], ..Model::default() }, &situation);
        // On its cable and on all.
        assert_eq!(whole.candidates.len() - less.candidates.len(), 2);
        assert_eq!(whole.columns.len() - less.columns.len(), 2);
        assert_eq!(whole.variations.len() - less.variations.len(), 1);
        assert!(!less.variations.iter().any(|varied| varied.id == "winch_force_gain" && varied.cable == Some(2)));
        let drag = |library: &Library| {
            let candidate = library.candidates.iter().find(|c| c.id == "platform_linear_drag").unwrap();
            let (at, _) = library.columns[candidate.columns[0]][0];
            library.variations[at].id.clone()
        };
        assert_eq!(drag(&less), drag(&whole));
    }

    #[test]
    fn a_cable_without_mass_has_no_transverse_mode_and_no_panic() {
        let mut model = Model::default();
        let situation = Situation::of(&[record(&[], 5.0, 1)]);
        let count = |model: &Model| {
            let library = catalogue(model, &situation);
            library.candidates.iter().filter(|c| c.id == "cable_transverse_mode").count()
        };
        assert_eq!(count(&model), 5);
        model.parameters.cable_density = 0.0;
        assert_eq!(count(&model), 0);
    }
}
